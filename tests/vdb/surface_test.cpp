// The surface of particles: where it is, that it is closed, and that threads do not change it.
#include <hooke/shapes.hpp>
#include <hooke/vdb/surface.hpp>

#include <vdb/closed_mesh.hpp>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <random>

namespace {

using namespace hooke;

Points<double> cloud(Index n, double size) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> at(-size, size);
  Points<double> x(n, 3);
  for (Index i = 0; i < n; ++i) x.row(i) << at(engine), at(engine), at(engine);
  return x;
}

TEST(SurfaceFromParticles, OfOneIsItsBall) {
  Points<double> x(1, 3);
  x << 1.03, 2.01, -0.52;
  const TriangleMesh mesh = vdb::surface_from_particles(x, Values<double>::Constant(1, 0.2), 0.02, 0);
  EXPECT_EQ(test::open_edges(mesh.triangles), 0);
  EXPECT_NEAR(test::volume(mesh.vertices, mesh.triangles), 4 * std::numbers::pi / 3 * 0.008, 0.02 * 0.0335);
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    EXPECT_NEAR((mesh.vertices.row(v) - x.row(0)).matrix().norm(), 0.2, 0.1 * 0.02);
}

TEST(SurfaceFromParticles, IsThatOfTheUnionOfBalls) {
  const Points<double> x = cloud(200, 0.3);
  Values<double> radii(200);
  for (Index i = 0; i < 200; ++i) radii[i] = 0.05 + 0.0002 * double(i);
  const double voxel = 0.015;
  const TriangleMesh mesh = vdb::surface_from_particles(x, radii, voxel, 0);
  EXPECT_EQ(test::open_edges(mesh.triangles), 0);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    double distance = 1e300;
    for (Index i = 0; i < 200; ++i)
      distance = std::min(distance, (mesh.vertices.row(v) - x.row(i)).matrix().norm() - radii[i]);
    EXPECT_NEAR(distance, 0, voxel);
  }
}

TEST(SurfaceFromParticles, SmoothingFillsCreasesAndKeepsTheSize) {
  const Points<double> x = cloud(400, 0.2);
  const Values<double> radii = Values<double>::Constant(400, 0.05);
  const auto roughness = [&](int rounds) {
    const TriangleMesh mesh = vdb::surface_from_particles(x, radii, 0.0125, rounds);
    EXPECT_EQ(test::open_edges(mesh.triangles), 0);
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 a = mesh.vertices.row(t[0]).matrix(), b = mesh.vertices.row(t[1]).matrix(),
                 c = mesh.vertices.row(t[2]).matrix();
      area += (b - a).cross(c - a).norm() / 2;
    }
    const double volume = test::volume(mesh.vertices, mesh.triangles);
    return std::pair(area / std::pow(volume, 2.0 / 3), volume);
  };
  const auto rough = roughness(0), smooth = roughness(4);
  EXPECT_LT(smooth.first, rough.first);
  EXPECT_NEAR(smooth.second, rough.second, 0.1 * rough.second);
}

TEST(SurfaceFromParticles, IsTheSameForAnyNumberOfThreads) {
  const Points<double> x = cloud(3000, 0.4);
  const Values<double> radii = Values<double>::Constant(3000, 0.03);
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return vdb::surface_from_particles(x, radii, 0.012, 2);
  };
  const TriangleMesh one = with_threads(1), four = with_threads(4);
  EXPECT_EQ(one.triangles, four.triangles);
  ASSERT_EQ(one.vertices.rows(), four.vertices.rows());
  EXPECT_TRUE((one.vertices == four.vertices).all());
}

TEST(SurfaceFromParticles, OfNoneIsEmptyAndNonsenseIsRefused) {
  EXPECT_TRUE(vdb::surface_from_particles(Points<double>(0, 3), Values<double>(0), 0.1).triangles.empty());
  const Points<double> x = cloud(2, 1);
  EXPECT_THROW(vdb::surface_from_particles(x, Values<double>::Ones(3), 0.1), std::invalid_argument);
  EXPECT_THROW(vdb::surface_from_particles(x, Values<double>::Zero(2), 0.1), std::invalid_argument);
  EXPECT_THROW(vdb::surface_from_particles(x, Values<double>::Ones(2), 0), std::invalid_argument);
  EXPECT_THROW(vdb::surface_from_particles(x, Values<double>::Ones(2), 0.1, -1), std::invalid_argument);
  Points<double> broken = x;
  broken(1, 2) = std::nan("");
  EXPECT_THROW(vdb::surface_from_particles(broken, Values<double>::Ones(2), 0.1), std::invalid_argument);
}

}  // namespace
