// The short form of the stability table: every gate that a solver claims is met. What fails and is known to is in
// known_failures.csv, each with what it does; nothing may be worse than it says there.
#include <stability/scenes.hpp>
#include <stability/trial.hpp>

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace hooke::stability {
namespace {

// case,parameter,method,precision,outcome; * is any.
struct Known {
  std::string hard, parameter, method, precision, outcome;

  bool is_of(const Row& row) const {
    const auto fits = [](const std::string& pattern, const std::string& value) {
      return pattern == "*" || pattern == value;
    };
    return fits(hard, row.hard) && fits(parameter, row.parameter) && fits(method, row.method) &&
           fits(precision, row.precision);
  }
};

std::vector<Known> known_failures() {
  std::ifstream file(HOOKE_STABILITY_FOLDER "/known_failures.csv");
  std::vector<Known> out;
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "case;parameter;method;precision;outcome");
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    Known known;
    for (std::string* cell : {&known.hard, &known.parameter, &known.method, &known.precision, &known.outcome})
      std::getline(cells, *cell, ';');
    out.push_back(known);
  }
  return out;
}

class HardCase : public ::testing::TestWithParam<Case> {};

TEST_P(HardCase, MeetsEveryGateThatIsClaimed) {
  const std::vector<Known> known = known_failures();
  if (GetParam().parameters.empty()) GTEST_SKIP() << "of the long form alone";
  int measured = 0;
  for (const Trial& trial : trials(GetParam(), false)) {
    const Row row = measure(GetParam(), trial);
    measured += row.measured();
    const std::string name = row.parameter + ", " + row.method + ", " + row.precision;
    EXPECT_TRUE(row.outcome == Outcome::Met || !row.said.empty() || row.bounded()) << name << ": no reason is given";
    const auto excuse = std::find_if(known.begin(), known.end(), [&](const Known& k) { return k.is_of(row); });
    if (row.outcome == Outcome::Met && excuse != known.end() && excuse->method != "*")
      std::printf("  %s meets its gate now: strike it from known_failures.csv\n", name.c_str());
    if (row.outcome != Outcome::Missed && row.outcome != Outcome::Broke) continue;
    if (excuse == known.end())
      ADD_FAILURE() << name << " " << name_of(row.outcome) << ": " << row.figure << " against " << row.gate << "; "
                    << row.said;
    else
      EXPECT_FALSE(row.outcome == Outcome::Broke && excuse->outcome == "missed")
          << name << " broke at " << row.failed_at << " s, known was that it misses its gate; " << row.said;
  }
  EXPECT_GT(measured, 0);
}

INSTANTIATE_TEST_SUITE_P(Stability, HardCase, ::testing::ValuesIn(cases()), [](const auto& test) {
  std::string name = test.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(KnownFailures, NameCasesAndSolversThatExist) {
  const auto all = cases();
  const auto names = solvers();
  for (const Known& known : known_failures()) {
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Case& hard) { return hard.name == known.hard; }))
        << known.hard;
    EXPECT_TRUE(known.method == "*" || std::find(names.begin(), names.end(), known.method) != names.end())
        << known.method;
    EXPECT_TRUE(known.outcome == "missed" || known.outcome == "broke") << known.outcome;
  }
}

// What the cases are judged by.

TEST(Statics, AChainHangsAsItsClosedForm) {
  const scene::Scene scene = build(heavy_chain(10), {});
  const Balance balance = balance_of(scene.bodies[0], scene.world.gravity());
  EXPECT_LT(balance.residual, 1e-9);
  const double k = scene.bodies[0].network->springs[0].stiffness;
  double y = 0;
  for (int i = 1; i <= 10; ++i) {
    y -= 0.1 + (0.1 * (10 - i) + 1) * 9.81 / k;
    EXPECT_NEAR(balance.positions(i, 1), y, 1e-9) << i;
  }
}

TEST(Statics, AHammockIsAtRestThere) {
  const scene::Scene scene = build(hammock(10), {});
  const Balance balance = balance_of(scene.bodies[0], scene.world.gravity());
  EXPECT_LT(balance.residual, 1e-9);
  EXPECT_LT(balance.positions.col(1).minCoeff(), -0.02);
}

TEST(Watch, TellsWhenAMotionIsLost) {
  scene::SceneDescription d = hard_sheet(6, 1e4, 1);
  d.tick_rate = 60;
  Solver solver;
  solver.dt = 1.0 / 60;
  scene::Scene scene = build(d, solver);
  Row row;
  Watch watch(scene.world, row, 10, kAnyWork);
  EXPECT_FALSE(watch.run(2));
  EXPECT_EQ(row.outcome, Outcome::Broke);
  EXPECT_LT(row.failed_at, 0.2);
  EXPECT_FALSE(row.said.empty());
}

TEST(Watch, StopsWhatIsTooDear) {
  scene::Scene scene = build(hard_sheet(6, 1, 1), {});
  Row row;
  Watch watch(scene.world, row, 10, 1000);
  EXPECT_FALSE(watch.run(1));
  EXPECT_EQ(row.outcome, Outcome::TooDear);
}

TEST(Judge, ComparesTheFigureWithTheGate) {
  Row row;
  judge(row, 0.5, 1);
  EXPECT_EQ(row.outcome, Outcome::Met);
  judge(row, 1.5, 1);
  EXPECT_EQ(row.outcome, Outcome::Missed);
  judge(row, kNone, 1);
  EXPECT_EQ(row.outcome, Outcome::Missed) << "no figure is no answer";
  row.outcome = Outcome::Broke;
  judge(row, 0.5, 1);
  EXPECT_EQ(row.outcome, Outcome::Broke);
}

}  // namespace
}  // namespace hooke::stability
