// The chooser: from a wanted error to method, precision and step.
// How it decides and what it was measured to reach: docs/chooser.md.
#pragma once

#include <hooke/softbody/soft_body.hpp>

#include <functional>
#include <string>
#include <vector>

namespace hooke::softbody {

/// What surrounds a body in the run that a solver is chosen for.
struct RunSetting {
  Vec3 gravity{0, -9.81, 0};  ///< [m/s²]
  double duration = 0;        ///< of the whole run [s], > 0
  double tick_rate = 240;     ///< ticks per second, > 0
  double damping = 0;         ///< global: fraction of velocity lost per second, in [0, 1)
  std::vector<Collider> colliders;
  std::function<void(Body&)> prepare;  ///< done to every trial body, e.g. drives its pins; may be empty
};

/// Nanoseconds of one force evaluation per spring, the step included; fixed, so that one scene gives one
/// choice on every machine. Only their ratios decide.
struct CostTable {
  double single, twice;  ///< float, double
};
inline constexpr CostTable kGridCost{0.75, 1.7};    ///< undamped springs of a grid, however numbered
inline constexpr CostTable kNetworkCost{2.4, 3.9};  ///< other undamped springs
/// The general way: other forces, dampers, other methods.
inline constexpr CostTable kDampedCost{8, 10};
inline constexpr CostTable kFilteredCost{1.6, 3.2};  ///< a step of filtered leapfrog
inline constexpr CostTable kXpbdCost{15, 17};        ///< a sweep of xpbd(), a quarter of its substep's rest included
inline constexpr CostTable kProductCost{20, 22};     ///< a product of an implicit solve

/// True where this body, with this RMS speed over points [m/s] and gravity [m/s²], is in float at steps of h stepped
/// in double (MotionSettings::compensated): that costs what double costs.
/// @param stable_step the method's largest [s]; 0: not looked at
bool rounding_shows(const SoftBodySettings& settings, double h, double speed, double gravity, double stable_step = 0);

/// What the table says of `evaluations` of the forces on this body, or sweeps of xpbd().
/// @param in_double rounding_shows
/// @return [s]
double modelled_seconds(const SoftBodySettings& settings, const Method& method, Precision precision, double evaluations,
                        bool in_double = false);

/// What implicit methods cost on a body by the table and counted work, as if every step and every run of products
/// that is worth it began with a factorisation of the springs' matrix: 1 ns a multiplication in it and in its solves.
class ImplicitCost {
 public:
  /// Cost: that of ordering the matrix.
  explicit ImplicitCost(const SoftBodySettings& settings);
  /// @return [s]
  double seconds(Precision precision, double evaluations, double products, double steps) const;

 private:
  double springs_and_points_, factoring_ = 0, solving_ = 0;  // multiplications
};

/// Force evaluations of a run of `ticks` ticks of `substeps` steps, explicit methods; sweeps of xpbd().
double evaluations_of(const Method& method, double ticks, double substeps);

/// A way to move the body that was looked at.
struct Candidate {
  const Method* method = nullptr;
  Precision precision = Precision::Double;
  Index substeps = 1;          ///< a tick
  double predicted_error = 0;  ///< RMS over the points at the end of the run [m]
  double evaluations = 0;      ///< of all forces in the run; sweeps of xpbd()
  double seconds = 0;          ///< by the table
};

/// What was picked and why.
struct SolverChoice : Candidate {
  double dt = 0;                                    ///< [s]
  double size = 0;                                  ///< diagonal of the body's box at the start [m]
  double wanted_error = 0;                          ///< [m]
  bool meets = false;                               ///< false: nothing does; this is the most accurate there is
  std::string reason;                               ///< one line
  double pilot_evaluations = 0, pilot_seconds = 0;  ///< what choosing cost
  std::vector<Candidate> rejected;                  ///< the dearer and the less accurate ones, cheapest first

  /// Writes method, precision and step.
  void apply(SoftBodySettings& settings) const;
  /// Two lines for people.
  std::string text() const;
};

/// Picks method, precision and step so that the RMS error of the positions at the end of the run is at
/// most `wanted_error` times the diagonal of the body's bounding box at the start, at the least cost.
///
/// Short trial runs at and below the stability limit of velocity Verlet are compared and their difference is
/// extrapolated to the end of the run; for grids and coarse errors filtered leapfrog is refined from coarse steps.
/// Methods of order 4 and 6 are tried where velocity Verlet would need much shorter steps, xpbd() and backward Euler
/// where its stable step is so short that coarse steps of theirs cost much less. Everything is decided by
/// counted operations and CostTable: the same arguments give the same choice on every machine whose arithmetic is
/// IEEE's. Cost: about 0.1 to 0.8 of the run that it picks; told in the choice.
/// @param settings `motion.method`, `motion.dt`, `precision` and `wanted_error` are not looked at
/// @param wanted_error relative, > 0
/// @throws std::invalid_argument for a wanted error, duration or rate that is not positive and finite, and as
///         make_soft_body
SolverChoice choose_solver(const SoftBodySettings& settings, const RunSetting& run, double wanted_error);

/// The true error of settings (method, precision and dt as set) at the end of the run.
struct Verification {
  double error = 0;        ///< RMS distance to the reference [m]
  double uncertainty = 0;  ///< of the reference: its last change when its step was halved [m]
  double seconds = 0;      ///< by the table, of the reference runs
  std::string reference;   ///< what it was compared with
  bool converged() const { return uncertainty <= 0.1 * error || uncertainty == 0; }
};

/// Compares with a run of Blanes-Moan 6 (RK4 where forces take velocities) in double, its step halved until
/// that changes it by less than a tenth of the error, at most 6 times.
/// Cost: tens of times that of the run.
/// @throws std::invalid_argument as choose_solver; hooke::Error where a run diverges
Verification verify(const SoftBodySettings& settings, const RunSetting& run);

}  // namespace hooke::softbody
