// The few types that everything else is written in: vectors, point arrays, triangle
// meshes. SI units everywhere.
#pragma once

#include <Eigen/Core>

#include <array>
#include <vector>

namespace hooke {

using Index = Eigen::Index;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// n points or vectors, shape (n, 3), one coordinate after the other in memory (x|y|z),
/// so that a loop over one coordinate runs through consecutive numbers.
template <class S>
using Points = Eigen::Array<S, Eigen::Dynamic, 3>;

template <class S>
Eigen::Matrix<S, 3, 1> row(const Points<S>& p, Index i) {
  return {p(i, 0), p(i, 1), p(i, 2)};
}

template <class S>
void set_row(Points<S>& p, Index i, const Eigen::Matrix<S, 3, 1>& value) {
  for (int k = 0; k < 3; ++k) p(i, k) = value[k];
}

/// One number a point, shape (n).
template <class S>
using Values = Eigen::Array<S, Eigen::Dynamic, 1>;

/// Three vertex indices, counter-clockwise seen from outside.
using Triangle = std::array<int, 3>;

/// Vertices [m] and triangles that index them.
struct TriangleMesh {
  Points<double> vertices{0, 3};    ///< [m], shape (vertex count, 3)
  std::vector<Triangle> triangles;  ///< indices below the vertex count
};

}  // namespace hooke
