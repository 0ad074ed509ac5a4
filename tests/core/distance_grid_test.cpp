// Distances sampled on a grid: interpolation, normals, what lies outside, what is refused.
#include <hooke/distance_grid.hpp>

#include "core/problems.hpp"

#include <limits>

namespace hooke::test {
namespace {

template <class Distance>
DistanceGrid sampled(const Vec3& lower, double voxel, const std::array<int, 3>& counts, const Distance& distance) {
  std::vector<float> values;
  for (int z = 0; z < counts[2]; ++z)
    for (int y = 0; y < counts[1]; ++y)
      for (int x = 0; x < counts[0]; ++x) values.push_back(float(distance(lower + voxel * Vec3(x, y, z))));
  return DistanceGrid(lower, voxel, counts, std::move(values));
}

TEST(DistanceGrid, IsExactForAPlane) {
  Random random;
  SCOPED_TRACE(random.trace());
  const Vec3 normal = Vec3(1, 2, -2) / 3;
  const auto plane = [&](const Vec3& x) { return normal.dot(x) - 0.1; };
  const DistanceGrid grid = sampled({-1, -2, 0}, 0.25, {9, 13, 5}, plane);
  EXPECT_EQ(grid.upper(), Vec3(1, 1, 1));
  for (int i = 0; i < 100; ++i) {
    const Vec3 x(random.uniform(-0.8, 0.8), random.uniform(-1.8, 0.8), random.uniform(0.2, 0.8));
    EXPECT_NEAR(grid.distance(x), plane(x), 1e-6);
    EXPECT_LT((grid.normal(x) - normal).norm(), 1e-5);
    EXPECT_EQ(grid.away(x), 0);
  }
}

TEST(DistanceGrid, OfABallConvergesWithTheSquareOfTheVoxel) {
  Random random;
  SCOPED_TRACE(random.trace());
  const auto ball = [](const Vec3& x) { return x.norm() - 0.5; };
  std::vector<Vec3> places;
  for (int i = 0; i < 500; ++i) places.push_back(random.uniform(0.4, 0.6) * random.vector(1).normalized());
  double before = 0;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const int n = int(std::lround(1.6 / voxel)) + 1;
    const DistanceGrid grid = sampled(Vec3::Constant(-0.8), voxel, {n, n, n}, ball);
    double worst = 0;
    for (const Vec3& x : places) {
      worst = std::max(worst, std::abs(grid.distance(x) - ball(x)));
      EXPECT_LT((grid.normal(x) - x.normalized()).norm(), 0.6 * voxel * voxel / 0.16 + 1e-4);
    }
    if (before > 0) {
      EXPECT_NEAR(before / worst, 4, 1.2);
    }
    before = worst;
  }
}

TEST(DistanceGrid, OutsideIsNeverLessThanTheDistance) {
  Random random;
  SCOPED_TRACE(random.trace());
  const auto ball = [](const Vec3& x) { return x.norm() - 0.5; };
  const DistanceGrid grid = sampled(Vec3::Constant(-0.7), 0.02, {71, 71, 71}, ball);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = random.vector(4);
    const Vec3 inside = x.cwiseMax(grid.lower()).cwiseMin(grid.upper());
    EXPECT_NEAR(grid.away(x), (x - inside).norm(), 1e-12);
    EXPECT_GE(grid.distance(x), ball(x) - 1e-3);
    EXPECT_LE(grid.distance(x), ball(x) + 2 * grid.away(x) + 1e-3);
  }
  EXPECT_NEAR(grid.distance({3, 0, 0}), 2.5, 1e-3);
  EXPECT_NEAR(grid.normal({3, 0, 0}).x(), 1, 1e-6);
}

TEST(DistanceGrid, RefusesWhatDoesNotFit) {
  const std::vector<float> eight(8, 0);
  EXPECT_NO_THROW(DistanceGrid({0, 0, 0}, 1, {2, 2, 2}, eight));
  EXPECT_THROW(DistanceGrid({0, 0, 0}, 1, {2, 2, 3}, eight), std::invalid_argument);
  EXPECT_THROW(DistanceGrid({0, 0, 0}, 1, {1, 2, 4}, eight), std::invalid_argument);
  EXPECT_THROW(DistanceGrid({0, 0, 0}, 0, {2, 2, 2}, eight), std::invalid_argument);
  EXPECT_THROW(DistanceGrid({0, std::numeric_limits<double>::infinity(), 0}, 1, {2, 2, 2}, eight),
               std::invalid_argument);
  std::vector<float> broken = eight;
  broken[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(DistanceGrid({0, 0, 0}, 1, {2, 2, 2}, broken), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::test
