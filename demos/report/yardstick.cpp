#include "rivals.hpp"

#include <scene/scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace hooke::report {

namespace {

// Plain scalar code on records, as it comes out of the pen: no reordering, no vectors, no tricks.
template <class S>
class Yardstick {
 public:
  explicit Yardstick(const PlainSprings& scene) : gravity_{} {
    const auto n = std::size_t(scene.positions.rows());
    x_.resize(n), v_.resize(n), f_.resize(n), w_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (int k = 0; k < 3; ++k) {
        x_[i][k] = S(scene.positions(Index(i), k));
        v_[i][k] = S(scene.velocities(Index(i), k));
      }
      w_[i] = scene.held[i] ? S(0) : S(1 / scene.masses[Index(i)]);
    }
    for (int k = 0; k < 3; ++k) gravity_[k] = S(scene.gravity[k]);
    for (std::size_t s = 0; s < scene.springs.size(); ++s)
      springs_.push_back({scene.springs[s].a, scene.springs[s].b, S(scene.springs[s].stiffness), S(scene.rest[s])});
  }

  void run(int steps, double duration) {
    const S h = S(duration / steps);
    pull();
    for (int step = 0; step < steps; ++step) {
      kick(h / 2);
      for (std::size_t i = 0; i < x_.size(); ++i)
        for (int k = 0; k < 3; ++k) x_[i][k] += h * v_[i][k];
      pull();
      kick(h / 2);
    }
  }

  Points<double> positions() const {
    Points<double> out(Index(x_.size()), 3);
    for (std::size_t i = 0; i < x_.size(); ++i)
      for (int k = 0; k < 3; ++k) out(Index(i), k) = double(x_[i][k]);
    return out;
  }

 private:
  using Vec = std::array<S, 3>;
  struct Joint {
    int a, b;
    S stiffness, rest;
  };

  void pull() {
    std::fill(f_.begin(), f_.end(), Vec{});
    for (const Joint& joint : springs_) {
      const Vec& p = x_[std::size_t(joint.a)];
      const Vec& q = x_[std::size_t(joint.b)];
      const Vec d{q[0] - p[0], q[1] - p[1], q[2] - p[2]};
      const S length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const S scale = joint.stiffness * (length - joint.rest) / length;
      for (int k = 0; k < 3; ++k) {
        f_[std::size_t(joint.a)][k] += scale * d[k];
        f_[std::size_t(joint.b)][k] -= scale * d[k];
      }
    }
  }

  void kick(S time) {
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (w_[i] == S(0)) continue;
      for (int k = 0; k < 3; ++k) v_[i][k] += time * (w_[i] * f_[i][k] + gravity_[k]);
    }
  }

  std::vector<Vec> x_, v_, f_;
  std::vector<S> w_;
  std::vector<Joint> springs_;
  Vec gravity_;
};

template <class S>
Series series(const PlainSprings& scene, const char* precision) {
  Series out;
  out.name = std::string("yardstick, ") + precision;
  out.run = [scene, precision](int level, int copies, double) {
    const int first = std::max(1, int(std::ceil(0.5 * scene.duration / scene.stable_step)));
    const int steps = first << level;
    std::vector<Yardstick<S>> yardsticks(std::size_t(std::max(1, copies)), Yardstick<S>(scene));
    settle(yardsticks.data());
    Outcome outcome;
    const double begin = cpu_seconds();
    for (Yardstick<S>& yardstick : yardsticks) {
      yardstick.run(steps, scene.duration);
      settle(&yardstick);
    }
    outcome.cpu = (cpu_seconds() - begin) / double(yardsticks.size());
    outcome.positions = yardsticks[0].positions();
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
