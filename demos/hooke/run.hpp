// Runs a scene frame by frame: progress, signals, timing. What is done with a frame is the
// caller's business.
#pragma once

#include <scene/figures.hpp>
#include <scene/scene.hpp>

#include <functional>
#include <string>
#include <vector>

namespace hooke::command {

/// Exit codes of the command.
enum Exit { kDone = 0, kDiverged = 1, kBadInput = 2, kOutputFailed = 3, kInterrupted = 130 };

/// The common options of simulate and render; empty and 0 leave the scene's own.
struct RunOptions {
  std::string scene;
  std::string method, precision;
  double dt = 0, end = 0;  ///< [s]
  double error = 0;        ///< wanted, a share of each body's size
  int threads = 1;
};

/// Finds and builds the scene with the options applied.
scene::Scene prepare(const RunOptions& options);

/// From now on SIGINT and SIGTERM only set a flag; a second one ends the program at once.
void catch_signals();
bool interrupted();

/// A line on a terminal that is written over, or a line each tenth elsewhere. On stderr.
class Progress {
 public:
  explicit Progress(std::string what);
  /// @param share done, in [0, 1]
  void show(double share);
  void finish();

 private:
  std::string what_;
  bool terminal_;
  double begin_, last_ = -1;
  int tenth_ = 0;
  bool line_open_ = false;
};

/// Seconds of a clock that only goes forward, and of processor time of this process.
double wall_seconds();
double cpu_seconds();

struct RunResult {
  StepReport report;
  bool interrupted = false;
  std::int64_t preroll_frames = 0;  ///< finished, of the preroll
  std::int64_t frames = 0;          ///< finished, the one at time 0 included
  std::int64_t wanted_frames = 0;
  double shown_time = 0;     ///< [s]
  double wall = 0, cpu = 0;  ///< of the simulation alone [s], preroll included
  double simulated = 0;      ///< [s], preroll included
  std::vector<scene::CapeFigures> capes;

  /// kDone, kDiverged or kInterrupted.
  int exit_code() const;
};

/// Called for the state at time 0 and after each frame, with the milliseconds of simulation.
using FrameWork = std::function<void(std::int64_t frame, double simulate_ms)>;

/// Called between frames, those of the preroll included, where the run can be left and gone on with.
/// @param last the run was interrupted and ends here
using BetweenFrames = std::function<void(const RunResult& result, bool last)>;

/// A run that has not begun.
RunResult start_of(const scene::Scene& scene);

/// Simulates the preroll and then the frames up to `end` [s], from where `result` and the world stand.
RunResult run(scene::Scene& scene, double end, const FrameWork& frame, const BetweenFrames& between, RunResult result);
inline RunResult run(scene::Scene& scene, double end, const FrameWork& frame) {
  return run(
      scene, end, frame, [](const RunResult&, bool) {}, start_of(scene));
}

/// What was chosen, a line a body.
std::string chosen(const scene::Scene& scene);

/// How far it came, how fast, the capes' figures and, where it failed, why.
std::string summary(const RunResult& result);

}  // namespace hooke::command
