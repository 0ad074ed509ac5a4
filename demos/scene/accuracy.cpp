#include <scene/accuracy.hpp>

#include <hooke/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hooke::scene {

namespace {

constexpr double kLeastGrowth = 0.5, kMostGrowth = 2.5;

double rms(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().rowwise().sum().mean());
}

double size_of(const Points<double>& x) {
  return std::sqrt((x.colwise().maxCoeff() - x.colwise().minCoeff()).square().sum());
}

void advance(Scene& scene, std::int64_t ticks, const char* which) {
  const double tick = scene.world.clock().tick();
  for (std::int64_t i = 0; i < ticks; ++i)
    if (const StepReport report = scene.world.update(tick); !report.good())
      throw Error(std::string(which) + " diverges: " + report.text());
}

std::int64_t ticks_of(const SceneDescription& d) {
  return std::max<std::int64_t>(1, std::int64_t(std::floor((d.preroll + d.duration) * d.tick_rate + 1e-6)));
}

std::int64_t evaluations_of(const Scene& scene) {
  std::int64_t sum = 0;
  for (const SceneBody& body : scene.bodies) {
    const MotionFacts facts = body.body->motion_facts();
    sum += facts.evaluations + facts.products;
  }
  return sum;
}

// The description with what the chooser picked in place of what was wanted.
SceneDescription settled(const Scene& scene) {
  SceneDescription out = scene.description;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (!scene.bodies[i].choice) continue;
    const softbody::SolverChoice& choice = *scene.bodies[i].choice;
    Solver& solver = out.bodies[i].solver;
    solver = {};
    solver.method = std::string(choice.method->name);
    solver.precision = choice.precision;
    solver.dt = choice.dt;
  }
  // They push no soft body, and their points come and go.
  out.particles.clear();
  return out;
}

}  // namespace

ErrorEstimate estimate_errors(const Scene& like) {
  const SceneDescription description = settled(like);
  const std::int64_t ticks = ticks_of(description);
  const std::int64_t part = std::max<std::int64_t>(2, (std::int64_t(kEstimatedPart * double(ticks)) + 1) / 2 * 2);
  const double tick = 1 / description.tick_rate;
  Scene run = build(description, &like);
  SceneDescription finer = description;
  // The automatic step is known after a tick; it is then held.
  advance(run, 1, "the run");
  for (std::size_t i = 0; i < run.bodies.size(); ++i) {
    Solver& solver = finer.bodies[i].solver;
    const MotionFacts facts = run.bodies[i].body->motion_facts();
    const bool adaptive = solver.dt == 0 && solver.method == dormand_prince().name;
    if (adaptive)
      solver.tolerance /= 32;
    else
      solver.dt = 0.5 * tick / double(std::max<Index>(1, facts.substeps)), solver.wanted_error = 0;
  }
  Scene half = build(finer, &like);
  ErrorEstimate out;
  out.part = double(part) / double(ticks);
  std::vector<double> midway;
  advance(run, part / 2 - 1, "the run");
  advance(half, part / 2, "the run at half its step");
  for (std::size_t i = 0; i < run.bodies.size(); ++i)
    midway.push_back(rms(run.bodies[i].body->positions(), half.bodies[i].body->positions()));
  advance(run, part - part / 2, "the run");
  advance(half, part - part / 2, "the run at half its step");
  for (std::size_t i = 0; i < run.bodies.size(); ++i) {
    const Body& body = *run.bodies[i].body;
    const double seen = rms(body.positions(), half.bodies[i].body->positions());
    const std::string& name = finer.bodies[i].solver.method;
    const int full =
        name == softbody::filtered_leapfrog().name || name == softbody::xpbd().name ? 1 : method_named(name).order;
    const int order = description.colliders.empty() ? full : 1;
    const double growth =
        midway[i] > 0 && seen > 0 ? std::clamp(std::log2(seen / midway[i]), kLeastGrowth, kMostGrowth) : 1;
    Accuracy accuracy;
    accuracy.body = body.name();
    accuracy.size = size_of(body.start_positions());
    accuracy.error = seen / (1 - std::pow(0.5, order)) * std::pow(1 / out.part, growth);
    out.bodies.push_back(accuracy);
  }
  const double whole = double(evaluations_of(run)) / out.part;
  out.cost = whole > 0 ? double(evaluations_of(run) + evaluations_of(half)) / whole : 0;
  return out;
}

std::vector<Accuracy> verify_errors(const Scene& end) {
  const std::int64_t ticks = end.world.clock().ticks();
  const double tick = end.world.clock().tick();
  SceneDescription finer = end.description;
  finer.particles.clear();
  std::vector<double> steps;
  for (std::size_t i = 0; i < end.bodies.size(); ++i) {
    Solver& solver = finer.bodies[i].solver;
    solver = {};
    const Body& body = *end.bodies[i].body;
    const Method& method = body.motion_facts().velocity_forces ? rk4() : blanes_moan_6();
    solver.method = std::string(method.name);
    solver.precision = softbody::Precision::Double;
    const double stable = 0.9 * body.stable_step(method);
    steps.push_back(stable > 0 && std::isfinite(stable) ? std::ceil(tick / stable) : 1);
  }
  std::vector<Accuracy> out(end.bodies.size());
  std::vector<Points<double>> before;
  for (int level = 0; level < 7; ++level) {
    for (std::size_t i = 0; i < steps.size(); ++i) finer.bodies[i].solver.dt = tick / (steps[i] * std::pow(2.0, level));
    Scene reference = build(finer, &end);
    advance(reference, ticks, "the reference");
    bool settled = true;
    std::vector<Points<double>> now;
    for (std::size_t i = 0; i < out.size(); ++i) {
      now.push_back(reference.bodies[i].body->positions());
      out[i].body = end.bodies[i].body->name();
      out[i].size = size_of(end.bodies[i].body->start_positions());
      out[i].error = rms(end.bodies[i].body->positions(), now[i]);
      out[i].uncertainty = level > 0 ? rms(now[i], before[i]) : std::numeric_limits<double>::infinity();
      settled = settled && (out[i].uncertainty <= 0.1 * out[i].error || out[i].uncertainty <= 1e-13 * out[i].size);
    }
    if (settled) break;
    before = std::move(now);
  }
  return out;
}

}  // namespace hooke::scene
