// The chooser: from a wanted error to method, precision and step.
// How it decides and what it was measured to reach: docs/chooser.md.
#pragma once

#include <hooke/softbody/solver_cost.hpp>

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
/// where its stable step is so short that coarse steps of theirs cost much less, or where the body hardly moves.
/// Everything is decided by counted operations and CostTable: the same arguments give the same choice on every machine
/// whose arithmetic is IEEE's. Cost: about 0.1 to 0.8 of the run that it picks, more where that is a step or two a
/// tick; told in the choice.
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
