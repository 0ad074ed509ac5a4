// A wanted error in scene files and the command, and the error estimate of a run.
#include <hooke/error.hpp>
#include <io/temporary_folder.hpp>
#include <scene/accuracy.hpp>
#include <scene/parse.hpp>
#include <scene/standard.hpp>

#include <gmock/gmock.h>

#include <sys/wait.h>

#include <cstdlib>

namespace hooke::scene {
namespace {

using ::testing::HasSubstr;

std::string sheet(const std::string& solver) {
  return R"({"hooke": 1, "duration": 0.2, "bodies": [{"type": "soft", "name": "sheet",
    "grid": {"size": [1, 1], "points": [10, 10]}, "pin": "top", "solver": {)" +
         solver + "}}]}";
}

TEST(WantedError, IsReadAndChosen) {
  const SceneDescription description = parse_scene(sheet(R"("error": 1e-3)"), "sheet.json");
  EXPECT_EQ(description.bodies[0].solver.error, 1e-3);
  Scene scene = build(description);
  ASSERT_TRUE(scene.bodies[0].choice);
  EXPECT_TRUE(scene.bodies[0].choice->meets);
  ASSERT_TRUE(scene.world.update(0.1).good());
  const MotionFacts facts = scene.bodies[0].body->motion_facts();
  EXPECT_EQ(facts.method, scene.bodies[0].choice->method->name);
  EXPECT_EQ(facts.substeps, scene.bodies[0].choice->substeps);
}

TEST(WantedError, StandsAlone) {
  for (const char* other : {R"("method": "rk4")", R"("dt": 1e-3)", R"("precision": "double")"}) {
    try {
      parse_scene(sheet(std::string(R"("error": 1e-3, )") + other), "sheet.json");
      FAIL() << other;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("is chosen where an \"error\" is wanted")) << other;
      EXPECT_THAT(error.what(), HasSubstr("bodies[0].solver.")) << other;
    }
  }
}

TEST(WantedError, MustBePositive) {
  for (const char* value : {"0", "-1e-3", "\"small\"", "null", "1e999"})
    EXPECT_THROW(parse_scene(sheet(std::string(R"("error": )") + value), "sheet.json"), Error) << value;
}

// The estimate may be wrong by this factor either way.
constexpr double kFactor = 4;

class Estimate : public ::testing::TestWithParam<softbody::Precision> {};

TEST_P(Estimate, IsWithinAFactorOfTheTruthOnTheHangingSheet) {
  SceneDescription description = hanging_sheet(32);
  description.bodies[0].solver.precision = GetParam();
  Scene scene = build(description);
  ASSERT_TRUE(scene.world.update(description.duration).good());
  const ErrorEstimate estimate = estimate_errors(scene);
  const Accuracy truth = verify_errors(scene)[0];
  EXPECT_LT(truth.uncertainty, 0.1 * truth.error);
  EXPECT_GT(estimate.bodies[0].error, truth.error / kFactor);
  EXPECT_LT(estimate.bodies[0].error, truth.error * kFactor);
  EXPECT_NEAR(estimate.part, kEstimatedPart, 0.01);
  EXPECT_NEAR(estimate.cost, 3 * estimate.part, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Precisions, Estimate,
                         ::testing::Values(softbody::Precision::Float, softbody::Precision::Double),
                         [](const auto& which) {
                           return which.param == softbody::Precision::Float ? "Float" : "Double";
                         });

TEST(Estimate, KnowsACoarserRunForWorse) {
  SceneDescription description = hanging_sheet(16);
  Solver& solver = description.bodies[0].solver;
  solver.precision = softbody::Precision::Double;
  solver.dt = 1e-3;
  const double coarse = estimate_errors(build(description)).bodies[0].error;
  solver.dt = 2.5e-4;
  const double fine = estimate_errors(build(description)).bodies[0].error;
  EXPECT_GT(coarse, 8 * fine);
  EXPECT_LT(coarse, 40 * fine);
}

class ErrorCommand : public ::testing::Test {
 protected:
  int run(const std::string& arguments) {
    const std::string line = std::string(HOOKE_COMMAND) + " simulate " + arguments + " --out " +
                             (folder_ / "run").string() + " >" + (folder_ / "out.txt").string() + " 2>" +
                             (folder_ / "err.txt").string();
    const int status = std::system(line.c_str());
    out_ = test::contents(folder_ / "out.txt"), err_ = test::contents(folder_ / "err.txt");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string scene(const std::string& solver) { return folder_.write("scene.json", sheet(solver)).string(); }

  test::TemporaryFolder folder_;
  std::string out_, err_;
};

TEST_F(ErrorCommand, TellsChoiceEstimateAndTruth) {
  EXPECT_EQ(run(scene("") + " --error 1e-4 --verify"), 0) << err_;
  EXPECT_THAT(out_, HasSubstr("force evaluations"));
  EXPECT_THAT(out_, HasSubstr("from the chooser's trials"));
  EXPECT_THAT(out_, HasSubstr("true error"));
  EXPECT_EQ(run(scene(R"("error": 1e-4)")), 0) << err_;
  EXPECT_THAT(out_, HasSubstr("from the chooser's trials"));
}

TEST_F(ErrorCommand, EstimatesOrdinaryRunsUnlessToldNotTo) {
  EXPECT_EQ(run(scene("")), 0) << err_;
  EXPECT_THAT(out_, HasSubstr("error estimate"));
  EXPECT_THAT(out_, HasSubstr("from half the step over the first"));
  EXPECT_EQ(run(scene("") + " --no-error-estimate"), 0) << err_;
  EXPECT_THAT(out_, ::testing::Not(HasSubstr("error estimate")));
}

TEST_F(ErrorCommand, BadErrorsAreBadInput) {
  for (const char* error : {"0", "-1", "nan", "inf", "small"}) {
    EXPECT_EQ(run(scene("") + " --error " + error), 2) << error;
    EXPECT_THAT(err_, HasSubstr("--error")) << error;
  }
  for (const char* other : {"--method rk4", "--dt 1e-3", "--precision double"}) {
    EXPECT_EQ(run(scene("") + " --error 1e-3 " + other), 2) << other;
    EXPECT_THAT(err_, HasSubstr("--error chooses what")) << other;
  }
  EXPECT_EQ(run(scene(R"("error": 1e-3, "method": "rk4")")), 2);
  EXPECT_THAT(err_, HasSubstr("solver.method: is chosen where"));
}

// Given on the command line, a method replaces what the file wants.
TEST_F(ErrorCommand, AMethodOnTheCommandLineReplacesTheFilesError) {
  EXPECT_EQ(run(scene(R"("error": 1e-3)") + " --method rk4"), 0) << err_;
  EXPECT_THAT(out_, HasSubstr("rk4"));
  EXPECT_THAT(out_, HasSubstr("from half the step"));
}

}  // namespace
}  // namespace hooke::scene
