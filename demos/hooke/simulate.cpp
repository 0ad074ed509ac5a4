#include "commands.hpp"
#include "exports.hpp"

#include <hooke/error.hpp>
#include <hooke/io/tables.hpp>
#include <scene/accuracy.hpp>

#include <cstdio>
#include <optional>

namespace hooke::command {

namespace {

// The files of one run.
class Outputs {
 public:
  Outputs(const SimulateOptions& options, const scene::Scene& scene, Exports& exports)
      : folder_(options.out),
        diagnostics_(folder_ / "diagnostics.csv"),
        timings_(folder_ / "timings.csv"),
        exports_(exports) {
    if (!scene.particles.empty()) counts_.emplace(folder_ / "particles.csv");
    exports_.open(folder_);
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

}  // namespace

int simulate(const SimulateOptions& options) {
  if (!options.export_format.empty()) check_export_format(options.export_format);
  scene::Scene scene = prepare(options.run);
  Exports exports(options.export_format, scene);
  io::make_folder(options.out);
  Outputs outputs(options, scene, exports);
  std::printf("%s", exports.left_out().c_str());
  catch_signals();
  bool told = false;
  const RunResult result = run(scene, scene.description.duration, [&](std::int64_t frame, double ms) {
    outputs.add(scene, ms);
    if (frame == 0 || told) return;
    told = true;
    print_choices(scene);
  });
  if (!told) print_choices(scene);
  outputs.finish(scene);
  std::printf("%s", summary(result).c_str());
  if (!result.report.good()) std::fprintf(stderr, "hooke: %s\n", result.report.text().c_str());
  if (result.interrupted)
    std::fprintf(stderr, "hooke: interrupted at %.6g s; what is finished is in %s\n", result.shown_time,
                 options.out.c_str());
  const bool whole = result.exit_code() == kDone;
  if (options.estimate_error && whole) print_estimates(scene);
  if (options.verify && whole) print_verification(scene);
  return result.exit_code();
}

}  // namespace hooke::command
