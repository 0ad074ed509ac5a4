// The one integrator core: it moves points, whatever they belong to. What accelerates and
// constrains them is behind Dynamics; which method is a table from method.hpp.
#pragma once

#include <hooke/checkpoint.hpp>
#include <hooke/implicit_solver.hpp>
#include <hooke/method.hpp>
#include <hooke/stepper.hpp>
#include <hooke/types.hpp>

#include <cstdint>

namespace hooke {

/// The equations of motion x'' = a(x, v, t) of a set of points, and what holds them: points
/// that go where they are told, and surfaces they may not enter.
template <class S>
class Dynamics {
 public:
  virtual ~Dynamics() = default;

  /// True where a(x, v, t) depends on v.
  virtual bool uses_velocity() const = 0;

  /// Sets a [m/s²], 0 for immovable points. Shapes (n, 3).
  virtual void acceleration(const Points<S>& x, const Points<S>& v, double t, Points<S>& a) = 0;

  /// Puts prescribed points at their place at time t. `from` holds the positions at time t0;
  /// their velocity becomes (x - from) / (t - t0).
  virtual void prescribe(double t0, const Points<S>& from, double t, Points<S>& x, Points<S>& v) = 0;

  /// True where `prescribe` does anything.
  virtual bool prescribes() const = 0;

  /// Keeps points out of surfaces after a move from `from` at t0 to x at t1.
  virtual void collide(double t0, const Points<S>& from, double t1, Points<S>& x, Points<S>& v) = 0;

  /// Takes from v what presses into the surfaces that the last `collide` touched: the kick after
  /// a drift knows nothing of them.
  virtual void settle(Points<S>& v) = 0;

  /// True where `collide` may do anything until the next tick.
  virtual bool collides() const = 0;

  // For implicit methods only.
  /// Appends the planes that points at x at t0 must not cross until t1, as far as they are within `reach` [m].
  virtual void planes(double t0, const Points<S>& x, double t1, S reach, std::vector<ContactPlane<S>>& out);
  virtual const Values<S>& mass() const = 0;          ///< [kg], > 0
  virtual const Values<S>& inverse_mass() const = 0;  ///< [1/kg], 0 = held
  /// out += h² K d + h D d at (x, v).
  virtual void add_implicit_times(const Points<S>& x, const Points<S>& v, S h, bool safe, const Points<S>& d,
                                  Points<S>& out) = 0;
  /// Appends h²K + hD at (x, v), negative eigenvalues left out, as far as it is known as blocks: what implicit
  /// methods precondition with.
  virtual void add_couplings(const Points<S>& x, const Points<S>& v, double h, std::vector<Coupling>& out);
};

/// How an implicit solve went; explicit methods always converge.
struct SolveResult {
  bool converged = true;
  double residual = 0;  ///< relative to the velocity scale
};

/// What integration has cost so far. A force evaluation and a product with K and D are about as dear
/// as each other; explicit methods need no products.
struct Work {
  std::int64_t evaluations = 0;     ///< of the accelerations of all points
  std::int64_t products = 0;        ///< of h²K + hD with a vector, in implicit solves
  std::int64_t factorisations = 0;  ///< of sparse matrices, in implicit solves
  std::int64_t unfinished = 0;      ///< implicit steps that stopped at their limit of iterations
};

/// Runs one method. Owns scratch memory and nothing else: no allocation in a step once the
/// number of points is known.
template <class S>
class Integrator {
 public:
  /// @param compensated sums of x and v keep what rounding drops and add it later (Kahan 1965; Knuth's two-sum):
  ///        explicit methods at fixed steps. Then x and v must be the same points from step to step. Costs
  ///        about 2 ns a point and stage in float.
  explicit Integrator(const Method& method, bool compensated = false) : method_(&method), compensated_(compensated) {}

  const Method& method() const { return *method_; }

  /// One step from t to t + h. x and v belong to the same time before and after.
  /// @throws std::invalid_argument where the method does not accept velocity-dependent forces
  SolveResult step(Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double h);

  /// From t to t + span in as many equal or unequal steps as the method's error estimate asks for. Each
  /// accepted step has max over free points and coordinates of max(|e_x|, h |e_v|) ≤ tolerance [m], where
  /// e_x, e_v are the estimated errors of position and velocity; below the rounding of the positions the
  /// tolerance counts as that rounding. Steps are never shorter than `shortest` [s]; those are taken
  /// whatever their error. The same start gives the same steps.
  SolveResult adapt(Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double span, double tolerance,
                    double shortest);
  Index adapted_steps() const { return adapted_steps_; }  ///< accepted by the last `adapt`

  /// Takes from accelerations at rest what surfaces bear that an implicit step has found.
  void bear(Points<S>& a) const { solver_.bear(a); }

  /// Since construction; kept by restart.
  const Work& work() const { return work_; }
  /// Adds evaluations that somebody else made for it.
  void count(std::int64_t evaluations) { work_.evaluations += evaluations; }

  /// Must be called when anything but this integrator changed x, v, or what forces depend on.
  void restart() { acceleration_known_ = false, increment_step_ = 0, solver_.restart(); }
  /// As restart, and what error control has learnt is gone: for other points.
  void forget() { restart(), adapted_step_ = 0, adapted_error_ = 1; }

  /// What is kept by restart. Loading restarts.
  void save(CheckpointWriter& out) const;
  void load(CheckpointReader& in, Index points);
  /// Drops what compensated sums keep: of all points, or of one whose x or v somebody else has set.
  void drop_low() { low_.position.setZero(), low_.velocity.setZero(); }
  void drop_low(Index point);
  /// What x and v are too small by. What moves them in its place may change it.
  LowParts<S>& low() { return low_; }

 private:
  SolveResult run(const Splitting&, Dynamics<S>&, Points<S>& x, Points<S>& v, double t, double h);
  SolveResult run(const Verlet&, Dynamics<S>&, Points<S>& x, Points<S>& v, double t, double h);
  SolveResult run(const RungeKutta&, Dynamics<S>&, Points<S>& x, Points<S>& v, double t, double h);
  SolveResult run(const Nystrom&, Dynamics<S>&, Points<S>& x, Points<S>& v, double t, double h);
  SolveResult run(const Implicit&, Dynamics<S>&, Points<S>& x, Points<S>& v, double t, double h);
  void evaluate(Dynamics<S>&, const Points<S>& x, const Points<S>& v, double t, Points<S>& a);
  void run_stages(const RungeKutta&, Dynamics<S>&, const Points<S>& x, const Points<S>& v, double t, double h);
  double error_of_stages(const RungeKutta&, const Values<S>& inverse_mass, double h);
  void finish(Dynamics<S>&, double t0, double t1, Points<S>& x, Points<S>& v);
  void add(Points<S>& sum, Points<S>& low, double factor, const Points<S>& addend);
  void collide(Dynamics<S>&, double t0, double t1, Points<S>& x, Points<S>& v);
  void prescribe(Dynamics<S>&, double t0, const Points<S>& from, double t1, Points<S>& x, Points<S>& v);
  void settle(Dynamics<S>&, Points<S>& v);

  const Method* method_;
  bool compensated_;
  bool acceleration_known_ = false;  // acceleration_ is a(x, v, t) of the coming step's start
  double increment_step_ = 0;        // the h that increment_ was made with; 0: not made yet
  double adapted_step_ = 0;          // what error control suggests next; 0: nothing yet
  double adapted_error_ = 1;         // of the last accepted step, in tolerances
  Index adapted_steps_ = 0;
  Work work_;
  LowParts<S> low_;
  Points<S> touched_x_, touched_v_;  // before a collision
  Points<S> acceleration_, increment_, from_, drift_from_, predicted_;
  std::vector<Points<S>> stage_velocity_, stage_acceleration_;
  Points<S> stage_x_, stage_v_;
  ImplicitSolver<S> solver_;
};

extern template class Integrator<float>;
extern template class Integrator<double>;

}  // namespace hooke
