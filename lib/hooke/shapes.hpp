// The built-in solid shapes: what they are and how far a point is from them. How points
// bounce off them is in contact.hpp.
#pragma once

#include <hooke/types.hpp>

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

using Shape = std::variant<HalfSpace, Sphere, Capsule>;

/// Signed distance from a point to a shape's surface [m], negative inside.
double signed_distance(const HalfSpace& shape, const Vec3& point);
double signed_distance(const Sphere& shape, const Vec3& point);
double signed_distance(const Capsule& shape, const Vec3& point);
double signed_distance(const Shape& shape, const Vec3& point);

/// The point of the segment from a to b that is nearest to `point`.
Vec3 nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& point);

}  // namespace hooke
