// Closed meshes as distances: true near the surface and far from it, and what is refused.
#include <hooke/shapes.hpp>
#include <hooke/vdb/capsule_skin.hpp>
#include <hooke/vdb/mesh_level_set.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace {

using namespace hooke;
using ::testing::HasSubstr;

TriangleMesh box_mesh(const Box& box) {
  TriangleMesh mesh;
  mesh.vertices.resize(8, 3);
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    mesh.vertices.row(i) = (box.center + box.axes * corner.cwiseProduct(box.half_extent)).transpose().array();
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

std::string refusal(const TriangleMesh& mesh, double voxel) {
  try {
    vdb::level_set_from_mesh(mesh, voxel);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing refused";
}

// Largest error of distances inside and around a box, near its surface and anywhere.
struct Errors {
  double near = 0, far = 0;
};
Errors errors(const DistanceGrid& grid, const Box& box) {
  std::mt19937 engine(7);
  Errors out;
  for (int i = 0; i < 20000; ++i) {
    Vec3 x;
    for (int k = 0; k < 3; ++k) x[k] = std::uniform_real_distribution(grid.lower()[k], grid.upper()[k])(engine);
    const double exact = signed_distance(box, x), error = std::abs(grid.distance(x) - exact);
    (std::abs(exact) < 2 * grid.voxel() ? out.near : out.far) =
        std::max(std::abs(exact) < 2 * grid.voxel() ? out.near : out.far, error);
  }
  return out;
}

TEST(LevelSetFromMesh, OfABoxIsTheBoxToAVoxelInsideAndOutside) {
  const Box box{{10, -3, 0.5}, {0.5, 0.3, 0.4}, Mat3::Identity()};
  for (const double voxel : {0.05, 0.02}) {
    SCOPED_TRACE(voxel);
    const auto grid = vdb::level_set_from_mesh(box_mesh(box), voxel);
    EXPECT_EQ(grid->voxel(), voxel);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(grid->lower()[k], box.center[k] - box.half_extent[k] - 4 * voxel + 1e-6);
      EXPECT_GE(grid->upper()[k], box.center[k] + box.half_extent[k] + 4 * voxel - 1e-6);
    }
    const Errors found = errors(*grid, box);
    EXPECT_LT(found.near, 0.6 * voxel);  // at corners, where the distance is not linear in a voxel
    EXPECT_LT(found.far, 0.6 * voxel);
    // On a face it is the distance itself.
    EXPECT_NEAR(grid->distance(box.center + Vec3(0, 0.3, 0)), 0, 1e-5);
    EXPECT_NEAR(grid->distance(box.center + Vec3(0.1, 0.05, 0.1)), -0.25, 0.5 * voxel);
  }
}

TEST(LevelSetFromMesh, OfABallIsTheBall) {
  const std::vector<Capsule> ball{{Vec3(0, 1, 0), Vec3(0, 1, 0), 0.4}};
  const auto grid = vdb::level_set_from_mesh(vdb::skin_capsules(ball, 0.01, 0), 0.02);
  for (double r = 0.1; r < 0.45; r += 0.05) {
    const Vec3 x = Vec3(0, 1, 0) + r * Vec3(1, 2, -2) / 3;
    EXPECT_NEAR(grid->distance(x), r - 0.4, 0.01) << r;
    EXPECT_LT((grid->normal(x) - Vec3(1, 2, -2) / 3).norm(), 0.1) << r;
  }
}

TEST(LevelSetFromMesh, DoesNotMindSeamsNorTheSenseOfTriangles) {
  const Box box{{0, 0, 0}, {0.5, 0.3, 0.4}, Mat3::Identity()};
  const TriangleMesh whole = box_mesh(box);
  TriangleMesh seams;  // each triangle with vertices of its own, every second turned over
  seams.vertices.resize(Index(3 * whole.triangles.size()), 3);
  for (int t = 0; t < int(whole.triangles.size()); ++t) {
    for (int k = 0; k < 3; ++k)
      seams.vertices.row(3 * t + k) = whole.vertices.row(whole.triangles[std::size_t(t)][std::size_t(k)]);
    seams.triangles.push_back(t % 2 ? Triangle{3 * t, 3 * t + 1, 3 * t + 2} : Triangle{3 * t + 1, 3 * t, 3 * t + 2});
  }
  EXPECT_EQ(vdb::level_set_from_mesh(seams, 0.05)->values(), vdb::level_set_from_mesh(whole, 0.05)->values());
}

TEST(LevelSetFromMesh, RefusesWhatIsNoSolid) {
  const TriangleMesh box = box_mesh({{0, 0, 0}, {0.5, 0.3, 0.4}, Mat3::Identity()});
  EXPECT_THAT(refusal({}, 0.1), HasSubstr("no triangles"));
  EXPECT_THAT(refusal(box, 0), HasSubstr("voxel must be positive"));
  EXPECT_THAT(refusal(box, 1e-4), HasSubstr("at most 2^28 voxels"));
  EXPECT_THAT(refusal(box, 1e-300), HasSubstr("at most 2^28 voxels"));
  TriangleMesh open = box;
  open.triangles.pop_back();
  EXPECT_THAT(refusal(open, 0.05), HasSubstr("must be closed, got 3 open edges"));
  TriangleMesh broken = box;
  broken.vertices(5, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(broken, 0.05), HasSubstr("vertex 5 is not finite"));
  broken = box;
  broken.triangles[3][2] = 8;
  EXPECT_THAT(refusal(broken, 0.05), HasSubstr("vertex 8 is not below the count 8"));
  EXPECT_THAT(refusal(box_mesh({{0.5, 0.503, 0.5}, {2, 0.001, 2}, Mat3::Identity()}), 0.25),
              HasSubstr("nothing inside"));
}

}  // namespace
