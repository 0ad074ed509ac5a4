// What each method promises beyond its order: the limit of its stability, a motion that can be run
// backwards, energy, and a tolerance that is met.
#include "core/problems.hpp"

#include <hooke/softbody/spring_field.hpp>

#include <complex>

namespace hooke::test {
namespace {

// Position and velocity of x'' = -x after one step of `phase` from (x, v).
std::array<double, 2> step(const Method& method, double phase, double x, double v) {
  auto body = body_of(point<double>({x, 0, 0}, {v, 0, 0}), motion(method, phase));
  body->add_field(std::make_unique<Anchor<double>>(1));
  EXPECT_TRUE(run(*body, phase, 1, Vec3::Zero(), 0, 1).good());
  return {body->state().position(0, 0), body->state().velocity(0, 0)};
}

// Spectral radius of the step's matrix.
double growth(const Method& method, double phase) {
  const auto [a, c] = step(method, phase, 1, 0);
  const auto [b, d] = step(method, phase, 0, 1);
  const double half = (a + d) / 2, determinant = a * d - b * c;
  const std::complex<double> root = std::sqrt(std::complex<double>(half * half - determinant));
  return std::max(std::abs(half + root), std::abs(half - root));
}

class LimitOf : public ::testing::TestWithParam<const Method*> {};

// Scanned from 0: a window of instability below the limit would be found.
TEST_P(LimitOf, StabilityIsSharpFromBothSides) {
  const Method& method = *GetParam();
  const double limit = method.stability_limit;
  if (std::isinf(limit)) {
    for (const double phase : {0.1, 1.0, 10.0, 1e3}) EXPECT_LT(growth(method, phase), 1 + 1e-9) << phase;
    return;
  }
  if (limit == 0) {
    for (const double phase : {0.1, 0.3, 1.0, 2.0}) EXPECT_GT(growth(method, phase), 1 + 1e-6) << phase;
    return;
  }
  for (double phase = 1e-3; phase < limit; phase += 1e-3)
    ASSERT_LT(growth(method, phase), 1 + 1e-11) << "at " << phase << " below the limit " << limit;
  EXPECT_LT(growth(method, limit * (1 - 1e-5)), 1 + 1e-11);
  double worst = 0;
  for (int i = 1; i <= 10; ++i) worst = std::max(worst, growth(method, limit * (1 + 5e-5 * i)));
  EXPECT_GT(worst, 1 + 1e-7) << "nothing fails within 0.05 % above the limit " << limit;
}

INSTANTIATE_TEST_SUITE_P(Every, LimitOf, ::testing::ValuesIn(methods().begin(), methods().end()), [](const auto& test) {
  std::string name(test.param->name);
  std::erase(name, '-');
  return name;
});

TEST(BlanesMoan, WindowsAreWhereTheDocumentationSays) {
  EXPECT_GT(growth(blanes_moan_6(), 3.142), 1 + 3e-4);
  EXPECT_LT(growth(blanes_moan_6(), 3.142), 1 + 7e-4);
  for (double phase = 3.143; phase < 6.347; phase += 1e-2)
    EXPECT_LT(growth(blanes_moan_6(), phase), 1 + 1e-11) << phase;
  for (double phase = 6.3495; phase < 9.073; phase += 1e-2)
    EXPECT_LT(growth(blanes_moan_6(), phase), 1 + 1e-11) << phase;
  EXPECT_GT(growth(blanes_moan_6(), 9.08), 1.001);
  for (double phase = 3.169; phase < 5.026; phase += 1e-2)
    EXPECT_LT(growth(blanes_moan_4(), phase), 1 + 1e-11) << phase;
  EXPECT_GT(growth(blanes_moan_4(), 5.04), 1.001);
}

// A spring pendulum: nonlinear, in two dimensions.
std::unique_ptr<PointBody<double>> pendulum(const MotionSettings& settings) {
  auto body = body_of(
      points<double>(rows({{0, 0, 0}, {1, 0, 0}}), rows({{0, 0, 0}, {0, 0.2, 0}}), Values<double>::Ones(2)), settings);
  body->pin(0);
  auto network = std::make_shared<softbody::SpringNetwork>();
  network->springs.push_back({0, 1, 20, 0, 0.9, softbody::Family::Raw});
  body->add_field(std::make_unique<softbody::SpringField<double>>(network, body->state().position));
  return body;
}

// Distance from the start after 200 steps forth and 200 back.
double there_and_back(const Method& method) {
  const double dt = 0.02;
  const Vec3 gravity{0, -1, 0};
  auto body = pendulum(motion(method, dt));
  const Vec3 start = row(body->positions(), 1);
  EXPECT_TRUE(run(*body, dt, 200, gravity).good());
  EXPECT_GT((row(body->positions(), 1) - start).norm(), 0.1);
  body->set_velocity(1, -row(body->velocities(), 1));
  EXPECT_TRUE(run(*body, dt, 200, gravity).good());
  return (row(body->positions(), 1) - start).norm();
}

TEST(TimeReversal, BringsSymmetricMethodsBackToRounding) {
  for (const Method* method : {&verlet(), &velocity_verlet(), &pefrl(), &blanes_moan_4(), &blanes_moan_6()})
    EXPECT_LT(there_and_back(*method), 1e-12) << method->name;
  EXPECT_LT(there_and_back(implicit_midpoint()), 1e-9);  // to the solver's tolerance in each step
  // The others do not come back.
  for (const Method* method : {&semi_implicit_euler(), &implicit_euler(), &rk2(), &rk4(), &rkn4(), &dormand_prince()})
    EXPECT_GT(there_and_back(*method), 1e-9) << method->name;
}

TEST(Midpoint, KeepsTheEnergyOfAnOscillatorToRoundingAtAnyStep) {
  for (const Method* method : {&implicit_midpoint(), &linearised_midpoint()})
    for (const double phase : {0.1, 1.0, 30.0}) {
      SCOPED_TRACE(std::string(method->name) + " at phase " + std::to_string(phase));
      auto body = body_of(point<double>({1, 0, 0}, {0.3, 0, 0}), motion(*method, phase));
      body->add_field(std::make_unique<Anchor<double>>(1));
      for (int i = 0; i < 100; ++i) {
        ASSERT_TRUE(run(*body, phase, 100, Vec3::Zero(), 100 * phase * i).good());
        EXPECT_NEAR(body->energy(Vec3::Zero()).total() / 0.545, 1, 1e-12);
      }
    }
}

TEST(Midpoint, TurnsTheOscillatorByItsClosedForm) {
  // x_{n+1} + x_{n-1} = 2 cos θ x_n, θ = 2 atan(z/2).
  const double phase = 0.5;
  auto body = body_of(point<double>({1, 0, 0}, {0.3, 0, 0}), motion(implicit_midpoint(), phase));
  body->add_field(std::make_unique<Anchor<double>>(1));
  double x[3];
  for (double& value : x) {
    value = body->state().position(0, 0);
    run(*body, phase, 1);
  }
  EXPECT_NEAR((x[0] + x[2]) / (2 * x[1]), std::cos(2 * std::atan(phase / 2)), 1e-12);
}

TEST(Midpoint, MovesAPinAndWhatHangsOnIt) {
  // Two thirds of a second of a pin at constant speed: in its frame a spring at rest stays at rest.
  for (const Method* method : {&implicit_midpoint(), &linearised_midpoint()}) {
    SCOPED_TRACE(method->name);
    auto body = pendulum(motion(*method, 0.01));
    body->set_position(1, {0.9, 0, 0});
    body->set_velocity(1, {2, 0, 0});
    body->drive_pins({0}, [](double t, Points<double>& p) { p.row(0) << 2 * t, 0, 0; });
    ASSERT_TRUE(run(*body, 0.01, 60).good());
    EXPECT_LT((row(body->positions(), 1) - Vec3(0.9 + 1.2, 0, 0)).norm(), 1e-10);
    EXPECT_LT((row(body->velocities(), 0) - Vec3(2, 0, 0)).norm(), 1e-10);
  }
}

MotionSettings adaptive(double tolerance) {
  MotionSettings settings = motion(dormand_prince());
  settings.tolerance = tolerance;
  return settings;
}

TEST(DormandPrince, MeetsItsToleranceInEveryStep) {
  const double tick = 1.0 / 30;
  for (const double tolerance : {1e-3, 1e-5, 1e-7, 1e-9}) {
    SCOPED_TRACE(tolerance);
    auto body = pendulum(adaptive(tolerance));
    for (int i = 0; i < 120; ++i) {
      // What a method of order 6 with small steps makes of the same start.
      auto exact = pendulum(motion(blanes_moan_6(), tick / 64));
      exact->set_position(1, row(body->positions(), 1));
      exact->set_velocity(1, row(body->velocities(), 1));
      const Tick now{tick * i, tick * (i + 1), {0, -1, 0}, {}};
      ASSERT_TRUE(body->advance(now).good());
      ASSERT_TRUE(exact->advance(now).good());
      const double error = (body->positions() - exact->positions()).abs().maxCoeff();
      EXPECT_LE(error, tolerance * double(body->substeps()));
    }
  }
}

TEST(DormandPrince, ErrorFollowsTheToleranceAndCostItsFifthRoot) {
  const auto go = [](const MotionSettings& settings) {
    auto body = pendulum(settings);
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(body->advance({1.0 * i, i + 1.0, {0, -1, 0}, {}}).good());
    return body;
  };
  const Vec3 exact = row(go(motion(blanes_moan_6(), 1e-3))->positions(), 1);
  double before = 0;
  for (const double tolerance : {1e-5, 1e-7, 1e-9, 1e-11}) {
    SCOPED_TRACE(tolerance);
    const auto body = go(adaptive(tolerance));
    const double steps = double(body->motion_facts().evaluations) / 6;
    EXPECT_LT((row(body->positions(), 1) - exact).norm(), steps * tolerance);
    EXPECT_GT((row(body->positions(), 1) - exact).norm(), 1e-3 * tolerance);  // it is not doing far too much
    if (before > 0) {
      EXPECT_NEAR(std::log(steps / before) / std::log(100.0), 0.2, 0.04);
    }
    before = steps;
  }
}

TEST(DormandPrince, TakesShortStepsOnlyWhereTheMotionIsFast) {
  // A push of 0.02 s in the middle of a long coast.
  auto body = body_of(point<double>({0, 0, 0}, {1, 0, 0}), adaptive(1e-9));
  body->add_field(std::make_unique<TimeForce<double>>(
      [](double t) { return Vec3(1e3 * std::exp(-std::pow((t - 1.5) / 0.01, 2)), 0, 0); }));
  std::vector<Index> steps;
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(body->advance({0.1 * i, 0.1 * (i + 1), Vec3::Zero(), {}}).good());
    steps.push_back(body->substeps());
  }
  EXPECT_EQ(steps[2], 1);
  EXPECT_GT(steps[14] + steps[15], 20);
  EXPECT_EQ(steps[28], 1);
  EXPECT_NEAR(body->velocities()(0, 0), 1 + 10 * std::sqrt(M_PI), 1e-6);
}

TEST(DormandPrince, RepeatsItselfToTheLastBitAndEndsWhereForcesBreak) {
  const auto go = [] {
    auto body = pendulum(adaptive(1e-8));
    for (int i = 0; i < 60; ++i) EXPECT_TRUE(body->advance({i / 60.0, (i + 1) / 60.0, {0, -1, 0}, {}}).good());
    return body->positions();
  };
  EXPECT_TRUE((go() == go()).all());
  auto body = body_of(point<double>({0, 0, 0}, {1, 0, 0}), adaptive(1e-8));
  body->add_field(std::make_unique<TimeForce<double>>([](double t) { return Vec3(t > 0.5 ? std::nan("") : 0, 0, 0); }));
  const StepReport report = body->advance({0, 1, Vec3::Zero(), {}});
  EXPECT_EQ(report.status, StepReport::Status::NotFinite);
  EXPECT_EQ(body->positions()(0, 0), 0);
  Integrator<double> fixed(rk4());
  Points<double> x = Points<double>::Zero(1, 3), v = x;
  struct Free final : Dynamics<double> {
    Values<double> one = Values<double>::Ones(1);
    bool uses_velocity() const override { return false; }
    void acceleration(const Points<double>& p, const Points<double>&, double, Points<double>& a) override {
      a.setZero(p.rows(), 3);
    }
    void prescribe(double, const Points<double>&, double, Points<double>&, Points<double>&) override {}
    bool prescribes() const override { return false; }
    void collide(double, const Points<double>&, double, Points<double>&, Points<double>&) override {}
    void settle(Points<double>&) override {}
    bool collides() const override { return false; }
    const Values<double>& mass() const override { return one; }
    const Values<double>& inverse_mass() const override { return one; }
    void add_implicit_times(const Points<double>&, const Points<double>&, double, bool, const Points<double>&,
                            Points<double>&) override {}
  } free;
  EXPECT_THROW(fixed.adapt(free, x, v, 0, 1, 1e-6, 1e-9), std::invalid_argument);
  Integrator<double> free_fall(dormand_prince());
  v(0, 0) = 3;
  free_fall.adapt(free, x, v, 0, 1, 1e-6, 1e-9);
  EXPECT_EQ(free_fall.adapted_steps(), 1);
  EXPECT_EQ(free_fall.work().evaluations, 7);
  EXPECT_NEAR(x(0, 0), 3, 1e-15);
}

}  // namespace
}  // namespace hooke::test
