// The chooser: what it picks, what it refuses, and what it says.
#include <hooke/softbody/choose_solver.hpp>
#include <hooke/world.hpp>

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

namespace hooke::softbody {
namespace {

// The hanging sheet of n × n points, side 1 m, tilted by 45 degrees.
SoftBodySettings sheet(int n, double damping = 0) {
  SoftBodySettings s;
  s.positions.resize(n * n, 3);
  SpringNetwork net;
  const double d = 1.0 / (n - 1), c = std::sqrt(0.5);
  const auto join = [&](int a, int b, double k) {
    Spring spring;
    spring.a = a, spring.b = b, spring.stiffness = k, spring.damping = damping;
    net.springs.push_back(spring);
  };
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column) {
      const int i = row * n + column;
      s.positions.row(i) << d * column, -c * d * row, c * d * row;
      if (column + 1 < n) join(i, i + 1, 500);
      if (row + 1 < n) join(i, i + n, 500);
      if (row + 1 < n && column + 1 < n) join(i, i + n + 1, 100), join(i + 1, i + n, 100);
      if (column + 2 < n) join(i, i + 2, 5);
      if (row + 2 < n) join(i, i + 2 * n, 5);
    }
  s.masses = Values<double>::Constant(n * n, 0.3 / (n * n));
  s.network = std::make_shared<SpringNetwork>(net);
  for (int i = 0; i < n; ++i) s.pins.push_back(i);
  return s;
}

// A chain of 20 points that falls from its held end; the springs very stiff or their dampers very strong.
SoftBodySettings stiff_chain(double stiffness, double damping) {
  SoftBodySettings s;
  s.positions.setZero(20, 3);
  SpringNetwork net;
  for (int i = 0; i < 20; ++i) {
    s.positions(i, 0) = i / 19.0;
    if (i == 0) continue;
    Spring spring;
    spring.a = i - 1, spring.b = i, spring.stiffness = stiffness, spring.damping = damping;
    net.springs.push_back(spring);
  }
  s.masses = Values<double>::Constant(20, 0.05);
  s.network = std::make_shared<SpringNetwork>(net);
  s.pins = {0};
  return s;
}

// A box of n × n × n points, 1 m wide, that hangs from its upper face; pulled longer at the start by a share.
SoftBodySettings box(int n, double stiffness, double stretch, double damping = 0) {
  SoftBodySettings s;
  s.positions.resize(n * n * n, 3);
  SpringNetwork net;
  const double d = 1.0 / (n - 1);
  const auto at = [&](int i, int j, int k) { return (k * n + j) * n + i; };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) s.positions.row(at(i, j, k)) << d * i, -d * k, d * j;
  const auto join = [&](int a, int b) {
    Spring spring;
    spring.a = a, spring.b = b, spring.stiffness = stiffness, spring.damping = damping;
    spring.rest_length = (s.positions.row(a) - s.positions.row(b)).matrix().norm();
    net.springs.push_back(spring);
  };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        if (i + 1 < n) join(at(i, j, k), at(i + 1, j, k));
        if (j + 1 < n) join(at(i, j, k), at(i, j + 1, k));
        if (k + 1 < n) join(at(i, j, k), at(i, j, k + 1));
        if (i + 1 < n && k + 1 < n) join(at(i, j, k), at(i + 1, j, k + 1)), join(at(i + 1, j, k), at(i, j, k + 1));
        if (j + 1 < n && k + 1 < n) join(at(i, j, k), at(i, j + 1, k + 1)), join(at(i, j + 1, k), at(i, j, k + 1));
      }
  s.positions.col(1) *= 1 + stretch;
  s.masses = Values<double>::Constant(n * n * n, 1.0 / (n * n * n));
  s.network = std::make_shared<SpringNetwork>(net);
  for (int i = 0; i < n * n; ++i) s.pins.push_back(i);
  return s;
}

// Of 60 ticks a second, a quarter of one.
RunSetting coarse_ticks() {
  RunSetting run;
  run.duration = 0.25;
  run.tick_rate = 60;
  return run;
}

RunSetting half_a_second() {
  RunSetting run;
  run.duration = 0.5;
  return run;
}

// What the choice really errs by.
Verification truth_of(const SolverChoice& choice, SoftBodySettings body, const RunSetting& run) {
  choice.apply(body);
  return verify(body, run);
}

TEST(Chooser, PicksTheSameEveryTime) {
  const SoftBodySettings body = sheet(16);
  const SolverChoice a = choose_solver(body, half_a_second(), 1e-5);
  SoftBodySettings other = body;
  other.motion.method = &rk4(), other.motion.dt = 1e-3, other.precision = Precision::Double;  // not looked at
  const SolverChoice b = choose_solver(other, half_a_second(), 1e-5);
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.precision, b.precision);
  EXPECT_EQ(a.dt, b.dt);
  EXPECT_EQ(a.predicted_error, b.predicted_error);
  EXPECT_EQ(a.pilot_evaluations, b.pilot_evaluations);
  EXPECT_EQ(a.text(), b.text());
}

TEST(Chooser, SmallerErrorsAreNeverCheaperAndAreMet) {
  const SoftBodySettings body = sheet(24);
  double cost = 0;
  for (const double wanted : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
    const SolverChoice choice = choose_solver(body, half_a_second(), wanted);
    EXPECT_TRUE(choice.meets) << wanted;
    EXPECT_GE(choice.seconds, cost) << wanted << ": " << choice.text();
    EXPECT_LE(choice.predicted_error, choice.wanted_error);
    cost = choice.seconds;
    const Verification truth = truth_of(choice, body, half_a_second());
    EXPECT_TRUE(truth.converged()) << wanted;
    EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  }
}

TEST(Chooser, CountsTheForceEvaluationsOfTheRun) {
  const SoftBodySettings body = sheet(12);
  for (const double wanted : {1e-2, 1e-4, 1e-6, 1e-7}) {
    const SolverChoice choice = choose_solver(body, half_a_second(), wanted);
    SoftBodySettings chosen = body;
    choice.apply(chosen);
    World world;
    Body& moved = world.add(make_soft_body(chosen));
    ASSERT_TRUE(world.update(0.5).good());
    EXPECT_NEAR(double(moved.motion_facts().evaluations), choice.evaluations, 1) << choice.text();
    EXPECT_EQ(moved.motion_facts().substeps, choice.substeps);
  }
}

TEST(Chooser, TakesTheSizeFromTheStart) {
  const SolverChoice choice = choose_solver(sheet(8), half_a_second(), 1e-3);
  EXPECT_NEAR(choice.size, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(choice.wanted_error, 1e-3 * std::sqrt(2.0), 1e-15);
}

TEST(Chooser, GivesDampersToMethodsThatTakeThem) {
  for (const double wanted : {1e-2, 1e-4, 1e-6, 1e-7}) {
    const SolverChoice choice = choose_solver(sheet(12, 0.002), half_a_second(), wanted);
    EXPECT_TRUE(choice.method->accepts_velocity_forces) << choice.text();
    for (const Candidate& c : choice.rejected) EXPECT_TRUE(c.method->accepts_velocity_forces);
    const Verification truth = truth_of(choice, sheet(12, 0.002), half_a_second());
    EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  }
}

TEST(Chooser, TakesXpbdWhereSpringsAreVeryStiff) {
  const SoftBodySettings body = stiff_chain(1e8, 0);
  const SolverChoice choice = choose_solver(body, coarse_ticks(), 3e-2);
  EXPECT_EQ(choice.method, &xpbd()) << choice.text();
  EXPECT_NEAR(choice.dt * double(choice.substeps), 1.0 / 60, 1e-15);
  const Candidate* verlet = nullptr;
  for (const Candidate& c : choice.rejected)
    if (c.method == &velocity_verlet()) verlet = &c;
  EXPECT_TRUE(!verlet || verlet->seconds > 2 * choice.seconds) << choice.text();
  SoftBodySettings chosen = body;
  choice.apply(chosen);
  World world(60);
  const Body& moved = world.add(make_soft_body(chosen));
  ASSERT_TRUE(world.update(0.25).good());
  EXPECT_EQ(double(moved.motion_facts().evaluations), choice.evaluations) << "sweeps";
  const Verification truth = verify(chosen, coarse_ticks());
  EXPECT_TRUE(truth.converged());
  EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  // Softer springs or smaller errors are not for it.
  EXPECT_EQ(choose_solver(stiff_chain(1e4, 0), coarse_ticks(), 3e-2).method, &velocity_verlet());
  EXPECT_NE(choose_solver(body, coarse_ticks(), 1e-6).method, &xpbd());
}

TEST(Chooser, TakesXpbdForABodyNearRest) {
  // It sags by a millionth, and with a few sweeps by far more: the bound of that is what counts.
  for (const double wanted : {1e-2, 1e-3}) {
    const SoftBodySettings body = box(6, 3e6, 0);
    const SolverChoice choice = choose_solver(body, coarse_ticks(), wanted);
    EXPECT_EQ(choice.method, &xpbd()) << choice.text();
    EXPECT_THAT(choice.reason, ::testing::HasSubstr("the body stays within"));
    // Trials included it costs a fraction of velocity Verlet at its limit.
    const double step = make_soft_body(body)->stable_step(velocity_verlet());
    const double verlet =
        SolverCost(body).seconds(velocity_verlet(), Precision::Double, coarse_ticks().duration / step);
    EXPECT_LT(choice.pilot_seconds + choice.seconds, 0.25 * verlet) << choice.text();
    const Verification truth = truth_of(choice, body, coarse_ticks());
    EXPECT_TRUE(truth.converged());
    EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  }
  // Pulled longer it swings by as much as the wanted error: sweeps that damp that are not for it.
  EXPECT_NE(choose_solver(box(6, 3e6, 2e-3), coarse_ticks(), 1e-3).method, &xpbd());
}

TEST(Chooser, DoesNotTakeABodyForOneAtRestThatIsMovedLater) {
  // Its pins go sideways by 0.03 m and come back: neither in the first ticks nor at the end is there anything to see.
  const SoftBodySettings body = box(4, 1e7, 0);
  RunSetting run = coarse_ticks();
  run.prepare = [](Body& moved) {
    const Points<double> start = moved.positions().topRows(16);
    std::vector<Index> pins;
    for (Index i = 0; i < 16; ++i) pins.push_back(i);
    moved.drive_pins(pins, [start](double t, Points<double>& places) {
      const double turn = 2 * 3.14159265358979 / 0.1;
      places = start;
      places.col(0) += 0.015 * (1 - std::cos(turn * std::clamp(t - 0.1, 0.0, 0.1)));
    });
  };
  const SolverChoice choice = choose_solver(body, run, 1e-2);
  const Verification truth = truth_of(choice, body, run);
  EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  EXPECT_THAT(choice.reason, ::testing::Not(::testing::HasSubstr("the body stays within")));
}

TEST(Chooser, KnowsNoOrigin) {
  for (const double wanted : {1e-2, 1e-4, 1e-6})
    for (const SoftBodySettings& body : {sheet(16), box(6, 1e4, 0.01), box(6, 3e6, 0), box(5, 1e4, 0.02, 0.05)}) {
      SoftBodySettings away = body;
      away.origin = {0, 2, -5};
      const SolverChoice here = choose_solver(body, coarse_ticks(), wanted),
                         there = choose_solver(away, coarse_ticks(), wanted);
      EXPECT_EQ(here.method, there.method) << here.text() << "\n" << there.text();
      EXPECT_EQ(here.precision, there.precision);
      EXPECT_EQ(here.substeps, there.substeps) << here.text() << "\n" << there.text();
      EXPECT_NEAR(here.predicted_error, there.predicted_error, 0.01 * here.predicted_error);
    }
}

TEST(Chooser, LooksAtShortRunsAndAtLongOnes) {
  RunSetting run;
  run.tick_rate = 600;
  for (const double duration : {1.0 / 600, 2.0 / 600, 0.25}) {
    run.duration = duration;
    for (const SoftBodySettings& body : {sheet(8), box(4, 3e6, 0), box(4, 1e4, 0.02, 0.05)}) {
      const SolverChoice choice = choose_solver(body, run, 1e-3);
      EXPECT_TRUE(choice.meets) << choice.text();
      EXPECT_LE(truth_of(choice, body, run).error, choice.wanted_error) << choice.text();
    }
  }
}

TEST(Chooser, GivesBodiesThatKeepTheirVolumeToMethodsThatDo) {
  // A tetrahedron of stiff rods that hardly moves, filled.
  SoftBodySettings body;
  body.positions.resize(4, 3);
  body.positions << 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.3, -1, 0.3;
  SpringNetwork net;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < a; ++b) {
      Spring spring;
      spring.a = a, spring.b = b, spring.stiffness = 1e10;
      net.springs.push_back(spring);
    }
  body.network = std::make_shared<SpringNetwork>(net);
  body.masses = Values<double>::Constant(4, 0.1);
  body.pins = {0, 1, 2};
  body.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  body.volume_stiffness = 1e3;
  const SolverChoice choice = choose_solver(body, coarse_ticks(), 1e-3);
  EXPECT_NE(choice.method, &xpbd()) << choice.text();
  EXPECT_TRUE(choice.meets) << choice.text();
}

TEST(Chooser, ForetellsTheErrorOfRoughMotion) {
  // Let go at once from a stretch, half the motion is in modes that the largest stable step does not resolve. Both runs
  // of the pair lose their phases: their difference is the error, and grows slower than time.
  const SoftBodySettings body = box(6, 1e4, 0.01);
  const RunSetting run = coarse_ticks();
  const SolverChoice choice = choose_solver(body, run, 5e-3);
  ASSERT_EQ(choice.method, &velocity_verlet()) << choice.text();
  const Verification truth = truth_of(choice, body, run);
  EXPECT_TRUE(truth.converged());
  EXPECT_GT(choice.predicted_error, truth.error / 1.5) << choice.text();
  EXPECT_LT(choice.predicted_error, truth.error * 2) << choice.text();
  // As its growth is known, it shows early.
  EXPECT_LT(choice.pilot_seconds, 0.4 * choice.seconds) << choice.text();
}

TEST(Chooser, DoesNotLetErrorsOfHighOrdersGrowWhereDampersTakeThem) {
  const SoftBodySettings body = box(6, 1e4, 0.02, 0.05);
  const SolverChoice choice = choose_solver(body, half_a_second(), 1e-6);
  ASSERT_EQ(choice.method, &rk4()) << choice.text();
  const Verification truth = truth_of(choice, body, half_a_second());
  EXPECT_TRUE(truth.converged());
  EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  // And not at many times the steps that it takes.
  EXPECT_GE(truth.error, 0.05 * choice.wanted_error) << choice.text();
}

TEST(Chooser, TakesDoubleWhereFloatWouldBeSteppedInDouble) {
  const SoftBodySettings body = stiff_chain(1e8, 0);
  const SolverChoice choice = choose_solver(body, coarse_ticks(), 1e-3);
  ASSERT_EQ(choice.method, &velocity_verlet()) << choice.text();
  EXPECT_EQ(choice.precision, Precision::Double) << choice.text();
  // The mean speed of a fall is slow at these steps, and not at those of soft springs.
  const double speed = 0.5 * 9.81 * 0.25;
  EXPECT_TRUE(rounding_shows(body, choice.dt, speed, 9.81));
  const SolverChoice soft = choose_solver(stiff_chain(1e4, 0), coarse_ticks(), 1e-3);
  EXPECT_EQ(soft.precision, Precision::Float) << soft.text();
  EXPECT_FALSE(rounding_shows(body, soft.dt, speed, 9.81));
  const auto seconds = [&](Precision precision, bool in_double) {
    return SolverCost(body).seconds(velocity_verlet(), precision, 1000, in_double);
  };
  EXPECT_LT(seconds(Precision::Float, false), seconds(Precision::Double, false));
  EXPECT_EQ(seconds(Precision::Float, true), seconds(Precision::Double, true));
}

TEST(Chooser, TakesBackwardEulerWhereDampersAreVeryStrong) {
  const SoftBodySettings body = stiff_chain(1e5, 1e4);
  const SolverChoice choice = choose_solver(body, coarse_ticks(), 1e-2);
  EXPECT_EQ(choice.method, &implicit_euler()) << choice.text();
  const Verification truth = truth_of(choice, body, coarse_ticks());
  EXPECT_TRUE(truth.converged());
  EXPECT_LE(truth.error, choice.wanted_error) << choice.text();
  const SolverChoice again = choose_solver(body, coarse_ticks(), 1e-2);
  EXPECT_EQ(again.text(), choice.text());
}

TEST(Chooser, SaysSoWhereNothingMeetsIt) {
  const SolverChoice choice = choose_solver(sheet(8), half_a_second(), 1e-17);
  EXPECT_FALSE(choice.meets);
  EXPECT_THAT(choice.text(), ::testing::HasSubstr("nothing meets the wanted error"));
  EXPECT_EQ(choice.precision, Precision::Double);
  for (const Candidate& c : choice.rejected) EXPECT_GE(c.predicted_error, choice.predicted_error);
}

TEST(Chooser, TellsItsReasonAndWhatItRejected) {
  const SolverChoice choice = choose_solver(sheet(16), half_a_second(), 1e-7);
  EXPECT_THAT(choice.text(), ::testing::HasSubstr(std::string(choice.method->name)));
  EXPECT_THAT(choice.text(), ::testing::HasSubstr("force evaluations"));
  EXPECT_FALSE(choice.reason.empty());
  EXPECT_FALSE(choice.rejected.empty());
  EXPECT_GT(choice.pilot_evaluations, 0);
}

TEST(Chooser, LeavesPointsWithoutSpringsToTheTick) {
  SoftBodySettings body;
  body.positions = Points<double>::Random(5, 3);
  body.masses = Values<double>::Constant(5, 1.0);
  const SolverChoice choice = choose_solver(body, half_a_second(), 1e-3);
  EXPECT_TRUE(choice.meets);
  EXPECT_EQ(choice.substeps, 1);
}

TEST(Chooser, RefusesBadInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double wanted : {0.0, -1e-3, nan, infinity})
    EXPECT_THROW(choose_solver(sheet(4), half_a_second(), wanted), std::invalid_argument) << wanted;
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    RunSetting run = half_a_second();
    run.duration = bad;
    EXPECT_THROW(choose_solver(sheet(4), run, 1e-3), std::invalid_argument) << bad;
    run = half_a_second();
    run.tick_rate = bad;
    EXPECT_THROW(choose_solver(sheet(4), run, 1e-3), std::invalid_argument) << bad;
  }
}

TEST(Verify, FindsTheErrorOfACoarseRun) {
  // Semi-implicit Euler near its limit errs far more than velocity Verlet there.
  SoftBodySettings body = sheet(12);
  body.precision = Precision::Double;
  body.motion.method = &semi_implicit_euler();
  const Verification euler = verify(body, half_a_second());
  body.motion.method = &velocity_verlet();
  const Verification verlet = verify(body, half_a_second());
  EXPECT_TRUE(euler.converged());
  EXPECT_TRUE(verlet.converged());
  EXPECT_GT(euler.error, 10 * verlet.error);
}

}  // namespace
}  // namespace hooke::softbody
