// Stand-ins for the demos' subjects: a crude mannequin of capsules and a wavy cape behind
// it, so that the renderer's tests need no data files and no simulation.
#pragma once

#include <render/stage.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace hooke::render::figures {

inline void append(TriangleMesh& mesh, const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  const auto first = static_cast<int>(mesh.vertices.rows());
  mesh.vertices.conservativeResize(first + static_cast<Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.vertices.row(first + static_cast<Index>(i)) = points[i].transpose().array();
  for (const auto& [a, b, c] : triangles) mesh.triangles.push_back({first + a, first + b, first + c});
}

/// A capsule whose radius goes from ra at a to rb at b, flattened along `thin` by `squash`.
inline void append_capsule(TriangleMesh& mesh, const Vec3& a, const Vec3& b, double ra, double rb, int around = 40,
                           const Vec3& thin = Vec3::UnitZ(), double squash = 1) {
  const Vec3 axis = (b - a).norm() > 1e-12 ? Vec3((b - a).normalized()) : Vec3::UnitY();
  const Vec3 right =
      (std::abs(axis.dot(thin)) > 0.9 ? Vec3(axis.unitOrthogonal()) : Vec3(thin.cross(axis))).normalized();
  const Vec3 front = right.cross(axis);
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  const int rings = 24;
  for (int i = 0; i <= rings; ++i) {
    const double angle = std::numbers::pi * (double(i) / rings - 0.5);
    const bool top = i > rings / 2;
    const double r = top ? rb : ra;
    const Vec3 middle = (top ? b : a) + r * std::sin(angle) * axis;
    for (int k = 0; k < around; ++k) {
      const double turn = 2 * std::numbers::pi * k / around;
      points.push_back(middle + r * std::cos(angle) * (std::cos(turn) * right + squash * std::sin(turn) * front));
    }
  }
  for (int i = 0; i < rings; ++i)
    for (int k = 0; k < around; ++k) {
      const int p = i * around + k, q = i * around + (k + 1) % around;
      triangles.push_back({p, p + around, q});
      triangles.push_back({q, p + around, q + around});
    }
  append(mesh, points, triangles);
}

/// About 1.75 m tall, facing +z.
inline TriangleMesh mannequin(int around = 40) {
  TriangleMesh mesh;
  const auto limb = [&](Vec3 a, Vec3 b, double ra, double rb, double squash = 1) {
    append_capsule(mesh, a, b, ra, rb, around, Vec3::UnitZ(), squash);
  };
  limb({0, 1.60, 0.01}, {0, 1.66, 0.01}, 0.085, 0.095);
  limb({0, 1.42, 0}, {0, 1.55, 0}, 0.055, 0.055);
  limb({0, 1.18, 0}, {0, 1.36, 0}, 0.14, 0.15, 0.72);
  limb({0, 0.95, 0}, {0, 1.15, 0}, 0.155, 0.13, 0.72);
  for (const double s : {-1.0, 1.0}) {
    limb({s * 0.10, 1.43, 0}, {s * 0.19, 1.41, 0}, 0.06, 0.06);
    limb({s * 0.20, 1.40, 0}, {s * 0.25, 1.13, 0}, 0.055, 0.043);
    limb({s * 0.25, 1.13, 0}, {s * 0.27, 0.88, 0.05}, 0.043, 0.032);
    limb({s * 0.27, 0.86, 0.05}, {s * 0.27, 0.79, 0.07}, 0.034, 0.028);
    limb({s * 0.09, 0.92, 0}, {s * 0.11, 0.50, 0.02}, 0.09, 0.06);
    limb({s * 0.11, 0.50, 0.02}, {s * 0.12, 0.09, 0}, 0.058, 0.04);
    limb({s * 0.12, 0.045, -0.02}, {s * 0.14, 0.035, 0.15}, 0.045, 0.035);
  }
  return mesh;
}

struct Cape {
  TriangleMesh mesh;
  TextureCoordinates uv;
};

/// A cape from the shoulders nearly to the floor, `columns` × `rows` quads, curved around
/// the mannequin's back, outside facing away from it. `phase` [rad] moves the folds.
inline Cape cape(int columns = 60, int rows = 80, double phase = 0) {
  Cape cape;
  const int across = columns + 1, down = rows + 1;
  cape.mesh.vertices.resize(across * down, 3);
  cape.uv.resize(across * down, 2);
  for (int j = 0; j < down; ++j)
    for (int i = 0; i < across; ++i) {
      const double s = 2.0 * i / columns - 1, t = double(j) / rows;
      const double flare = 0.24 + 0.30 * t;
      const double angle = std::numbers::pi * (0.52 + 0.10 * t) * s;
      const double folds = (0.006 + 0.075 * t) * std::sin(15 * s + phase + 0.8 * t) * (0.7 + 0.3 * std::cos(4 * s + 1));
      const double r = flare + folds;
      const Vec3 p(1.08 * r * std::sin(angle), 1.47 - 1.32 * t - 0.07 * (1 - t) * s * s,
                   -0.75 * r * std::cos(angle) - 0.10 * t * t);
      cape.mesh.vertices.row(j * across + i) = p.transpose().array();
      cape.uv.row(j * across + i) << 0.62 * s * (1 + t), 1.35 * t;
    }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int a = j * across + i, b = a + 1, c = a + across, d = c + 1;
      cape.mesh.triangles.push_back({a, b, c});
      cape.mesh.triangles.push_back({b, d, c});
    }
  return cape;
}

inline Material cape_cloth() {
  Material cloth;
  cloth.kind = Material::Kind::Cloth;
  cloth.color = {0.26, 0.008, 0.012};
  return cloth;
}

}  // namespace hooke::render::figures
