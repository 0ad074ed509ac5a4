// Points, fields and runs that the tests of the core, the laws and the convergence share.
#pragma once

#include <hooke/point_body.hpp>
#include <hooke/world.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hooke::test {

using Scalars = ::testing::Types<float, double>;

/// Rounding of one operation in S.
template <class S>
constexpr double kUnit = std::is_same_v<S, float> ? 6e-8 : 1.2e-16;

inline Points<double> rows(std::initializer_list<Vec3> list) {
  Points<double> out(Index(list.size()), 3);
  Index i = 0;
  for (const Vec3& row : list) out.row(i++) = row.transpose().array();
  return out;
}

inline Vec3 row(const Points<double>& p, Index i) { return p.row(i).matrix().transpose(); }

template <class S>
PointMasses<S> points(const Points<double>& x, const Points<double>& v, const Values<double>& mass) {
  PointMasses<S> out;
  out.position = x.cast<S>();
  out.velocity = v.cast<S>();
  out.mass = mass.cast<S>();
  out.inverse_mass = out.mass.inverse();
  return out;
}

/// One point of one kilogram.
template <class S>
PointMasses<S> point(const Vec3& x, const Vec3& v) {
  return points<S>(rows({x}), rows({v}), Values<double>::Ones(1));
}

/// Those of methods() that take drag and dampers.
inline std::vector<const Method*> damped_methods() {
  std::vector<const Method*> out;
  for (const Method* method : methods())
    if (method->accepts_velocity_forces) out.push_back(method);
  return out;
}

/// True where a step is solved to a tolerance instead of computed.
inline bool solves(const Method& method) { return std::holds_alternative<Implicit>(method.scheme); }

inline MotionSettings motion(const Method& method, double dt = 0) {
  MotionSettings settings;
  settings.method = &method;
  settings.dt = dt;
  return settings;
}

template <class S>
std::unique_ptr<PointBody<S>> body_of(PointMasses<S> masses, const MotionSettings& settings,
                                      std::string name = "body") {
  return std::make_unique<PointBody<S>>(std::move(name), std::move(masses), settings);
}

/// Each coordinate on its own spring to the origin: F = -k x - k3 x³ - c v.
template <class S>
class Anchor final : public ForceField<S> {
 public:
  explicit Anchor(double k, double k3 = 0, double c = 0) : k_(S(k)), k3_(S(k3)), c_(S(c)) {}
  bool uses_velocity() const override { return c_ != S(0); }
  void add_force(const Points<S>& x, const Points<S>& v, double, Points<S>& f) const override {
    f -= k_ * x + k3_ * x.cube();
    if (c_ != S(0)) f -= c_ * v;
  }
  void add_stiffness_times(const Points<S>& x, const Points<S>& d, bool, Points<S>& out) const override {
    out += (k_ + S(3) * k3_ * x.square()) * d;
  }
  void add_damping_times(const Points<S>&, const Points<S>&, const Points<S>& d, Points<S>& out) const override {
    out += c_ * d;
  }
  double potential_energy(const Points<S>& x) const override {
    return double((S(0.5) * k_ * x.square() + S(0.25) * k3_ * x.square().square()).sum());
  }
  typename ForceField<S>::Rates rate_bounds(const Points<S>&, const Points<S>&, const Values<S>& w) const override {
    return {double(k_ * w.maxCoeff()), double(c_ * w.maxCoeff())};
  }

 private:
  S k_, k3_, c_;
};

/// Runs `steps` steps of length dt in ticks of `steps_per_tick`, so that both what is carried
/// from step to step and what is rebuilt at ticks is tested. Returns the last report.
template <class S>
StepReport run(PointBody<S>& body, double dt, int steps, const Vec3& gravity = Vec3::Zero(), double start = 0,
               int steps_per_tick = 10) {
  StepReport report;
  for (int done = 0; done < steps && report.good(); done += steps_per_tick) {
    const int now = std::min(steps_per_tick, steps - done);
    const Tick tick{start + dt * done, start + dt * (done + now), gravity, {}};
    report = body.advance(tick);
    EXPECT_TRUE(body.substeps() == now || body.settings().dt != dt) << body.substeps();
  }
  return report;
}

/// A seed of its own in every run, or the one to repeat from the environment. Printed on failure.
class Random {
 public:
  Random() : seed_(chosen()), engine_(seed_) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  Vec3 vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
  Points<double> points(Index n, double size) {
    Points<double> out(n, 3);
    for (Index i = 0; i < n; ++i) out.row(i) = vector(size).transpose().array();
    return out;
  }
  std::string trace() const { return "HOOKE_TEST_SEED=" + std::to_string(seed_); }

 private:
  static unsigned chosen() {
    const char* given = std::getenv("HOOKE_TEST_SEED");
    return given ? unsigned(std::strtoul(given, nullptr, 10)) : std::random_device{}();
  }
  unsigned seed_;
  std::mt19937 engine_;
};

}  // namespace hooke::test
