// Signed distances to the built-in shapes.
#include <hooke/shapes.hpp>

#include "core/problems.hpp"

#include <Eigen/Geometry>

namespace hooke::test {
namespace {

// By brute force: how far a point is from the nearest of many points of a box's surface.
double distance_by_search(const Box& box, const Vec3& point) {
  constexpr int n = 60;
  double nearest = 1e300;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        Vec3 local;
        local[face / 2] = face % 2 ? 1 : -1;
        local[(face / 2 + 1) % 3] = 2.0 * i / n - 1;
        local[(face / 2 + 2) % 3] = 2.0 * j / n - 1;
        const Vec3 x = box.center + box.axes * local.cwiseProduct(box.half_extent);
        nearest = std::min(nearest, (x - point).norm());
      }
  const Vec3 local = (box.axes.transpose() * (point - box.center)).cwiseAbs();
  return (local.array() < box.half_extent.array()).all() ? -nearest : nearest;
}

TEST(Box, DistanceIsThatToTheNearestPointOfItsSurface) {
  Random random;
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    Box box;
    box.center = random.vector(1);
    box.half_extent = {random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.1, 1)};
    box.axes = Eigen::AngleAxisd(random.uniform(0, 3), random.vector(1).normalized()).toRotationMatrix();
    const Vec3 point = random.vector(2);
    // Points of the surface are at most 1/60 of two metres apart.
    EXPECT_NEAR(signed_distance(box, point), distance_by_search(box, point), 0.024) << "box " << i;
    EXPECT_LE(signed_distance(box, point),
              distance_by_search(box, point) + (signed_distance(box, point) < 0 ? 0.024 : 1e-12));
  }
}

TEST(Box, DistanceByFaceEdgeAndCorner) {
  const Box box{{1, 2, 3}, {0.5, 1, 1.5}, Mat3::Identity()};
  EXPECT_DOUBLE_EQ(signed_distance(box, Vec3(1, 5, 3)), 2);                    // over a face
  EXPECT_DOUBLE_EQ(signed_distance(box, Vec3(1 + 0.5 + 3, 2 + 1 + 4, 3)), 5);  // off an edge
  EXPECT_DOUBLE_EQ(signed_distance(box, Vec3(1 + 0.5 + 1, 2 + 1 + 2, 3 - 1.5 - 2)), 3);
  EXPECT_DOUBLE_EQ(signed_distance(box, Vec3(1, 2, 3)), -0.5);
  EXPECT_DOUBLE_EQ(signed_distance(box, Vec3(1.5, 2.5, 3)), 0);
}

TEST(LevelSet, DistanceMovesWithItsOffset) {
  const auto grid = std::make_shared<const DistanceGrid>(Vec3(0, 0, 0), 1.0, std::array{2, 2, 2},
                                                         std::vector<float>{0, 1, 0, 1, 0, 1, 0, 1});
  EXPECT_DOUBLE_EQ(signed_distance(Shape(LevelSet{grid, {10, 0, 0}}), Vec3(10.25, 0.5, 0.5)), 0.25);
}

}  // namespace
}  // namespace hooke::test
