// hooke report as its users meet it.
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace hooke {
namespace {

using std::filesystem::exists;
using test::contents;
using ::testing::HasSubstr;

class Report : public ::testing::Test {
 protected:
  struct Result {
    int code = -1;
    std::string out, err;
  };
  Result run(const std::string& arguments) {
    const std::string line = std::string(HOOKE_COMMAND) + " report " + arguments + " >" +
                             (folder_ / "out.txt").string() + " 2>" + (folder_ / "err.txt").string();
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(folder_ / "out.txt"), contents(folder_ / "err.txt")};
  }
  std::string out() const { return (folder_ / "report").string(); }

  test::TemporaryFolder folder_;
};

std::vector<std::string> split(const std::string& text, char by) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string piece; std::getline(stream, piece, by);) out.push_back(piece);
  return out;
}

TEST_F(Report, WritesATableAPageAndConclusions) {
  const Result result = run("ship --quick --budget 0.3 --out " + out());
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the cheapest is"));
  EXPECT_THAT(contents(folder_ / "report/report.html"), HasSubstr("The ship whose acceleration grows"));
  const auto lines = split(contents(folder_ / "report/report.csv"), '\n');
  ASSERT_GT(lines.size(), 20u);
  const auto header = split(lines[0], ',');
  const auto column = [&](const char* name) {
    return std::size_t(std::find(header.begin(), header.end(), name) - header.begin());
  };
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto cells = split(lines[i], ',');
    ASSERT_GE(cells.size(), header.size()) << lines[i];
    EXPECT_EQ(cells[0], "ship");
    EXPECT_EQ(cells[column("status")], "ok");
    for (const char* name : {"dt", "seconds_per_simulated_second", "rms_error", "max_error", "evaluations"})
      EXPECT_TRUE(std::isfinite(std::stod(cells[column(name)]))) << name << ": " << lines[i];
    EXPECT_EQ(cells[column("energy_drift")], "") << "the ship's energy is no constant";
  }
}

TEST_F(Report, BadInputIsExitCodeTwoAndOneLine) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"no-such-scene --out " + out(), "no standard scene \"no-such-scene\"; there are oscillator"},
      {"ship --out " + out() + " --budget 0", "--budget must be positive"},
      {"ship --out " + out() + " --budget -3", "--budget must be positive"},
      {"ship --out " + out() + " --budget nan", "--budget must be positive"},
      {"ship --out " + out() + " --budget soon", "--budget"},
      {"ship", "--out"},
  };
  for (const auto& [arguments, words] : cases) {
    const Result result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_THAT(result.err, HasSubstr(words)) << arguments;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(exists(folder_ / "report")) << arguments;
  }
}

TEST_F(Report, AFolderThatCannotBeWrittenIsExitCodeThreeAtOnce) {
  for (const char* folder : {"/dev/null/x", "/proc/hooke"}) {
    const Result result = run(std::string("hanging-sheet-128 --out ") + folder);
    EXPECT_EQ(result.code, 3) << folder;
    EXPECT_THAT(result.err, HasSubstr(folder));
  }
}

TEST_F(Report, GoesOnWithoutGnuplot) {
  // A folder of nothing for PATH: the command itself is called by its full name.
  std::filesystem::create_directories(folder_ / "empty");
  const std::string line = "PATH=" + (folder_ / "empty").string() + " " + HOOKE_COMMAND +
                           " report ship throw-linear-drag --quick --budget 0.1 --out " + out() + " >/dev/null 2>" +
                           (folder_ / "err.txt").string();
  const int status = std::system(line.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const std::string told = contents(folder_ / "err.txt");
  EXPECT_THAT(told, HasSubstr("there is no gnuplot"));
  EXPECT_EQ(told.find("there is no gnuplot"), told.rfind("there is no gnuplot")) << "said once";
  EXPECT_TRUE(exists(folder_ / "report/report.html"));
  EXPECT_FALSE(exists(folder_ / "report/ship.png"));
}

}  // namespace
}  // namespace hooke
