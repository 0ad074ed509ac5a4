// The built-in solid shapes: what they are and how far a point is from them. How points
// bounce off them is in contact.hpp.
#pragma once

#include <hooke/distance_grid.hpp>
#include <hooke/types.hpp>

#include <memory>
#include <variant>

namespace hooke {

/// All points x with normal · x <= offset are solid.
struct HalfSpace {
  Vec3 normal{0, 1, 0};  ///< unit, points out of the solid
  double offset = 0;     ///< [m]
};

struct Sphere {
  Vec3 center{0, 0, 0};  ///< [m]
  double radius = 1;     ///< [m], > 0
};

/// All points within `radius` of the segment from a to b.
struct Capsule {
  Vec3 a{0, 0, 0};    ///< [m]
  Vec3 b{0, 1, 0};    ///< [m]; a == b is a sphere
  double radius = 1;  ///< [m], > 0
};

/// A box, turned by the columns of `axes`.
struct Box {
  Vec3 center{0, 0, 0};             ///< [m]
  Vec3 half_extent{0.5, 0.5, 0.5};  ///< [m], > 0, along its own axes
  Mat3 axes = Mat3::Identity();     ///< columns: the box's own axes in the world, orthonormal
};

/// A solid of any form, known by its sampled distance. Many colliders may share one grid.
struct LevelSet {
  std::shared_ptr<const DistanceGrid> grid;  ///< not null
  Vec3 offset{0, 0, 0};                      ///< where the grid's zero is in the world [m]
};

using Shape = std::variant<HalfSpace, Sphere, Capsule, Box, LevelSet>;

/// Signed distance from a point to a shape's surface [m], negative inside.
double signed_distance(const HalfSpace& shape, const Vec3& point);
double signed_distance(const Sphere& shape, const Vec3& point);
double signed_distance(const Capsule& shape, const Vec3& point);
double signed_distance(const Box& shape, const Vec3& point);
double signed_distance(const LevelSet& shape, const Vec3& point);
double signed_distance(const Shape& shape, const Vec3& point);

/// The point of the segment from a to b that is nearest to `point`.
Vec3 nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& point);

}  // namespace hooke
