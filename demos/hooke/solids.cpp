#include "solids.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace hooke::command {

namespace {

constexpr int kAround = 48, kRings = 12;  // rings of half a sphere

// A surface of revolution about the way from a to b: circles of `radius[i]` at height[i] along
// it, from pole to pole, with a and b as the centres of the half spheres.
void append_capsule(const Vec3& a, const Vec3& b, double r, int around, int rings, TriangleMesh& mesh) {
  const Vec3 way = b - a;
  const Vec3 axis = way.norm() > 0 ? Vec3(way.normalized()) : Vec3(0, 1, 0);
  const Vec3 u = axis.unitOrthogonal(), w = axis.cross(u);
  const int first = int(mesh.vertices.rows()), circles = 2 * rings;
  mesh.vertices.conservativeResize(first + 2 + circles * around, 3);
  const auto put = [&](int i, const Vec3& x) { mesh.vertices.row(first + i) = x.transpose().array(); };
  put(0, a - r * axis);
  put(1, b + r * axis);
  // A sphere's two middle circles coincide; its half spheres then share none, so they are set apart.
  const bool sphere = way.norm() == 0;
  for (int i = 0; i < circles; ++i) {
    const bool upper = i >= rings;
    const double step = sphere ? std::numbers::pi / (circles + 1) : std::numbers::pi / (2 * rings);
    const double angle = sphere  ? -std::numbers::pi / 2 + (i + 1) * step
                         : upper ? (i - rings) * step
                                 : -std::numbers::pi / 2 + (i + 1) * step;
    const Vec3 center = (upper ? b : a) + r * std::sin(angle) * axis;
    for (int j = 0; j < around; ++j) {
      const double turn = 2 * std::numbers::pi * j / around;
      put(2 + i * around + j, center + r * std::cos(angle) * (std::cos(turn) * u + std::sin(turn) * w));
    }
  }
  const auto at = [&](int circle, int j) { return first + 2 + circle * around + j % around; };
  for (int j = 0; j < around; ++j) {
    mesh.triangles.push_back({first, at(0, j + 1), at(0, j)});
    mesh.triangles.push_back({first + 1, at(circles - 1, j), at(circles - 1, j + 1)});
    for (int i = 0; i + 1 < circles; ++i) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      mesh.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  }
}

}  // namespace

void append_shape(const Shape& shape, TriangleMesh& mesh) {
  if (const auto* sphere = std::get_if<Sphere>(&shape))
    append_capsule(sphere->center, sphere->center, sphere->radius, 2 * kAround, 2 * kRings, mesh);
  if (const auto* capsule = std::get_if<Capsule>(&shape))
    append_capsule(capsule->a, capsule->b, capsule->radius, kAround, kRings, mesh);
}

void append_sticks(const Points<double>& points, const std::vector<std::pair<int, int>>& springs, double radius,
                   TriangleMesh& mesh) {
  const auto at = [&](int i) -> Vec3 { return points.row(i).matrix().transpose(); };
  for (int i = 0; i < int(points.rows()); ++i) append_capsule(at(i), at(i), 2 * radius, 12, 3, mesh);
  for (const auto& [a, b] : springs) append_capsule(at(a), at(b), radius, 8, 1, mesh);
}

}  // namespace hooke::command
