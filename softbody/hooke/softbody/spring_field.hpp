// The force of a spring network.
#pragma once

#include <hooke/force_field.hpp>
#include <hooke/softbody/spring_network.hpp>

namespace hooke::softbody {

/// Springs as a force field. Written as k (l² - L²) / (l (l + L)) d, with L² from the same code
/// as l², so that a spring at its rest length pulls with exactly zero. A spring without length
/// pulls nowhere.
///
/// Springs are sorted by (b - a, a): where consecutive springs join consecutive points, as in
/// any grid, they are worked on without gathers. Every operation is a plain IEEE one on one
/// lane, so the bits are the same on every instruction set. Cost: about 1 ns a spring on runs.
template <class S>
class SpringField final : public ForceField<S> {
 public:
  /// @param start positions (n, 3) that resolve missing rest lengths
  /// @throws std::invalid_argument as SpringNetwork::check
  /// @param two_floats make steppers that hold a double in two floats; on grids only
  SpringField(std::shared_ptr<const SpringNetwork> network, const Points<S>& start, bool two_floats = false);

  bool uses_velocity() const override { return damped_; }
  bool anywhere() const override { return true; }
  bool passive() const override { return true; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;
  void add_fine_force(const Points<S>& x, const Points<S>& low, const Points<S>& v, double t,
                      Points<S>& f) const override;
  void add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const override;
  void add_damping_times(const Points<S>& x, const Points<S>& v, const Points<S>& d, Points<S>& out) const override;
  void add_couplings(const Points<S>& x, const Points<S>& v, double h, std::vector<Coupling>& out) const override;
  double potential_energy(const Points<S>& x) const override;

  /// ω² ≤ max over points i of the largest eigenvalue of Σ_j k_ij (w_i + w_j) P_ij, where P_ij is
  /// the stiffness direction of the spring from i to j: from (p - q)² ≤ (w_i + w_j)(p²/w_i + q²/w_j).
  /// Never below the true value; within 5 % for a flat grid of equal points, within 30 % (14 % in
  /// ω) for a cloth with its lighter border.
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>& v,
                                            const Values<S>& inverse_mass) const override;

  /// Force and step in one pass: for springs without dampers, where the build has Highway.
  std::unique_ptr<Stepper<S>> stepper() const override { return any_stepper(false); }
  std::unique_ptr<Stepper<S>> fine_stepper() const override { return any_stepper(true); }

  void describe(Blueprint& out) const override;

 private:
  struct Run {  // springs [first, first + count) join points a + i and b + i
    Index first, count, a, b;
  };
  Index size() const { return stiffness_.size(); }
  std::unique_ptr<Stepper<S>> any_stepper(bool fine) const;
  void add_forces(const Points<S>& x, const Points<S>* low, const Points<S>& v, Points<S>& f) const;

  std::shared_ptr<const SpringNetwork> network_;
  Points<S> start_;
  bool damped_ = false, two_floats_ = false;
  std::vector<Run> runs_;
  Index loose_ = 0;  // springs from here on are in no run
  std::vector<int> a_, b_;
  Values<double> fine_rest_squared_;
  Values<S> stiffness_, rest_, rest_squared_, damping_;
  // Scratch of rate_bounds; a field belongs to one body and is asked by one thread at a time.
  mutable Eigen::Array<S, Eigen::Dynamic, 6> bound_sums_, damping_sums_;
};

extern template class SpringField<float>;
extern template class SpringField<double>;

}  // namespace hooke::softbody
