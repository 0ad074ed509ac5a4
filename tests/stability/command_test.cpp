// hooke stability as its users meet it.
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <sys/wait.h>

namespace hooke {
namespace {

using test::contents;
using ::testing::HasSubstr;

class Stability : public ::testing::Test {
 protected:
  int run(const std::string& arguments) {
    const std::string line = std::string(HOOKE_COMMAND) + " stability " + arguments + " >" +
                             (folder_ / "out.txt").string() + " 2>" + (folder_ / "err.txt").string();
    const int status = std::system(line.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  test::TemporaryFolder folder_;
};

TEST_F(Stability, WritesATableAPageAndAMarkdown) {
  ASSERT_EQ(run("coincident-points variable-frames --threads 2 --out " + (folder_ / "table").string()), 0)
      << contents(folder_ / "err.txt");
  const std::string csv = contents(folder_ / "table/table.csv");
  EXPECT_THAT(csv, HasSubstr("case,parameter,method,precision,outcome"));
  EXPECT_THAT(csv, HasSubstr("coincident-points,rest length 0,velocity-verlet,float,met,yes,0"));
  EXPECT_THAT(csv, HasSubstr("variable-frames,,rk4,double,met"));
  EXPECT_THAT(contents(folder_ / "table/table.html"), HasSubstr("<h2>Coincident points</h2>"));
  EXPECT_THAT(contents(folder_ / "table/table.md"), HasSubstr("| coincident-points | rest length 0 |"));
  EXPECT_THAT(contents(folder_ / "out.txt"), HasSubstr("coincident-points: "));
}

TEST_F(Stability, NamesTheCasesThereAre) {
  EXPECT_EQ(run("no-such-case --out " + (folder_ / "table").string()), 2);
  EXPECT_THAT(contents(folder_ / "err.txt"), HasSubstr("\"no-such-case\"; there are mass-ratio-chain"));
}

TEST_F(Stability, TellsWhereItCannotWrite) { EXPECT_EQ(run("coincident-points --out /dev/null/table"), 3); }

}  // namespace
}  // namespace hooke
