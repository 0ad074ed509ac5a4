// Forces as functions of position, velocity and time. Gravity is not here: it is an
// acceleration and belongs to the world. Springs and wind are in hooke::softbody.
#pragma once

#include <hooke/block_cholesky.hpp>
#include <hooke/checkpoint.hpp>
#include <hooke/stepper.hpp>
#include <hooke/types.hpp>

#include <functional>
#include <memory>

namespace hooke {

/// A force on every point of a body, evaluated at every stage of a method.
template <class S>
class ForceField {
 public:
  virtual ~ForceField() = default;

  /// True where the force depends on velocity; methods that need a(x) only refuse it then.
  virtual bool uses_velocity() const = 0;

  /// True where the force changes so slowly that a body may evaluate it at the start of a tick and
  /// hold it: cheaper, but first order in the tick, and stable only while its damping rate × tick < 2.
  virtual bool once_a_tick() const { return false; }

  /// True where the force depends on position and velocity alone and never gives energy to the body: springs,
  /// drag. Only bodies of such fields sleep, and only their energy is watched.
  virtual bool passive() const { return false; }

  /// True where only differences of places matter: the origin of a body of such fields may follow it.
  virtual bool anywhere() const { return false; }

  /// f += force [N]. x [m] is relative to the body's origin, v [m/s], t [s]; shapes (n, 3).
  virtual void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const = 0;

  /// As add_force, at x + low, where `low` holds what the rounding of x has dropped: for forces that come from
  /// small differences of places.
  virtual void add_fine_force(const Points<S>& x, const Points<S>& low, const Points<S>& v, double t,
                              Points<S>& f) const;

  /// out += K d, where K = -∂f/∂x [N/m]. With `safe`, negative eigenvalues are left out, so
  /// that conjugate gradients cannot fail. A field without stiffness adds nothing.
  virtual void add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const;

  /// out += D d, where D = -∂f/∂v [N·s/m], or a positive approximation of it.
  virtual void add_damping_times(const Points<S>& x, const Points<S>& v, const Points<S>& d, Points<S>& out) const;

  /// Appends h²K + hD, negative eigenvalues left out, as blocks between points, always in the same order. Implicit
  /// methods precondition with it: a field that adds nothing is solved as well, with more products.
  virtual void add_couplings(const Points<S>& x, const Points<S>& v, double h, std::vector<Coupling>& out) const;

  /// Potential energy [J]; 0 for forces that have none.
  virtual double potential_energy(const Points<S>& x) const;

  /// Adds this field's share to bounds on ω² [1/s²] and on the damping rate [1/s] of any motion.
  struct Rates {
    double omega_squared = 0;
    double gamma = 0;
  };
  virtual Rates rate_bounds(const Points<S>& x, const Points<S>& v, const Values<S>& inverse_mass) const;

  /// A faster way to move points on which this field, gravity and pushes act alone, or null.
  virtual std::unique_ptr<Stepper<S>> stepper() const { return nullptr; }
  /// One that steps in double and keeps what the rounding of S drops, or null. Of float alone.
  virtual std::unique_ptr<Stepper<S>> fine_stepper() const { return nullptr; }

  /// Its settings, so that checkpoints know it again. Fields keep no state: what they are at t is a function of t.
  virtual void describe(Blueprint&) const {}
};

/// Linear drag: F = -c v, c in N·s/m. Terminal speed m g / c.
template <class S>
class LinearDrag final : public ForceField<S> {
 public:
  /// @param coefficient [N·s/m], >= 0
  explicit LinearDrag(double coefficient);
  bool anywhere() const override { return true; }
  bool passive() const override { return true; }
  bool uses_velocity() const override { return true; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;
  void add_damping_times(const Points<S>& x, const Points<S>& v, const Points<S>& d, Points<S>& out) const override;
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>& v,
                                            const Values<S>& inverse_mass) const override;
  void describe(Blueprint& out) const override { out.add("linear drag", double(coefficient_)); }

 private:
  S coefficient_;
};

/// Quadratic drag: F = -k |v| v, k in N·s²/m² (k = ½ ρ C A). Terminal speed √(m g / k).
template <class S>
class QuadraticDrag final : public ForceField<S> {
 public:
  /// @param coefficient [N·s²/m²], >= 0
  explicit QuadraticDrag(double coefficient);
  bool anywhere() const override { return true; }
  bool passive() const override { return true; }
  bool uses_velocity() const override { return true; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;
  void add_damping_times(const Points<S>& x, const Points<S>& v, const Points<S>& d, Points<S>& out) const override;
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>& v,
                                            const Values<S>& inverse_mass) const override;
  void describe(Blueprint& out) const override { out.add("quadratic drag", double(coefficient_)); }

 private:
  S coefficient_;
};

/// The same time-dependent force [N] on every point.
template <class S>
class TimeForce final : public ForceField<S> {
 public:
  explicit TimeForce(std::function<Vec3(double t)> force);
  bool anywhere() const override { return true; }
  bool uses_velocity() const override { return false; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;

 private:
  std::function<Vec3(double)> force_;
};

extern template class ForceField<float>;
extern template class ForceField<double>;
extern template class LinearDrag<float>;
extern template class LinearDrag<double>;
extern template class QuadraticDrag<float>;
extern template class QuadraticDrag<double>;
extern template class TimeForce<float>;
extern template class TimeForce<double>;

}  // namespace hooke
