// What Hooke is measured against in the same run.
#pragma once

#include "measure.hpp"

#include <optional>

namespace hooke::report {

/// A scene of undamped springs and gravity alone, in plain arrays.
struct PlainSprings {
  Points<double> positions, velocities;
  Values<double> masses;
  std::vector<bool> held;
  std::vector<softbody::Spring> springs;
  std::vector<double> rest;  ///< [m]
  Vec3 gravity{0, 0, 0};
  double duration = 0;
  double stable_step = 0;           ///< of velocity Verlet [s]
  std::vector<Triangle> triangles;  ///< of the sheet; empty for others
};

/// That form of a scene, where it has one.
std::optional<PlainSprings> plain_springs(const scene::StandardScene& scene);

/// What a competent programmer writes in an hour: velocity Verlet over a list of springs.
std::vector<Series> yardstick(const PlainSprings& scene);

/// Bullet's classic soft body with its own settings, at several iteration counts; none where Hooke
/// was built without Bullet.
std::vector<Series> bullet_classic(const PlainSprings& scene);
/// Its version, empty without.
std::string bullet_version();

}  // namespace hooke::report
