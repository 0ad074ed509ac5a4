// The harmonic oscillator: what each method does to its energy and phase, digit by digit, and
// where each method stops being stable.
#include "core/problems.hpp"

#include <hooke/softbody/spring_field.hpp>

#include <numbers>

namespace hooke::test {
namespace {

constexpr double kPhase = 0.1;  // ω dt with ω = 1

double energy(const PointBody<double>& body) { return body.energy(Vec3::Zero()).total(); }

std::unique_ptr<PointBody<double>> oscillator(const Method& method, double dt, double damping = 0) {
  auto body = body_of(point<double>({1, 0, 0}, {0.3, 0, 0}), motion(method, dt));
  body->add_field(std::make_unique<Anchor<double>>(1, 0, damping));
  return body;
}

double growth_over_1000_steps(const Method& method) {
  auto body = oscillator(method, kPhase);
  const double before = energy(*body);
  EXPECT_TRUE(run(*body, kPhase, 1000).good());
  return energy(*body) / before;
}

TEST(Oscillator, ExplicitEulerGrowsByItsFactor) {
  EXPECT_NEAR(growth_over_1000_steps(explicit_euler()), 20959.1556, 5e-5);
}

TEST(Oscillator, ImplicitEulerDecaysByItsFactor) {
  EXPECT_NEAR(growth_over_1000_steps(implicit_euler()), 4.77118e-5, 5e-11);
}

TEST(Oscillator, MidpointGrowsByItsFactor) { EXPECT_NEAR(growth_over_1000_steps(rk2()), 1.0253148, 5e-8); }

TEST(Oscillator, Rk4DecaysByItsFactor) { EXPECT_NEAR(growth_over_1000_steps(rk4()), 0.999986128568, 5e-13); }

// Largest relative change of an invariant over 10000 steps.
template <class Invariant>
double drift(const Method& method, Invariant invariant) {
  auto body = oscillator(method, kPhase);
  const auto value = [&] { return invariant(body->state().position(0, 0), body->state().velocity(0, 0)); };
  const double before = value();
  double worst = 0;
  for (int tick = 0; tick < 1000; ++tick) {
    EXPECT_TRUE(run(*body, kPhase, 10, Vec3::Zero(), tick * 10 * kPhase).good());
    worst = std::max(worst, std::abs(value() / before - 1));
  }
  return worst;
}

TEST(Oscillator, SemiImplicitEulerKeepsItsEllipseToRounding) {
  EXPECT_LT(drift(semi_implicit_euler(), [](double x, double v) { return x * x + v * v - kPhase * x * v; }), 1e-12);
}

TEST(Oscillator, VerletKeepsItsEllipseToRounding) {
  for (const Method* method : {&verlet(), &velocity_verlet()}) {
    SCOPED_TRACE(method->name);
    const auto ellipse = [](double x, double v) { return v * v + (1 - kPhase * kPhase / 4) * x * x; };
    EXPECT_LT(drift(*method, ellipse), 1e-12);
  }
}

TEST(Oscillator, FrequencyOfTheSymplecticMethodsIsTheirClosedForm) {
  for (const Method* method : {&verlet(), &velocity_verlet(), &semi_implicit_euler()}) {
    SCOPED_TRACE(method->name);
    // x_{n+1} + x_{n-1} = 2 cos θ x_n holds for each of them.
    auto body = oscillator(*method, kPhase);
    double sum = 0, square = 0, before = body->state().position(0, 0);
    run(*body, kPhase, 1);
    double now = body->state().position(0, 0);
    for (int i = 0; i < 1000; ++i) {
      run(*body, kPhase, 1);
      const double next = body->state().position(0, 0);
      sum += (next + before) * now, square += 2 * now * now;
      before = now, now = next;
    }
    EXPECT_NEAR(std::acos(sum / square) / kPhase, 1.000417136, 5e-10);
  }
}

// Whether the motion stays below 1000 times its start over 6000 steps.
bool bounded(const Method& method, double phase, double zeta, int steps_per_tick) {
  auto body = oscillator(method, phase, 2 * zeta);
  for (int i = 0; i < 6000; i += 100) {
    if (!run(*body, phase, 100, Vec3::Zero(), i * phase, steps_per_tick).good()) return false;
    if (std::abs(body->state().position(0, 0)) + std::abs(body->state().velocity(0, 0)) > 1000) return false;
  }
  return true;
}

TEST(StabilityLimit, IsWhereTheMethodsSaySharpOnBothSides) {
  for (const Method* method : {&semi_implicit_euler(), &verlet(), &velocity_verlet(), &rk4()}) {
    SCOPED_TRACE(method->name);
    EXPECT_TRUE(bounded(*method, 0.999 * method->stability_limit, 0, 10));
    EXPECT_FALSE(bounded(*method, 1.001 * method->stability_limit, 0, 10));
  }
  EXPECT_FALSE(bounded(explicit_euler(), 0.1, 0, 10));
  EXPECT_FALSE(bounded(rk2(), 0.6, 0, 10));
  EXPECT_TRUE(bounded(implicit_euler(), 100, 0, 10));
}

// A point on a damped spring to a pinned point, along the spring: x'' = -ω²x - 2ζωx', ω = 1.
// Ticks are long: taking the acceleration anew at their start calms the predicted velocities.
bool damped_spring_bounded(const Method& method, double phase, double zeta) {
  auto masses =
      points<double>(rows({{0, 0, 0}, {10.5, 0, 0}}), rows({Vec3::Zero(), Vec3::Zero()}), Values<double>::Ones(2));
  auto body = body_of(std::move(masses), motion(method, phase));
  body->pin(0);
  auto network = std::make_shared<softbody::SpringNetwork>();
  network->springs.push_back({0, 1, 1, 2 * zeta, 10, softbody::Family::Raw});
  body->add_field(std::make_unique<softbody::SpringField<double>>(network, body->state().position));
  for (int i = 0; i < 20000; i += 100) {
    if (!run(*body, phase, 100, Vec3::Zero(), i * phase, 100).good()) return false;
    if (std::abs(body->state().position(1, 0) - 10) > 2) return false;
  }
  return true;
}

TEST(StabilityLimit, OfADampedSpringIsTheClosedForm) {
  struct Case {
    const Method& method;
    double zeta, limit;
  };
  for (const Case& c : {Case{explicit_euler(), 0.1, 0.2}, Case{explicit_euler(), 0.5, 1.0},
                        Case{semi_implicit_euler(), 0.1, 1.80998}, Case{semi_implicit_euler(), 0.5, 1.23607},
                        Case{velocity_verlet(), 0.1, 1.63961}, Case{verlet(), 0.5, 0.828427}}) {
    SCOPED_TRACE(std::string(c.method.name) + " at damping ratio " + std::to_string(c.zeta));
    EXPECT_TRUE(damped_spring_bounded(c.method, 0.998 * c.limit, c.zeta));
    EXPECT_FALSE(damped_spring_bounded(c.method, 1.05 * c.limit, c.zeta));
  }
  // The library's own formula says the same.
  EXPECT_NEAR(largest_stable_step(explicit_euler(), 1, 2 * 0.5), 1.0, 1e-12);
  EXPECT_NEAR(largest_stable_step(semi_implicit_euler(), 1, 2 * 0.1), 1.80998, 5e-6);
  EXPECT_NEAR(largest_stable_step(semi_implicit_euler(), 1, 2 * 0.5), 1.23607, 5e-6);
}

TEST(LargestStableStep, NeverPromisesAnUnstableStep) {
  for (const Method* method : damped_methods()) {
    if (std::isinf(method->stability_limit)) continue;
    for (const double zeta :
         {0.0, 0.01, 0.1, 0.3, 0.31, 0.4, 0.5, 0.55, 0.6, 0.7, 0.71, 0.9, 1.0, 1.1, 1.5, 2.0, 3.0, 5.0}) {
      const double promised = largest_stable_step(*method, 1, 2 * zeta);
      if (promised == 0) continue;  // none promised
      for (const int steps_per_tick : {1, 2, 10}) {
        SCOPED_TRACE(std::string(method->name) + ", damping ratio " + std::to_string(zeta) + ", step " +
                     std::to_string(promised) + ", " + std::to_string(steps_per_tick) + " a tick");
        EXPECT_TRUE(bounded(*method, 0.999 * promised, zeta, steps_per_tick));
      }
    }
  }
}

TEST(LargestStableStep, HoldsForSlowerModesOfTheSameDamping) {
  for (const Method* method : damped_methods()) {
    if (std::isinf(method->stability_limit)) continue;
    for (const double gamma : {0.02, 0.2, 0.59, 1.0, 1.5, 2.0, 4.0, 10.0}) {
      const double promised = largest_stable_step(*method, 1, gamma);
      for (const double omega : {0.9, 0.7, 0.5, 0.2}) {
        SCOPED_TRACE(std::string(method->name) + ", damping rate " + std::to_string(gamma) + ", frequency " +
                     std::to_string(omega));
        EXPECT_TRUE(bounded(*method, 0.999 * promised * omega, gamma / (2 * omega), 10));
      }
    }
  }
}

TEST(LargestStableStep, IsNotTimid) {
  // Twice the promise must fail somewhere for every method that has a limit.
  for (const Method* method : damped_methods()) {
    if (std::isinf(method->stability_limit)) continue;
    for (const double zeta : {0.1, 0.5, 2.0}) {
      SCOPED_TRACE(std::string(method->name) + ", damping ratio " + std::to_string(zeta));
      const double factor = method == &rk2() ? 12 : method == &dormand_prince() ? 3.7 : 2.1;
      EXPECT_FALSE(bounded(*method, factor * largest_stable_step(*method, 1, 2 * zeta), zeta, 10));
    }
  }
}

TEST(LargestStableStep, KnowsTheEndsOfItsRange) {
  EXPECT_EQ(largest_stable_step(explicit_euler(), 1, 0), 0);
  EXPECT_EQ(largest_stable_step(explicit_euler(), 0, 4), 0.5);
  for (const Method* method : methods()) EXPECT_TRUE(std::isinf(largest_stable_step(*method, 0, 0))) << method->name;
  EXPECT_TRUE(std::isinf(largest_stable_step(implicit_euler(), 1e9, 1e9)));
}

}  // namespace
}  // namespace hooke::test
