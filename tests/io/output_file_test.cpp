#include <hooke/error.hpp>
#include <hooke/io/output_file.hpp>
#include <hooke/io/tables.hpp>
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <clocale>
#include <cstdlib>
#include <functional>

namespace hooke::io {
namespace {

using std::filesystem::exists;
using test::contents;
using test::TemporaryFolder;
using ::testing::HasSubstr;

TEST(OutputFile, HasItsNameOnlyWhenItIsComplete) {
  TemporaryFolder folder;
  OutputFile file(folder / "state.csv");
  file.write("a,");
  file.write(0.1);
  EXPECT_TRUE(exists(folder / "state.part.csv"));
  EXPECT_FALSE(exists(folder / "state.csv"));
  file.commit();
  EXPECT_FALSE(exists(folder / "state.part.csv"));
  EXPECT_EQ(contents(folder / "state.csv"), "a,0.10000000000000001");
}

TEST(OutputFile, WithoutCommitItGoesOrStaysAsAsked) {
  TemporaryFolder folder;
  folder.write("old.csv", "old");
  {
    OutputFile file(folder / "old.csv");
    file.write("new");
    OutputFile kept(folder / "kept.pc2", OutputFile::Leftover::Keep);
    kept.write("samples");
  }
  EXPECT_EQ(contents(folder / "old.csv"), "old");
  EXPECT_FALSE(exists(folder / "old.part.csv"));
  EXPECT_EQ(contents(folder / "kept.part.pc2"), "samples");
}

TEST(OutputFile, ANumberReadsBackAsTheSameDoubleInAnyLocale) {
  for (const char* locale : {"C", "de_DE.UTF-8", "C.UTF-8"}) {
    std::setlocale(LC_ALL, locale);  // where it is not installed nothing changes
    for (const double value : {0.1, 1.0 / 3, -1e-300, 123456789.123456789, 5e-324}) {
      const std::string text = text_of(value);
      EXPECT_EQ(text.find(','), std::string::npos);
      std::setlocale(LC_ALL, "C");
      EXPECT_EQ(std::strtod(text.c_str(), nullptr), value) << text;
      std::setlocale(LC_ALL, locale);
    }
  }
  std::setlocale(LC_ALL, "C");
}

std::string failure_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const OutputError& error) {
    return error.what();
  }
  return "no OutputError";
}

TEST(OutputFile, AFullDiskIsToldWithFileAndReason) {
  if (!exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder / "state.part.csv");
  const std::string small = failure_of([&] {
    OutputFile file(folder / "state.csv");
    file.write("a");
    file.commit();
  });
  EXPECT_THAT(small, HasSubstr("state.csv"));
  EXPECT_THAT(small, HasSubstr("No space left"));
  EXPECT_FALSE(exists(folder / "state.csv"));
  std::filesystem::remove(folder / "state.part.csv");
  std::filesystem::create_symlink("/dev/full", folder / "state.part.csv");
  const std::string large = failure_of([&] {
    OutputFile file(folder / "state.csv");
    file.write(std::string(1 << 20, 'a'));
  });
  EXPECT_THAT(large, HasSubstr("No space left"));
  EXPECT_FALSE(exists(folder / "state.csv"));
}

TEST(OutputFile, FoldersThatCannotBeWrittenAreTold) {
  TemporaryFolder folder;
  folder.write("file", "");
  EXPECT_THAT(failure_of([&] { OutputFile(folder / "missing/state.csv"); }), HasSubstr("missing/state.csv"));
  EXPECT_THAT(failure_of([&] { make_folder(folder / "file/below"); }), HasSubstr("cannot make the folder"));
  EXPECT_THAT(failure_of([&] { make_folder(folder / "file"); }), HasSubstr("cannot make the folder"));
  EXPECT_THAT(failure_of([&] { make_folder("/proc/hooke"); }), HasSubstr("/proc/hooke"));
}

TEST(OutputFile, AFolderInTheWayOfTheNameIsTold) {
  TemporaryFolder folder;
  std::filesystem::create_directories(folder / "state.csv/full");
  EXPECT_THAT(failure_of([&] {
                OutputFile file(folder / "state.csv");
                file.commit();
              }),
              HasSubstr("cannot rename"));
  EXPECT_FALSE(exists(folder / "state.part.csv"));
}

TEST(StateTable, QuotesNamesAndKeepsSeventeenDigits) {
  TemporaryFolder folder;
  Points<double> x(2, 3), v(2, 3);
  x << 1, 2, 1.0 / 3, 0, 0, 0;
  v << -0.1, 0, 0, 0, 0, 1e-20;
  StateTable table(folder / "state.csv");
  table.add("a, \"b\"", x, v);
  table.finish();
  EXPECT_EQ(contents(folder / "state.csv"),
            "body,index,x,y,z,vx,vy,vz\n"
            "\"a, \"\"b\"\"\",0,1,2,0.33333333333333331,-0.10000000000000001,0,0\n"
            "\"a, \"\"b\"\"\",1,0,0,0,0,0,9.9999999999999995e-21\n");
}

TEST(Tables, RowsAreOnDiskBeforeTheFileIsComplete) {
  TemporaryFolder folder;
  DiagnosticsTable table(folder / "diagnostics.csv");
  table.add({0.5, 1, 2, 3, {4, 5, 6}, 0.25});
  EXPECT_EQ(contents(folder / "diagnostics.part.csv"),
            "time,kinetic,gravitational,elastic,total,momentum_x,momentum_y,momentum_z,worst_stretch\n"
            "0.5,1,2,3,6,4,5,6,0.25\n");
  table.finish();
  EXPECT_TRUE(exists(folder / "diagnostics.csv"));
  NumberTable numbers(folder / "numbers.csv", {"a", "b"});
  EXPECT_THROW(numbers.add({1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::io
