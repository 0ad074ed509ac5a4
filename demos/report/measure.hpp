// Runs a standard scene with every method, precision and step there is, and compares each run
// with an answer that none of them made alone.
#pragma once

#include <scene/standard.hpp>

#include <functional>
#include <string>
#include <vector>

namespace hooke::report {

/// One run, measured. What was not asked or not reached is NaN.
struct Row {
  std::string method, precision;
  std::string setting;        ///< what else was set, e.g. "5 iterations"
  double dt = 0;              ///< step [s]; the mean one where the method chooses
  double tolerance = 0;       ///< of an adaptive method [m]; 0: fixed steps
  double seconds = 0;         ///< processor time of one thread per simulated second, least of `repeats`
  int repeats = 0;            ///< how often it was run
  double rms = 0, worst = 0;  ///< error at the scene's end, over points [m]
  double energy_drift = 0;    ///< worst |E - E(0)| over the greatest kinetic energy
  double momentum_drift = 0;  ///< worst |P - P(0) - M g t| over √(2 M · greatest kinetic energy)
  double evaluations = 0;     ///< of all forces, products of implicit solves included; sweeps of XPBD
  std::string status = "ok";  ///< or "blow-up", "not converged"
  bool ok() const { return status == "ok"; }
};

/// What the runs are compared with.
struct Reference {
  Points<double> answer{0, 3};   ///< positions, or statistics of them, at the scene's end
  std::string text;              ///< how it was made
  double step_difference = 0;    ///< between its two finest steps, RMS [m]
  double method_difference = 0;  ///< between two methods, RMS [m]
  /// Errors below this say nothing.
  double uncertainty() const { return std::max(step_difference, method_difference); }
};

struct SceneReport {
  scene::StandardScene scene;
  Index points = 0, springs = 0;
  double size = 0;  ///< diagonal of the box that holds all points at the start and at the end [m]
  Reference reference;
  std::vector<Row> rows;
  std::vector<std::string> notes;  ///< who refused the scene and why, and what the budget cut off
};

/// How much time to spend.
struct Effort {
  /// Processor time for the runs of a scene, and at most once more for its reference [s]; three times that where
  /// the scene is large.
  double budget = 30;
  double repeat = 0.06;  ///< short runs are repeated for this long [s]
  bool operator==(const Effort&) const = default;
};

/// One run as a series makes it. `positions` of all points at the scene's end [m].
struct Outcome {
  double cpu = 0;  ///< [s]
  bool cut = false;
  Points<double> positions{0, 3};
  Row row;
};

/// Runs of one method from coarse to fine. `run(level, copies, limit)`: with `copies` 0 the run is watched and
/// all of Outcome is told, but it may give up (`cut`) once it is clear that it takes longer than `limit` seconds;
/// else only `cpu` is told, the mean of that many runs that are timed together.
struct Series {
  std::string name;
  std::function<Outcome(int level, int copies, double limit)> run;
  int levels = 16;
};

/// Keeps the compiler from moving work on `object` past a reading of the clock.
inline void settle(const void* object) { __asm__ volatile("" : : "r"(object) : "memory"); }

/// What is compared with the reference: the points, or their centre and spread, shape (2, 3).
Points<double> compared(const scene::StandardScene& scene, const Points<double>& positions);

/// Runs everything. `progress(done)` is told the share of the budget that is spent.
SceneReport measure(const scene::StandardScene& scene, const Effort& effort,
                    const std::function<void(double done)>& progress);

/// Processor time of this process [s].
double cpu_seconds();

}  // namespace hooke::report
