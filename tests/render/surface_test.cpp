#include <render/surface.hpp>

#include "figures.hpp"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

namespace hooke::render {
namespace {

Vec3 vec(const float* v) { return Vec3(v[0], v[1], v[2]); }

TEST(Surface, ClothWithThicknessIsClosedAndTurnsOutwards) {
  const figures::Cape cape = figures::cape(12, 10);
  Surface surface(Model{.mesh = &cape.mesh, .thickness = 0.01, .subdivisions = 1});
  surface.update(cape.mesh.vertices);
  // The hem's inner edge is the inner sheet's border with another colour: join them.
  std::map<std::array<float, 3>, int> place;
  std::map<std::pair<int, int>, int> directed;
  const auto id = [&](std::uint32_t i) {
    const float* p = surface.vertices()[i].position;
    return place.try_emplace({p[0], p[1], p[2]}, static_cast<int>(place.size())).first->second;
  };
  for (std::size_t i = 0; i < surface.all().count; i += 3)
    for (std::size_t k = 0; k < 3; ++k)
      ++directed[{id(surface.indices()[i + k]), id(surface.indices()[i + (k + 1) % 3])}];
  for (const auto& [edge, count] : directed) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(directed.count({edge.second, edge.first}), 1u) << "a hole";
  }
}

TEST(Surface, SubdividingASphereRoundsItAndKeepsGivenVertices) {
  TriangleMesh ball;
  figures::append_capsule(ball, {0, 1, 0}, {0, 1, 0}, 0.5, 0.5, 12);
  const auto worst_midpoint = [&ball](int subdivisions) {
    Surface surface(Model{.mesh = &ball, .subdivisions = subdivisions});
    surface.update(ball.vertices);
    for (Index i = 0; i < ball.vertices.rows(); ++i)
      EXPECT_LT(
          (vec(surface.vertices()[static_cast<std::size_t>(i)].position) - ball.vertices.row(i).matrix().transpose())
              .norm(),
          1e-6);
    double worst = 0;
    for (std::size_t i = 0; i < surface.all().count; i += 3)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 a = vec(surface.vertices()[surface.indices()[i + k]].position);
        const Vec3 b = vec(surface.vertices()[surface.indices()[i + (k + 1) % 3]].position);
        worst = std::max(worst, std::abs((0.5 * (a + b) - Vec3(0, 1, 0)).norm() - 0.5));
      }
    return worst;
  };
  EXPECT_LT(worst_midpoint(1), 0.4 * worst_midpoint(0));
}

TEST(Surface, NormalsOfASphereArePointsOfIt) {
  TriangleMesh ball;
  figures::append_capsule(ball, {0, 1, 0}, {0, 1, 0}, 0.5, 0.5, 48);
  Surface surface(Model{.mesh = &ball});
  surface.update(ball.vertices);
  for (const SurfaceVertex& vertex : surface.vertices()) {
    const Vec3 out = (vec(vertex.position) - Vec3(0, 1, 0)).normalized();
    if (std::abs(out.y()) < 0.99) {  // the poles are fans of slivers
      EXPECT_GT(vec(vertex.normal).dot(out), 0.995);
    }
  }
}

TEST(Surface, CoarseFormHasFewTrianglesAndStaysWithinTheMesh) {
  const TriangleMesh man = figures::mannequin(64);
  Surface surface(Model{.mesh = &man});
  EXPECT_LT(surface.coarse().count, 3 * man.triangles.size() / 4);
  EXPECT_GT(surface.coarse().count, 3000u);
  for (std::size_t i = 0; i < surface.coarse().count; ++i)
    ASSERT_LT(surface.indices()[surface.coarse().first + i], static_cast<std::uint32_t>(man.vertices.rows()));
}

TEST(Surface, RefusesIndicesAndUvThatDoNotFit) {
  TriangleMesh mesh;
  mesh.vertices.setZero(3, 3);
  mesh.triangles = {{0, 1, 3}};
  EXPECT_THROW(Surface(Model{.mesh = &mesh}), std::invalid_argument);
  mesh.triangles = {{0, 1, 2}};
  const TextureCoordinates uv = TextureCoordinates::Zero(2, 2);
  EXPECT_THROW(Surface(Model{.mesh = &mesh, .uv = &uv}), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::render
