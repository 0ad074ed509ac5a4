#include "run.hpp"

#include <hooke/error.hpp>
#include <scene/library.hpp>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>

namespace hooke::command {

namespace {

constexpr int kLooksPerFrame = 4;  // of the figures of a cape

volatile std::sig_atomic_t caught = 0;

void on_signal(int) { caught = 1; }

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[300];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

void use_threads(World& world, int threads) {
  if (threads <= 1) return;
  world.set_threads(threads);
  const auto arena = std::make_shared<tbb::task_arena>(threads);
  world.set_parallel_for([arena](Index n, const std::function<void(Index)>& work) {
    arena->execute([&] { tbb::parallel_for(Index(0), n, work); });
  });
}

// Simulates up to world time `to` and adds to the clocks.
StepReport advance(World& world, double to, RunResult& result) {
  const double wall = wall_seconds(), cpu = cpu_seconds(), from = world.time();
  StepReport report = world.update(std::max(0.0, to - world.time() - world.clock().remainder()));
  result.wall += wall_seconds() - wall;
  result.cpu += cpu_seconds() - cpu;
  result.simulated += world.time() - from;
  for (const StepReport& warning : world.take_warnings())
    std::fprintf(stderr, "\nhooke: warning: %s\n", warning.text().c_str());
  return report;
}

}  // namespace

scene::Scene prepare(const RunOptions& options) {
  if (options.threads < 1 || options.threads > 1024)
    throw Error("--threads must be from 1 to 1024, got " + std::to_string(options.threads));
  scene::SceneDescription description = scene::find_scene(options.scene);
  if (options.error > 0 && description.bodies.empty() && !description.particles.empty())
    throw Error("--error is for soft bodies, and the scene has particles alone; give --method, --dt or --precision");
  if (options.error > 0)
    scene::choose_solvers(description, options.error);
  else
    scene::override_solver(description, options.method, options.dt, options.precision);
  if (options.end > 0) description.duration = options.end;
  scene::Scene scene = scene::build(description);
  use_threads(scene.world, options.threads);
  return scene;
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = int(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return caught != 0; }

double wall_seconds() { return seconds_of(CLOCK_MONOTONIC); }
double cpu_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

Progress::Progress(std::string what)
    : what_(std::move(what)), terminal_(isatty(STDERR_FILENO) != 0), begin_(wall_seconds()) {}

void Progress::show(double share) {
  const double now = wall_seconds();
  const double left = share > 0 ? (now - begin_) * (1 - share) / share : 0;
  if (terminal_) {
    if (share < 1 && now - last_ < 0.1) return;
    last_ = now;
    std::fprintf(stderr, "\r%s: %3.0f %%, %.0f s left   ", what_.c_str(), 100 * share, left);
    std::fflush(stderr);
    line_open_ = true;
  } else if (int(10 * share + 1e-9) > tenth_) {
    tenth_ = int(10 * share + 1e-9);
    std::fprintf(stderr, "%s: %d %%, %.0f s left\n", what_.c_str(), 10 * tenth_, left);
  }
}

void Progress::finish() {
  if (line_open_) std::fprintf(stderr, "\n");
  line_open_ = false;
}

int RunResult::exit_code() const {
  if (!report.good()) return kDiverged;
  return interrupted ? kInterrupted : kDone;
}

RunResult start_of(const scene::Scene& scene) {
  RunResult result;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].wears >= 0) result.capes.emplace_back(scene, i);
  return result;
}

RunResult run(scene::Scene& scene, double end, const FrameWork& frame, const BetweenFrames& between, RunResult result) {
  World& world = scene.world;
  const double preroll = scene.description.preroll, rate = scene.description.frame_rate;
  // A last frame that is shorter than the others ends with the run.
  result.wanted_frames = std::int64_t(std::ceil(end * rate - 1e-6)) + 1;

  Progress progress("simulate");
  const auto finish = [&] {
    progress.finish();
    result.interrupted = interrupted();
    result.shown_time = scene.shown_time();
    return result;
  };
  const std::int64_t preroll_frames = std::int64_t(std::ceil(preroll * rate - 1e-6));
  for (std::int64_t i = result.preroll_frames + 1; i <= preroll_frames; ++i) {
    result.report = advance(world, std::min(double(i) / rate, preroll), result);
    if (!result.report.good()) return finish();
    result.preroll_frames = i;
    const bool last = interrupted();
    between(result, last);
    if (last) return finish();
    progress.show(double(i) / rate / (preroll + end));
  }
  for (std::int64_t i = result.frames; i < result.wanted_frames; ++i) {
    const double wall = result.wall;
    const int looks = result.capes.empty() ? 1 : kLooksPerFrame;
    for (int look = 1; look <= looks && i > 0; ++look) {
      const double time = std::min((double(i - 1) + double(look) / looks) / rate, end);
      result.report = advance(world, preroll + time, result);
      if (!result.report.good()) return finish();
      if (look < looks)
        for (scene::CapeFigures& cape : result.capes) cape.measure(scene);
    }
    for (scene::CapeFigures& cape : result.capes) cape.measure_frame(scene);
    frame(i, 1e3 * (result.wall - wall));
    result.frames = i + 1;
    progress.show(std::min(1.0, (preroll + double(i) / rate) / (preroll + end)));
    if (result.frames == result.wanted_frames) break;
    const bool last = interrupted();
    between(result, last);
    if (last) return finish();
  }
  finish();
  result.interrupted = false;
  return result;
}

std::string chosen(const scene::Scene& scene) {
  std::string out;
  const double tick = scene.world.clock().tick();
  for (const scene::SceneBody& body : scene.bodies) {
    const MotionFacts facts = body.body->motion_facts();
    out += body.body->name() + ": " + std::to_string(body.body->size()) + " points, " +
           std::to_string(body.network->springs.size()) + " springs; " + facts.method + ", " + facts.precision + ", ";
    out += format("%ld substep%s of %.4g ms a tick of %.4g ms%s\n", long(facts.substeps),
                  facts.substeps == 1 ? "" : "s", 1e3 * tick / double(std::max<Index>(facts.substeps, 1)), 1e3 * tick,
                  facts.wanted_dt > 0 ? " (dt given)" : " (automatic)");
    if (const auto filtered = softbody::filtered_facts(*body.body))
      out += body.body->name() + ": " + filtered->text() + "\n";
    if (facts.wanted_dt > 0 && facts.stable_step > 0 &&
        tick / double(std::max<Index>(facts.substeps, 1)) > facts.stable_step)
      out += format("%s: warning: the step is above the largest stable one, %.4g ms\n", body.body->name().c_str(),
                    1e3 * facts.stable_step);
  }
  for (const scene::SceneParticles& particles : scene.particles) {
    const MotionFacts facts = particles.body().motion_facts();
    out += particles.body().name() + ": " + particles.text() + "; " + facts.method + ", " + facts.precision + ", ";
    out += format("%ld substep%s of %.4g ms a tick of %.4g ms%s\n", long(facts.substeps),
                  facts.substeps == 1 ? "" : "s", 1e3 * tick / double(std::max<Index>(facts.substeps, 1)), 1e3 * tick,
                  facts.wanted_dt > 0 ? " (dt given)" : "");
  }
  return out;
}

std::string summary(const RunResult& result) {
  std::string out;
  if (!result.report.good())
    out += "diverged: " + result.report.text() + "\n";
  else if (result.interrupted)
    out += "interrupted: ";
  out += format("%lld of %lld frames, up to %.6g s", static_cast<long long>(result.frames),
                static_cast<long long>(result.wanted_frames), result.shown_time);
  if (result.simulated > 0)
    out += format("; per simulated second %.4g s of processor time, %.4g s by the clock", result.cpu / result.simulated,
                  result.wall / result.simulated);
  out += "\n";
  if (result.frames > 0)
    for (const scene::CapeFigures& cape : result.capes) out += cape.text();
  return out;
}

}  // namespace hooke::command
