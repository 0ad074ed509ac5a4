#include <render/camera.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace hooke::render {

namespace {

void require(bool holds, const std::string& rule) {
  if (!holds) throw std::invalid_argument("frame_subject: " + rule);
}

}  // namespace

Camera frame_subject(const Vec3& lower, const Vec3& upper, const Vec3& view_direction, double vertical_fov_degrees,
                     double aspect, double margin) {
  require(lower.allFinite() && upper.allFinite() && (lower.array() <= upper.array()).all(),
          "the box must be finite, with lower <= upper");
  require(vertical_fov_degrees > 0 && vertical_fov_degrees < 180,
          "the field of view must be in (0, 180) degrees, got " + std::to_string(vertical_fov_degrees));
  require(aspect > 0 && std::isfinite(aspect), "aspect must be positive, got " + std::to_string(aspect));
  require(margin >= 0 && margin < 0.5, "margin must be in [0, 0.5), got " + std::to_string(margin));
  const Vec3 world_up(0, 1, 0);
  require(view_direction.allFinite() && view_direction.cross(world_up).norm() > 1e-6 * view_direction.norm(),
          "the view direction must be finite, not zero and not vertical");

  const Vec3 forward = view_direction.normalized();
  const Vec3 right = forward.cross(world_up).normalized();
  const Vec3 up = right.cross(forward);
  const double tan_v = std::tan(vertical_fov_degrees * std::numbers::pi / 360) * (1 - 2 * margin);
  const double tan_h = tan_v * aspect;

  // A corner at offset c from the middle is inside when |c·right| <= tan_h (distance + c·forward).
  const Vec3 middle = 0.5 * (lower + upper);
  double distance = 0.1;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 c = Vec3(corner & 1 ? upper.x() : lower.x(), corner & 2 ? upper.y() : lower.y(),
                        corner & 4 ? upper.z() : lower.z()) -
                   middle;
    const double depth = c.dot(forward);
    distance =
        std::max({distance, std::abs(c.dot(right)) / tan_h - depth, std::abs(c.dot(up)) / tan_v - depth, 0.01 - depth});
  }
  return {middle - distance * forward, middle, world_up, vertical_fov_degrees};
}

}  // namespace hooke::render
