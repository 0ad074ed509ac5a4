#include "plain_verlet.hpp"
#include "rivals.hpp"

#include <scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace hooke::report {

namespace {

template <class S>
PlainVerlet<S> yardstick_of(const PlainSprings& scene) {
  using Vec = typename PlainVerlet<S>::Vec;
  const auto n = std::size_t(scene.positions.rows());
  std::vector<Vec> x(n), v(n);
  std::vector<S> w(n);
  Vec gravity{};
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k) {
      x[i][k] = S(scene.positions(Index(i), k));
      v[i][k] = S(scene.velocities(Index(i), k));
    }
    w[i] = scene.held[i] ? S(0) : S(1 / scene.masses[Index(i)]);
  }
  for (int k = 0; k < 3; ++k) gravity[k] = S(scene.gravity[k]);
  std::vector<typename PlainVerlet<S>::Spring> springs;
  for (std::size_t s = 0; s < scene.springs.size(); ++s)
    springs.push_back({scene.springs[s].a, scene.springs[s].b, S(scene.springs[s].stiffness), S(scene.rest[s])});
  return {std::move(x), std::move(v), std::move(w), std::move(springs), gravity};
}

template <class S>
Points<double> positions_of(const PlainVerlet<S>& yardstick) {
  const auto& x = yardstick.positions();
  Points<double> out(Index(x.size()), 3);
  for (std::size_t i = 0; i < x.size(); ++i)
    for (int k = 0; k < 3; ++k) out(Index(i), k) = double(x[i][k]);
  return out;
}

template <class S>
Series series(const PlainSprings& scene, const char* precision) {
  Series out;
  out.name = std::string("yardstick, ") + precision;
  out.run = [scene, precision](int level, int copies, double) {
    const int first = std::max(1, int(std::ceil(0.5 * scene.duration / scene.stable_step)));
    const int steps = first << level;
    std::vector<PlainVerlet<S>> yardsticks(std::size_t(std::max(1, copies)), yardstick_of<S>(scene));
    settle(yardsticks.data());
    Outcome outcome;
    const double begin = cpu_seconds();
    for (PlainVerlet<S>& yardstick : yardsticks) {
      yardstick.run(steps, scene.duration);
      settle(&yardstick);
    }
    outcome.cpu = (cpu_seconds() - begin) / double(yardsticks.size());
    outcome.positions = positions_of(yardsticks[0]);
    outcome.row.method = "yardstick";
    outcome.row.precision = precision;
    outcome.row.dt = scene.duration / steps;
    outcome.row.evaluations = steps + 1;
    outcome.row.energy_drift = outcome.row.momentum_drift = std::nan("");
    return outcome;
  };
  return out;
}

}  // namespace

std::optional<PlainSprings> plain_springs(const scene::StandardScene& standard) {
  if (!standard.description) return {};
  const scene::SceneDescription& d = *standard.description;
  if (d.bodies.size() != 1 || !d.colliders.empty() || d.damping != 0) return {};
  const scene::SoftBody& body = d.bodies[0];
  if (body.wind || body.linear_drag != 0 || body.quadratic_drag != 0 || !body.pin_motion.empty()) return {};
  scene::SceneDescription in_double = d;
  in_double.bodies[0].solver.precision = softbody::Precision::Double;
  const scene::Scene scene = scene::build(in_double);
  PlainSprings out;
  out.springs = scene.bodies[0].network->springs;
  for (const softbody::Spring& spring : out.springs)
    if (spring.damping != 0) return {};
  if (out.springs.empty()) return {};
  const Body& built = *scene.bodies[0].body;
  out.positions = built.positions();
  out.velocities = built.velocities();
  out.masses = built.masses();
  out.held = scene.bodies[0].held;
  out.rest = scene.bodies[0].rest;
  out.triangles = scene.bodies[0].triangles;
  out.gravity = d.gravity;
  out.duration = standard.duration;
  out.stable_step = built.stable_step(velocity_verlet());
  return out;
}

std::vector<Series> yardstick(const PlainSprings& scene) {
  return {series<float>(scene, "float"), series<double>(scene, "double")};
}

}  // namespace hooke::report
