#include "solids.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

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

// Each face a lattice, fine where it bends. What faces share is one vertex, for smooth normals.
void append_box(const Box& box, TriangleMesh& mesh) {
  constexpr int kBend = 4, kLines = 2 * (kBend + 1);
  const Vec3& half = box.half_extent;
  const double r = std::min(0.1 * half.minCoeff(), 0.01);
  std::map<std::array<double, 3>, int> seen;
  std::vector<Vec3> corners;
  const int first = int(mesh.vertices.rows());
  const auto vertex = [&](int axis, int side, int i, int j) {
    const auto line = [&](int k, int at) {
      return at <= kBend ? -half[k] + r * at / kBend : half[k] - r * (kLines - 1 - at) / kBend;
    };
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    Vec3 x;
    x[axis] = side * half[axis];
    x[u] = line(u, i);
    x[w] = line(w, j);
    const auto [found, is_new] = seen.try_emplace({x[0], x[1], x[2]}, first + int(corners.size()));
    if (is_new) {
      const Vec3 inner = x.cwiseMax((r - half.array()).matrix()).cwiseMin((half.array() - r).matrix());
      corners.push_back(box.center + box.axes * (inner + r * (x - inner).normalized()));
    }
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1})
      for (int i = 0; i + 1 < kLines; ++i)
        for (int j = 0; j + 1 < kLines; ++j) {
          const int a = vertex(axis, side, i, j), b = vertex(axis, side, i + 1, j);
          const int c = vertex(axis, side, i + 1, j + 1), d = vertex(axis, side, i, j + 1);
          if (side > 0) {
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
          } else {
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({a, d, c});
          }
        }
  mesh.vertices.conservativeResize(first + Index(corners.size()), 3);
  for (std::size_t i = 0; i < corners.size(); ++i) mesh.vertices.row(first + Index(i)) = corners[i].transpose().array();
}

}  // namespace

TriangleMesh with_creases(const TriangleMesh& mesh, double angle) {
  const std::size_t corner_count = 3 * mesh.triangles.size();
  std::vector<Vec3> normals;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices.row(t[0]).matrix(), b = mesh.vertices.row(t[1]).matrix(),
               c = mesh.vertices.row(t[2]).matrix();
    normals.push_back((b - a).cross(c - a).normalized());
  }
  // Corners of triangles that share a vertex are one as long as they are joined by smooth edges.
  std::vector<std::size_t> leader(corner_count);
  std::iota(leader.begin(), leader.end(), 0);
  const auto find = [&](std::size_t corner) {
    while (leader[corner] != corner) corner = leader[corner] = leader[leader[corner]];
    return corner;
  };
  std::map<std::pair<int, int>, std::size_t> open;  // an edge → the triangle's corner where it begins
  for (std::size_t corner = 0; corner < corner_count; ++corner) {
    const std::size_t triangle = corner / 3, next = 3 * triangle + (corner + 1) % 3;
    const int from = mesh.triangles[triangle][corner % 3], to = mesh.triangles[triangle][(corner + 1) % 3];
    const auto [other, is_new] = open.try_emplace(std::minmax(from, to), corner);
    if (is_new) continue;
    const std::size_t start = other->second, neighbour = start / 3, end = 3 * neighbour + (start + 1) % 3;
    if (normals[triangle].dot(normals[neighbour]) < std::cos(angle)) continue;
    const bool same_sense = mesh.triangles[neighbour][start % 3] == from;
    leader[find(corner)] = find(same_sense ? start : end);
    leader[find(next)] = find(same_sense ? end : start);
  }
  TriangleMesh out;
  out.triangles.resize(mesh.triangles.size());
  std::vector<int> number(corner_count, -1);
  std::vector<int> source;
  for (std::size_t corner = 0; corner < corner_count; ++corner) {
    int& vertex = number[find(corner)];
    if (vertex < 0) {
      vertex = int(source.size());
      source.push_back(mesh.triangles[corner / 3][corner % 3]);
    }
    out.triangles[corner / 3][corner % 3] = vertex;
  }
  out.vertices.resize(Index(source.size()), 3);
  for (std::size_t i = 0; i < source.size(); ++i) out.vertices.row(Index(i)) = mesh.vertices.row(source[i]);
  return out;
}

void append_shape(const Shape& shape, TriangleMesh& mesh) {
  if (const auto* sphere = std::get_if<Sphere>(&shape))
    append_capsule(sphere->center, sphere->center, sphere->radius, 2 * kAround, 2 * kRings, mesh);
  if (const auto* capsule = std::get_if<Capsule>(&shape))
    append_capsule(capsule->a, capsule->b, capsule->radius, kAround, kRings, mesh);
  if (const auto* box = std::get_if<Box>(&shape)) append_box(*box, mesh);
}

void append_sticks(const Points<double>& points, const std::vector<std::pair<int, int>>& springs, double radius,
                   TriangleMesh& mesh) {
  const auto at = [&](int i) -> Vec3 { return points.row(i).matrix().transpose(); };
  for (int i = 0; i < int(points.rows()); ++i) append_capsule(at(i), at(i), 2 * radius, 12, 3, mesh);
  for (const auto& [a, b] : springs) append_capsule(at(a), at(b), radius, 8, 1, mesh);
}

}  // namespace hooke::command
