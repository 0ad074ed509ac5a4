// The order of every method, measured on both sides: a method that converges faster than it
// says is as wrong as one that converges slower. docs/methods.md shows the same numbers.
//
// Norm: distance of the position at the end time from the reference; window: four step
// lengths, each half of the one before, in one tick as in many.
#include "core/problems.hpp"

#include <hooke/softbody/spring_field.hpp>

#include <iostream>

namespace hooke::test {
namespace {

struct Problem {
  const char* name;
  double start, end;
  bool damped;  // forces of velocity act
  std::function<std::unique_ptr<PointBody<double>>(const Method&, double dt)> make;
};

/// The oscillator from a smooth start: at ω = 1, or 4 where the error of ω = 1 is lost in rounding.
Problem oscillator(const Method& method) {
  const double omega = method.order > 4 ? 4 : 1;
  return {"oscillator", 0, 2.5, false, [omega](const Method& with, double dt) {
            auto body = body_of(point<double>({1, 0, 0}, {0.3, 0, 0}), motion(with, dt));
            body->add_field(std::make_unique<Anchor<double>>(omega * omega));
            return body;
          }};
}

/// The tutorial's ship: 10 m/s² at 1 s, 25 m/s² at 2 s.
Problem ship() {
  return {
      "ship", 1, 2, false, [](const Method& method, double dt) {
        auto body = body_of(point<double>({0, 0, 0}, {3, 0, 0}), motion(method, dt));
        body->add_field(std::make_unique<TimeForce<double>>([](double t) { return Vec3(10 + 15 * (t - 1), 0, 0); }));
        return body;
      }};
}

/// A spring pendulum of stiffness 20 N/m in a gravity of 1 m/s²: nonlinear in two dimensions.
Problem pendulum() {
  return {"pendulum", 0, 2, false, [](const Method& method, double dt) {
            auto masses =
                points<double>(rows({{0, 0, 0}, {1, 0, 0}}), rows({{0, 0, 0}, {0, 0.2, 0}}), Values<double>::Ones(2));
            auto body = body_of(std::move(masses), motion(method, dt));
            body->pin(0);
            auto network = std::make_shared<softbody::SpringNetwork>();
            network->springs.push_back({0, 1, 20, 0, 0.9, softbody::Family::Raw});
            body->add_field(std::make_unique<softbody::SpringField<double>>(network, body->state().position));
            body->add_field(std::make_unique<TimeForce<double>>([](double) { return Vec3(0, -1, 0); }));
            return body;
          }};
}

/// A throw with quadratic drag, a force of velocity: ten times as much where the order is above 4.
Problem drag(const Method& method) {
  const double coefficient = method.order > 4 ? 0.1 : 0.01;
  return {"quadratic drag", 0, 3, true, [coefficient](const Method& with, double dt) {
            auto body = body_of(point<double>({0, 0, 0}, {30, 30, 0}), motion(with, dt));
            body->add_field(std::make_unique<QuadraticDrag<double>>(coefficient));
            body->add_field(std::make_unique<TimeForce<double>>([](double) { return Vec3(0, -9.81, 0); }));
            return body;
          }};
}

/// A driven, damped, hardening spring: position, velocity and time at once.
Problem duffing(const Method& method) {
  const double hardening = method.order > 4 ? 5 : 1.5;
  return {
      "driven hardening spring with drag", 0, 2, true, [hardening](const Method& with, double dt) {
        auto body = body_of(point<double>({1, 0.2, 0}, {0, 0.7, 0.1}), motion(with, dt));
        body->add_field(std::make_unique<Anchor<double>>(2, hardening));
        body->add_field(std::make_unique<QuadraticDrag<double>>(0.4));
        body->add_field(std::make_unique<LinearDrag<double>>(0.2));
        body->add_field(std::make_unique<TimeForce<double>>([](double t) { return Vec3(std::cos(3 * t), 0.5, 0); }));
        return body;
      }};
}

/// The same without drag: for the methods that refuse it.
Problem driven() {
  return {
      "driven hardening spring", 0, 2, false, [](const Method& method, double dt) {
        auto body = body_of(point<double>({1, 0.2, 0}, {0, 0.7, 0.1}), motion(method, dt));
        body->add_field(std::make_unique<Anchor<double>>(2, 1.5));
        body->add_field(std::make_unique<TimeForce<double>>([](double t) { return Vec3(std::cos(3 * t), 0.5, 0); }));
        return body;
      }};
}

Vec3 end_of(const Problem& problem, const Method& method, int steps) {
  const double dt = (problem.end - problem.start) / steps;
  auto body = problem.make(method, dt);
  const int ticks = 8;
  const double tick = (problem.end - problem.start) / ticks;
  for (int i = 0; i < ticks; ++i) {
    const StepReport report =
        body->advance({problem.start + tick * i, problem.start + tick * (i + 1), Vec3::Zero(), {}});
    EXPECT_TRUE(report.good()) << report.text();
    EXPECT_EQ(body->substeps(), steps / ticks);
  }
  return row(body->positions(), body->size() - 1);
}

// The window: step counts from this on, doubled; above rounding and below where the next terms matter.
struct Window {
  int coarsest, levels;
};
Window window_of(const Method& method) {
  switch (method.order) {
    case 1:
      return {1600, 4};
    case 2:
      return {200, 4};
    case 4:
      return {64, 4};
    case 5:
      return {64, 3};
    default:
      return {16, 3};
  }
}

// Least squares through the points of (log dt, log error).
double slope(const Problem& problem, const Method& method, const Vec3& reference) {
  const Window window = window_of(method);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (int level = 0; level < window.levels; ++level) {
    const int steps = window.coarsest << level;
    const double x = -std::log(double(steps)), y = std::log((end_of(problem, method, steps) - reference).norm());
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

class OrderOf : public ::testing::TestWithParam<const Method*> {};

TEST_P(OrderOf, IsTheDeclaredOneOnBothSides) {
  const Method& method = *GetParam();
  for (const Problem& problem : {oscillator(method), ship(), pendulum(), driven(), drag(method), duffing(method)}) {
    SCOPED_TRACE(problem.name);
    if (problem.damped && !method.accepts_velocity_forces) continue;
    if (method.order >= 4 && std::string(problem.name) == "ship") continue;  // exact, see below
    // Two methods that have nothing in common agree before one of them counts as reference.
    const Vec3 reference = end_of(problem, dormand_prince(), 2048);
    ASSERT_LT((end_of(problem, rk4(), 8192) - reference).norm(), 2e-12 * std::max(1.0, reference.norm()));
    const double measured = slope(problem, method, reference);
    std::cout << method.name << ", " << problem.name << ": order " << measured << ", error "
              << (end_of(problem, method, window_of(method).coarsest) - reference).norm() << " m at dt "
              << (problem.end - problem.start) / window_of(method).coarsest << " s\n";
    EXPECT_GT(measured, method.order - 0.15);
    // Here the term after the leading one of Dormand-Prince is the larger one down to rounding.
    if (&method == &dormand_prince() && std::string(problem.name) == "quadratic drag") continue;
    EXPECT_LT(measured, method.order + 0.15);
  }
}

INSTANTIATE_TEST_SUITE_P(Every, OrderOf, ::testing::ValuesIn(methods().begin(), methods().end()), [](const auto& test) {
  std::string name(test.param->name);
  std::erase(name, '-');
  return name;
});

TEST(Order, FourAndMoreIsExactForTheShip) {
  // x(2) = 3 + ∫∫ (10 + 15 s) = 3 + 5 + 2.5
  for (const Method* method : methods()) {
    if (method->order < 4) continue;
    EXPECT_NEAR(end_of(ship(), *method, 8).x(), 10.5, 1e-13) << method->name;
  }
}

TEST(Order, TheShipsErrorFallsAsTheTutorialWantsToSee) {
  const double exact = 10.5;
  const auto error = [&](const Method& method, int steps) {
    return std::abs(end_of(ship(), method, steps).x() - exact);
  };
  for (const Method* method : methods()) {
    if (method->order >= 4) continue;
    SCOPED_TRACE(method->name);
    EXPECT_NEAR(error(*method, 800) / error(*method, 1600), std::pow(2, method->order), 0.05);
  }
}

}  // namespace
}  // namespace hooke::test
