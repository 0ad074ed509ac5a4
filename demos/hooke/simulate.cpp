#include "commands.hpp"
#include "exports.hpp"

#include <hooke/checkpoint.hpp>
#include <hooke/error.hpp>
#include <hooke/io/tables.hpp>
#include <scene/accuracy.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>

namespace hooke::command {

namespace {

// How much of its tables a run had written [bytes]; < 0: nothing yet.
struct Written {
  std::int64_t diagnostics = -1, timings = -1, counts = -1;
};

// The files of one run.
class Outputs {
 public:
  // Goes on after `frames` frames and what was written until then.
  Outputs(const SimulateOptions& options, const scene::Scene& scene, Exports& exports, const Written& written,
          std::int64_t frames)
      : folder_(options.out),
        diagnostics_(folder_ / "diagnostics.csv", written.diagnostics),
        timings_(folder_ / "timings.csv", written.timings),
        exports_(exports) {
    if (!scene.particles.empty()) counts_.emplace(folder_ / "particles.csv", written.counts);
    exports_.open(folder_, frames);
  }

  // Everything so far is on the disk.
  Written sync() {
    exports_.sync();
    return {diagnostics_.sync(), timings_.sync(), counts_ ? counts_->sync() : -1};
  }

  void add(const scene::Scene& scene, double simulate_ms) {
    io::Timings timings;
    timings.time = scene.shown_time();
    timings.simulate = simulate_ms;
    double begin = wall_seconds();
    const auto lap = [&begin] {
      const double now = wall_seconds(), ms = 1e3 * (now - begin);
      begin = now;
      return ms;
    };
    const Energy energy = scene.world.energy();
    const io::Diagnostics diagnostics{scene.shown_time(), energy.kinetic,         energy.gravitational,
                                      energy.elastic,     scene.world.momentum(), scene::worst_stretch(scene)};
    timings.measure = lap();
    diagnostics_.add(diagnostics);
    if (counts_) counts_->add(scene);
    exports_.add();
    timings.write = lap();
    timings_.add(timings);
  }

  void finish(const scene::Scene& scene) {
    io::StateTable state(folder_ / "state.csv");
    for (const scene::SceneBody& body : scene.bodies)
      state.add(body.body->name(), body.body->positions(), body.body->velocities());
    for (const scene::SceneParticles& particles : scene.particles)
      state.add(particles.body().name(), particles.body().positions(), particles.body().velocities());
    state.finish();
    diagnostics_.finish();
    timings_.finish();
    if (counts_) counts_->finish();
    exports_.finish();
  }

 private:
  std::filesystem::path folder_;
  io::DiagnosticsTable diagnostics_;
  io::TimingsTable timings_;
  std::optional<CountsTable> counts_;
  Exports& exports_;
};

// Particles come and go, and an error is that of a point.
void print_left_out(const scene::Scene& scene, const char* what) {
  for (const scene::SceneParticles& particles : scene.particles)
    std::printf("%s: no %s: it follows points from start to end, and particles come and go\n",
                particles.body().name().c_str(), what);
}

void print_choices(const scene::Scene& scene) {
  std::printf("%s", chosen(scene).c_str());
  for (const scene::SceneBody& body : scene.bodies)
    if (body.choice) std::printf("%s: %s\n", body.body->name().c_str(), body.choice->text().c_str());
  std::fflush(stdout);
}

// By the chooser where it was asked, else by a part of the run with half the steps.
void print_estimates(const scene::Scene& scene) {
  print_left_out(scene, "error estimate");
  bool all = true;
  for (const scene::SceneBody& body : scene.bodies) {
    all = all && body.choice;
    if (body.choice)
      std::printf("%s: error estimate %.2g m, %.2g of its size, from the chooser's trials\n", body.body->name().c_str(),
                  body.choice->predicted_error, body.choice->predicted_error / body.choice->size);
  }
  if (all) return;
  try {
    const scene::ErrorEstimate estimate = scene::estimate_errors(scene);
    for (std::size_t i = 0; i < scene.bodies.size(); ++i)
      if (!scene.bodies[i].choice)
        std::printf(
            "%s: error estimate %.2g m, %.2g of its size, from half the step over the first %.3g of the run; cost "
            "%.2g of the run\n",
            estimate.bodies[i].body.c_str(), estimate.bodies[i].error,
            estimate.bodies[i].error / estimate.bodies[i].size, estimate.part, estimate.cost);
  } catch (const Error& error) {
    std::printf("no error estimate: %s\n", error.what());
  }
}

void print_verification(const scene::Scene& scene) {
  print_left_out(scene, "verification");
  for (const scene::Accuracy& body : scene::verify_errors(scene))
    std::printf("%s: true error %.2g m, %.2g of its size (reference settled to %.1g m)\n", body.body.c_str(),
                body.error, body.error / body.size, body.uncertainty);
}

// Of a default run: least time between checkpoints by the clock [s], and most of it that they may take.
constexpr double kCheckpointPause = 10, kCheckpointShare = 0.01;

// DIR/checkpoint: where a run stands between two frames.
class Checkpoints {
 public:
  Checkpoints(const SimulateOptions& options, const scene::Scene& scene)
      : path_(options.out / "checkpoint"), interval_(options.checkpoint), last_(wall_seconds()) {
    std::ifstream file(scene.description.file, std::ios::binary);
    std::ostringstream contents;
    if (file) contents << file.rdbuf();
    CheckpointWriter scene_bytes;
    scene_bytes.add(std::string_view(file ? "" : scene.description.file));
    const std::string bytes = contents.str();
    scene_bytes.add(std::span<const char>(bytes.data(), bytes.size()));
    settings_.add("program", HOOKE_VERSION);
    settings_.add_sum("scene", scene_bytes);
    settings_.add("--method", options.run.method);
    settings_.add("--precision", options.run.precision);
    settings_.add("--dt", options.run.dt);
    settings_.add("--error", options.run.error);
    settings_.add("--end", options.run.end);
    settings_.add("--export", options.export_format);
  }

  void remove() const {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  // Puts the scene and the run where they were.
  void load(scene::Scene& scene, RunResult& run, Written& written) {
    std::ifstream file(path_, std::ios::binary);
    if (!file)
      throw Error(path_.string() +
                  ": there is no checkpoint to resume from; a finished run leaves none. Run again without "
                  "--resume");
    CheckpointReader in = CheckpointReader::read(file, path_.string());
    in.begin("run");
    settings_.check(in);
    run.preroll_frames = in.number<std::int64_t>("frames of the preroll", 0);
    run.frames = in.number<std::int64_t>("frames", 0);
    for (std::int64_t* bytes : {&written.diagnostics, &written.timings, &written.counts})
      *bytes = in.number<std::int64_t>("bytes written", -1);
    for (scene::CapeFigures& cape : run.capes) cape.load(in);
    in.end();
    scene.world.load(in);
    in.finish();
    saved_ = scene.world.time();
  }

  bool due(const scene::Scene& scene, bool last) const {
    if (interval_ && *interval_ == 0) return false;
    if (last) return true;
    if (!interval_) return wall_seconds() - last_ >= std::max(kCheckpointPause, cost_ / kCheckpointShare);
    const auto number = [&](double time) { return std::floor(time / *interval_ + 1e-9); };
    return number(scene.world.time()) > number(saved_);
  }

  void save(const scene::Scene& scene, const RunResult& run, const Written& written) {
    const double begin = wall_seconds();
    CheckpointWriter out;
    out.begin("run");
    settings_.save(out);
    out.add(run.preroll_frames);
    out.add(run.frames);
    for (const std::int64_t bytes : {written.diagnostics, written.timings, written.counts}) out.add(bytes);
    for (const scene::CapeFigures& cape : run.capes) cape.save(out);
    out.end();
    scene.world.save(out);
    io::OutputFile file(path_);
    file.write(out.file());
    file.sync();
    file.commit();
    saved_ = scene.world.time();
    last_ = wall_seconds();
    cost_ = last_ - begin;
  }

 private:
  std::filesystem::path path_;
  std::optional<double> interval_;
  Blueprint settings_;
  double saved_ = -1e300;       // world time of the last one [s]; none yet
  double last_ = 0, cost_ = 0;  // by the clock [s]
};

}  // namespace

int simulate(const SimulateOptions& options) {
  if (!options.export_format.empty()) check_export_format(options.export_format);
  scene::Scene scene = prepare(options.run);
  Exports exports(options.export_format, scene);
  Checkpoints checkpoints(options, scene);
  RunResult start = start_of(scene);
  Written written;
  if (options.resume) {
    checkpoints.load(scene, start, written);
  } else {
    io::make_folder(options.out);
    checkpoints.remove();
  }
  Outputs outputs(options, scene, exports, written, start.frames);
  std::printf("%s", exports.left_out().c_str());
  if (options.resume)
    std::printf("resumed at %.6g s, frame %lld\n", scene.shown_time(), static_cast<long long>(start.frames));
  catch_signals();
  bool told = false;
  const auto frame = [&](std::int64_t number, double ms) {
    outputs.add(scene, ms);
    if (number == 0 || told) return;
    told = true;
    print_choices(scene);
  };
  const auto between = [&](const RunResult& result, bool last) {
    if (checkpoints.due(scene, last)) checkpoints.save(scene, result, outputs.sync());
  };
  const RunResult result = run(scene, scene.description.duration, frame, between, std::move(start));
  if (!told) print_choices(scene);
  outputs.finish(scene);
  const bool whole = result.exit_code() == kDone;
  if (whole) checkpoints.remove();
  std::printf("%s", summary(result).c_str());
  if (!result.report.good()) std::fprintf(stderr, "hooke: %s\n", result.report.text().c_str());
  if (result.interrupted)
    std::fprintf(stderr, "hooke: interrupted at %.6g s; what is finished is in %s%s\n", result.shown_time,
                 options.out.c_str(), options.checkpoint == 0.0 ? "" : ", and --resume goes on from there");
  if (options.estimate_error && whole) print_estimates(scene);
  if (options.verify && whole) print_verification(scene);
  return result.exit_code();
}

}  // namespace hooke::command
