// The report's parts: standard scenes with known answers, measuring, and conclusions that follow the rows.
#include <report/report.hpp>

#include <hooke/method.hpp>
#include <scene/fput.hpp>

#include <gmock/gmock.h>

#include <cmath>
#include <set>

namespace hooke::report {
namespace {

using scene::StandardScene;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

StandardScene named(const std::string& name) {
  for (StandardScene& scene : scene::standard_scenes())
    if (scene.name == name) return scene;
  throw std::runtime_error("no scene " + name);
}

World end_of(const StandardScene& scene, const char* method, int steps_a_tick) {
  scene::Solver solver;
  solver.method = method;
  solver.precision = softbody::Precision::Double;
  solver.dt = scene.duration / scene.ticks / steps_a_tick;
  World world = scene.build(solver);
  EXPECT_TRUE(world.update(scene.duration).good());
  EXPECT_NEAR(world.time(), scene.duration, 1e-12) << "a whole number of ticks";
  return world;
}

TEST(StandardScenes, AllRunForOneTickInBothPrecisions) {
  for (const StandardScene& scene : scene::standard_scenes()) {
    SCOPED_TRACE(scene.name);
    EXPECT_FALSE(scene.problem.empty());
    for (const auto precision : {softbody::Precision::Float, softbody::Precision::Double}) {
      scene::Solver solver;
      solver.precision = precision;
      World world = scene.build(solver);
      EXPECT_NEAR(world.clock().tick() * scene.ticks, scene.duration, 1e-12);
      EXPECT_TRUE(world.update(world.clock().tick()).good());
      if (scene.exact) {
        EXPECT_EQ(scene.exact(0).rows(), world.bodies()[0]->size());
      }
    }
  }
}

TEST(StandardScenes, ClosedFormsAreWhatAFineRunGives) {
  for (const StandardScene& scene : scene::standard_scenes()) {
    if (!scene.exact) continue;
    const Points<double> error = end_of(scene, "rk4", 100).bodies()[0]->positions() - scene.exact(scene.duration);
    EXPECT_LT(error.abs().maxCoeff(), 2e-8) << scene.name;
  }
}

TEST(StandardScenes, AgreeWithPublishedDigits) {
  const Points<double> thrown = end_of(named("throw-quadratic-drag"), "rk4", 1000).bodies()[0]->positions();
  EXPECT_NEAR(thrown(0, 0), 60.7605452585, 1e-9);
  EXPECT_NEAR(thrown(0, 1), 24.9712406124, 1e-9);
  const Points<double> pendulum = end_of(named("stiff-pendulum"), "rk4", 1000).bodies()[0]->positions();
  EXPECT_NEAR(pendulum(1, 0), -0.8013293243, 1e-7);
  EXPECT_NEAR(pendulum(1, 1), -0.6012191973, 1e-7);
  const Values<double> stiff = scene::stiff_energies(*end_of(named("fput-chain"), "rk4", 200).bodies()[0]);
  EXPECT_NEAR(stiff[0], 0.956065120, 1e-6);
  EXPECT_NEAR(stiff[1], 0.025680530, 1e-6);
}

TEST(Measure, HasARowForEveryMethodAndPrecisionWithFiniteNumbers) {
  const SceneReport report = measure(named("oscillator"), {0.5, 0.001}, [](double) {});
  for (const Method* method : methods())
    for (const char* precision : {"float", "double"}) {
      int rows = 0, good = 0;
      for (const Row& row : report.rows) {
        if (row.method != method->name || row.precision != precision) continue;
        ++rows;
        if (!row.ok()) continue;
        ++good;
        EXPECT_TRUE(row.dt > 0 && row.seconds > 0 && std::isfinite(row.seconds) && std::isfinite(row.rms) &&
                    row.worst >= row.rms && std::isfinite(row.energy_drift) && row.evaluations > 0)
            << name_of(row);
      }
      EXPECT_GE(rows, 2) << method->name << " " << precision;
      if (std::string(method->name) != "explicit-euler") {
        EXPECT_GE(good, 1) << method->name << " " << precision;
      }
    }
  EXPECT_EQ(report.reference.uncertainty(), 0) << "a closed form";
}

TEST(Measure, HasRowsOfXpbdAndBackwardEulerFromCoarseSteps) {
  const StandardScene scene = named("elastic-pendulum");
  const double tick = scene.duration / scene.ticks;
  const SceneReport report = measure(scene, {0.5, 0.001}, [](double) {});
  for (const char* method : {"xpbd", "implicit-euler"})
    for (const char* precision : {"float", "double"}) {
      double coarsest = 0, finest = tick, first = 0, least = 1e300;
      for (const Row& row : report.rows) {
        if (row.method != method || row.precision != precision || !row.ok()) continue;
        if (row.dt > coarsest) coarsest = row.dt, first = row.rms;
        finest = std::min(finest, row.dt), least = std::min(least, row.rms);
      }
      EXPECT_NEAR(coarsest, tick, 1e-12) << method << " " << precision;
      EXPECT_LT(finest, 0.1 * tick) << method << " " << precision;
      EXPECT_LT(least, 0.5 * first) << method << " " << precision;
    }
  std::set<std::string> colors;
  for (const char* method : {"xpbd", "implicit-euler", "filtered-leapfrog", "velocity-verlet", "yardstick"})
    colors.insert(color_of(method));
  EXPECT_EQ(colors.size(), 5u);
}

TEST(Measure, ErrorsFallAtTheMethodsOrder) {
  const SceneReport report = measure(named("elastic-pendulum"), {0.5, 0.001}, [](double) {});
  double before = 0, slope = 0;
  for (const Row& row : report.rows) {
    if (row.method != "velocity-verlet" || row.precision != "double" || !row.ok()) continue;
    slope = std::log2(before / row.rms), before = row.rms;
  }
  EXPECT_NEAR(slope, 2, 0.05);
  EXPECT_LT(report.reference.uncertainty(), 1e-9);
  EXPECT_GT(report.reference.method_difference, 0) << "two methods, not one";
}

TEST(Measure, ABlowUpIsARowAndSaysSo) {
  const SceneReport report = measure(named("tumbling-net"), {0.5, 0.001}, [](double) {});
  int blown_up = 0;
  for (const Row& row : report.rows) {
    if (row.method != "explicit-euler") continue;
    EXPECT_EQ(row.status, "blow-up");
    EXPECT_TRUE(std::isnan(row.rms) && std::isnan(row.seconds)) << "an answer of a run that failed";
    ++blown_up;
  }
  EXPECT_GT(blown_up, 0);
  EXPECT_THAT(conclusions(report), Contains(HasSubstr("explicit-euler (")));
}

TEST(Measure, RefusalsAreTold) {
  const SceneReport report = measure(named("throw-linear-drag"), {0.2, 0.001}, [](double) {});
  EXPECT_THAT(report.notes, Contains(HasSubstr("pefrl in double: ")));
  for (const Row& row : report.rows) EXPECT_NE(row.method, "pefrl");
  EXPECT_THAT(measure(named("ship"), {0.2, 0.001}, [](double) {}).notes, Contains(HasSubstr("xpbd in double: ")));
}

Row made(const char* method, double seconds, double rms, const char* status = "ok") {
  Row row;
  row.method = method, row.precision = "double", row.status = status;
  row.dt = 0.01, row.seconds = seconds, row.rms = row.worst = rms;
  row.energy_drift = std::nan("");
  return row;
}

SceneReport made_report() {
  SceneReport report;
  report.size = 1;
  report.rows = {made("velocity-verlet", 1, 5e-3),
                 made("velocity-verlet", 2, 5e-4),
                 made("rk4", 3, 5e-3),
                 made("rk4", 4, 5e-6),
                 made("yardstick", 5, 5e-4),
                 made("explicit-euler", 0.1, 1e-9, "blow-up")};
  return report;
}

TEST(Cheapest, IsTheLeastTimeThatReachesTheError) {
  const SceneReport report = made_report();
  const auto table = cheapest(report);
  ASSERT_EQ(table.size(), 8u);
  EXPECT_EQ(table[0].row, &report.rows[0]);
  EXPECT_EQ(table[2].row, &report.rows[1]);
  EXPECT_EQ(table[4].row, &report.rows[3]);
  EXPECT_EQ(table[5].row, nullptr) << "a run that blew up has no answer";
}

TEST(Cheapest, SaysNothingBelowTheReferencesUncertainty) {
  SceneReport report = made_report();
  report.reference.method_difference = 2e-4;
  EXPECT_EQ(cheapest(report)[4].row, nullptr);
  EXPECT_THAT(conclusions(report), Contains(HasSubstr("the reference itself is uncertain")));
}

TEST(Pareto, IsWhatNothingBeats) {
  const SceneReport report = made_report();
  EXPECT_THAT(pareto(report), ::testing::ElementsAre(&report.rows[0], &report.rows[1], &report.rows[3]));
}

TEST(Conclusions, FollowTheRows) {
  SceneReport report = made_report();
  EXPECT_THAT(conclusions(report), Contains(HasSubstr("1e-3 m the cheapest is velocity-verlet in double")));
  EXPECT_THAT(conclusions(report),
              Contains(HasSubstr("At errors of 1e-1 to 1e-3 m Hooke's cheapest is 2.5 to 5 times")));
  report.rows[3].seconds = 0.5;  // RK4 becomes the cheapest of all
  EXPECT_THAT(conclusions(report), Contains(HasSubstr("errors of 1e-1 to 1e-5 m the cheapest is rk4 in double")));
  EXPECT_THAT(conclusions(report), Not(Contains(HasSubstr("cheapest is velocity-verlet"))));
  EXPECT_THAT(conclusions(report), Contains(HasSubstr("Hooke's cheapest is 10 times as fast as the yardstick")));
}

TEST(Page, IsOneFileWithNothingFromElsewhere) {
  SceneReport report = made_report();
  report.scene = named("oscillator");
  report.scene.problem = "</script><b>";
  report.rows[0].setting = "</script>";
  const std::string text = page({report}, this_machine());
  EXPECT_THAT(text, HasSubstr("Plotly"));
  EXPECT_THAT(text, HasSubstr("&lt;/script&gt;&lt;b&gt;"));
  EXPECT_THAT(text, Not(HasSubstr("<script src")));
  EXPECT_THAT(text, Not(HasSubstr("<link")));
  std::size_t scripts = 0;
  for (std::size_t at = 0; (at = text.find("</script>", at)) != std::string::npos; ++at) ++scripts;
  EXPECT_EQ(scripts, 3u) << "data, plotting library, page: nothing in the data ends one";
}

}  // namespace
}  // namespace hooke::report
