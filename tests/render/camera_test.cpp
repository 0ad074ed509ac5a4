#include <render/camera.hpp>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace hooke::render {
namespace {

// The largest |coordinate| of the box's corners in the picture, where 1 is its edge.
double reach_in_picture(const Camera& camera, const Vec3& lower, const Vec3& upper, double aspect) {
  const Vec3 forward = (camera.target - camera.eye).normalized();
  const Vec3 right = forward.cross(camera.up).normalized(), up = right.cross(forward);
  const double tan_v = std::tan(camera.vertical_fov_degrees * std::numbers::pi / 360);
  double reach = 0;
  for (int k = 0; k < 8; ++k) {
    const Vec3 corner(k & 1 ? upper.x() : lower.x(), k & 2 ? upper.y() : lower.y(), k & 4 ? upper.z() : lower.z());
    const Vec3 from_eye = corner - camera.eye;
    const double depth = from_eye.dot(forward);
    EXPECT_GT(depth, 0);
    reach = std::max({reach, std::abs(from_eye.dot(right)) / (depth * tan_v * aspect),
                      std::abs(from_eye.dot(up)) / (depth * tan_v)});
  }
  return reach;
}

TEST(FrameSubject, FillsThePictureUpToTheMarginFromEveryDirection) {
  const Vec3 lower(-0.6, 0, -0.7), upper(0.5, 1.8, 0.4);
  for (const double aspect : {16.0 / 9, 1.0, 0.5})
    for (const double fov : {12.0, 30.0, 75.0})
      for (const Vec3& direction : {Vec3(0, 0, -1), Vec3(1, -0.3, 0.2), Vec3(-3, -4, 2), Vec3(0.2, 0.5, 1)}) {
        const Camera camera = frame_subject(lower, upper, direction, fov, aspect, 0.1);
        EXPECT_NEAR(reach_in_picture(camera, lower, upper, aspect), 0.8, 1e-9);
        EXPECT_LT((camera.target - camera.eye).cross(direction).norm(), 1e-9 * direction.norm() * 100);
      }
}

TEST(FrameSubject, RefusesWhatCannotBeFramed) {
  const Vec3 low(0, 0, 0), high(1, 1, 1), sight(0, 0, -1);
  EXPECT_THROW(frame_subject(high, low, sight, 30, 1), std::invalid_argument);
  EXPECT_THROW(frame_subject(low, high, {0, -1, 0}, 30, 1), std::invalid_argument);
  EXPECT_THROW(frame_subject(low, high, sight, 0, 1), std::invalid_argument);
  EXPECT_THROW(frame_subject(low, high, sight, 30, 1, 0.5), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::render
