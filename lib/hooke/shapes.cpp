#include <hooke/shapes.hpp>

#include <algorithm>

namespace hooke {

Vec3 nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& point) {
  const Vec3 axis = b - a;
  const double length2 = axis.squaredNorm();
  if (length2 == 0) return a;
  return a + std::clamp((point - a).dot(axis) / length2, 0.0, 1.0) * axis;
}

double signed_distance(const HalfSpace& shape, const Vec3& point) { return shape.normal.dot(point) - shape.offset; }

double signed_distance(const Sphere& shape, const Vec3& point) { return (point - shape.center).norm() - shape.radius; }

double signed_distance(const Capsule& shape, const Vec3& point) {
  return (point - nearest_on_segment(shape.a, shape.b, point)).norm() - shape.radius;
}

double signed_distance(const Box& shape, const Vec3& point) {
  const Vec3 outside = (shape.axes.transpose() * (point - shape.center)).cwiseAbs() - shape.half_extent;
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

double signed_distance(const LevelSet& shape, const Vec3& point) { return shape.grid->distance(point - shape.offset); }

double signed_distance(const Shape& shape, const Vec3& point) {
  return std::visit([&](const auto& s) { return signed_distance(s, point); }, shape);
}

}  // namespace hooke
