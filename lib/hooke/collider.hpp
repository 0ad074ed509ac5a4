// Solids that act on bodies and are not acted upon: floors, walls, limbs. What happens at a
// contact is in contacts.hpp.
#pragma once

#include <hooke/shapes.hpp>

#include <functional>
#include <span>
#include <string>

namespace hooke {

/// Signed distances [m] and outward unit normals of many points (n, 3) at time t, in world
/// coordinates, in one call: the way to collide with the solids of somebody else's engine.
using DistanceCallback =
    std::function<void(double t, const Points<double>& x, Values<double>& distance, Points<double>& normal)>;

/// A prescribed solid, static or driven by time. It pushes bodies and is never pushed.
struct Collider {
  std::string name;
  std::vector<Shape> shapes;  ///< world coordinates; where `motion` is set, only their number and kinds count
  /// Writes the shapes at time t. Called at substeps, with times of any order; the same t must give
  /// the same shapes. Empty: the collider stands still.
  std::function<void(double t, std::span<Shape> shapes)> motion;
  DistanceCallback distance;  ///< instead of shapes; called once a substep with all points of a body
  double friction = 0.3;      ///< Coulomb's coefficient, >= 0
  double restitution = 0;     ///< 0 = stays, 1 = bounces without loss
};

}  // namespace hooke
