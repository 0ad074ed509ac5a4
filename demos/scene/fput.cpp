#include <scene/fput.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke::scene {

namespace {

// All springs of the chain. Both potentials are convex, so K is positive as it is.
template <class S>
class FputSprings final : public ForceField<S> {
 public:
  explicit FputSprings(const FputChain& chain) : stiffness_(S(0.5 * chain.omega * chain.omega)) {}
  bool uses_velocity() const override { return false; }
  bool passive() const override { return true; }

  void add_force(const Points<S>& x, const Points<S>&, double, Points<S>& f) const override {
    const auto q = x.col(0);
    auto force = f.col(0);
    const Index n = q.size();
    for (Index i = 0; i < n; i += 2) {
      const S pull = stiffness_ * (q[i + 1] - q[i]);
      force[i] += pull;
      force[i + 1] -= pull;
    }
    const auto quartic = [](S stretch) { return S(4) * stretch * stretch * stretch; };
    force[0] -= quartic(q[0]);
    for (Index i = 1; i + 1 < n; i += 2) {
      const S pull = quartic(q[i + 1] - q[i]);
      force[i] += pull;
      force[i + 1] -= pull;
    }
    force[n - 1] -= quartic(q[n - 1]);
  }

  void add_stiffness_times(const Points<S>& x, const Points<S>& d, bool, Points<S>& out) const override {
    const auto q = x.col(0);
    const auto u = d.col(0);
    auto product = out.col(0);
    const Index n = q.size();
    for (Index i = 0; i < n; i += 2) {
      const S pull = stiffness_ * (u[i + 1] - u[i]);
      product[i] -= pull;
      product[i + 1] += pull;
    }
    const auto slope = [](S stretch) { return S(12) * stretch * stretch; };
    product[0] += slope(q[0]) * u[0];
    for (Index i = 1; i + 1 < n; i += 2) {
      const S pull = slope(q[i + 1] - q[i]) * (u[i + 1] - u[i]);
      product[i] -= pull;
      product[i + 1] += pull;
    }
    product[n - 1] += slope(q[n - 1]) * u[n - 1];
  }

  double potential_energy(const Points<S>& x) const override {
    const Values<double> q = x.col(0).template cast<double>();
    const Index n = q.size();
    double energy = std::pow(q[0], 4) + std::pow(q[n - 1], 4);
    for (Index i = 0; i < n; i += 2) energy += 0.5 * double(stiffness_) * std::pow(q[i + 1] - q[i], 2);
    for (Index i = 1; i + 1 < n; i += 2) energy += std::pow(q[i + 1] - q[i], 4);
    return energy;
  }

  // A spring of stiffness k between two free points adds at most 2k to ω² of unit masses; each point
  // has one of either kind, whose parts do not meet.
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>&,
                                            const Values<S>& inverse_mass) const override {
    const auto q = x.col(0);
    const Index n = q.size();
    double stretch = std::max(std::abs(double(q[0])), std::abs(double(q[n - 1])));
    for (Index i = 1; i + 1 < n; i += 2) stretch = std::max(stretch, std::abs(double(q[i + 1] - q[i])));
    return {2 * double(inverse_mass.maxCoeff()) * (double(stiffness_) + 12 * stretch * stretch), 0};
  }

 private:
  S stiffness_;
};

void check(const FputChain& chain) {
  if (chain.stiff_springs <= 0)
    throw std::invalid_argument("FputChain: stiff_springs must be positive, got " +
                                std::to_string(chain.stiff_springs));
  if (!(chain.omega > 0) || !std::isfinite(chain.omega))
    throw std::invalid_argument("FputChain: omega must be positive, got " + std::to_string(chain.omega));
}

}  // namespace

template <class S>
std::unique_ptr<PointBody<S>> fput_body(const MotionSettings& motion, const FputChain& chain) {
  check(chain);
  const Index n = 2 * Index(chain.stiff_springs);
  Points<double> x = Points<double>::Zero(n, 3), v = x;
  for (Index i = 0; i < n; ++i) x(i, 1) = double(i + 1);
  x(0, 0) = (1 - 1 / chain.omega) / std::sqrt(2.0);
  x(1, 0) = (1 + 1 / chain.omega) / std::sqrt(2.0);
  v(1, 0) = std::sqrt(2.0);  // (1 ∓ 1)/√2
  PointMasses<S> masses;
  masses.position = x.cast<S>();
  masses.velocity = v.cast<S>();
  masses.mass = masses.inverse_mass = Values<S>::Ones(n);
  auto body = std::make_unique<PointBody<S>>("fput chain", std::move(masses), motion);
  body->add_field(std::make_unique<FputSprings<S>>(chain));
  return body;
}

Values<double> stiff_energies(const Body& body, const FputChain& chain) {
  check(chain);
  const Values<double> q = body.positions().col(0), p = body.velocities().col(0);
  if (q.size() != 2 * chain.stiff_springs)
    throw std::invalid_argument("stiff_energies: body \"" + body.name() + "\" has " + std::to_string(q.size()) +
                                " points, not " + std::to_string(2 * chain.stiff_springs));
  Values<double> energies(chain.stiff_springs);
  for (Index j = 0; j < energies.size(); ++j) {
    const double stretch = q[2 * j + 1] - q[2 * j], speed = p[2 * j + 1] - p[2 * j];
    energies[j] = 0.25 * (speed * speed + chain.omega * chain.omega * stretch * stretch);
  }
  return energies;
}

template std::unique_ptr<PointBody<float>> fput_body(const MotionSettings&, const FputChain&);
template std::unique_ptr<PointBody<double>> fput_body(const MotionSettings&, const FputChain&);

}  // namespace hooke::scene
