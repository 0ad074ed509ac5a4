// Triangle meshes of the solids that points meet, for drawing.
#pragma once

#include <hooke/shapes.hpp>
#include <hooke/types.hpp>

#include <utility>
#include <vector>

namespace hooke::command {

/// Appends a sphere, a capsule or a box, smooth enough for close views; a box's edges are slightly rounded, so
/// that they catch the light. Half-spaces and level sets add nothing.
void append_shape(const Shape& shape, TriangleMesh& mesh);

/// The same triangles with vertices of their own on each side of an edge that is sharper than `angle` [rad], so that
/// smooth normals do not round it.
TriangleMesh with_creases(const TriangleMesh& mesh, double angle);

/// Appends a ball and stick drawing of springs: for bodies that have no triangles.
void append_sticks(const Points<double>& points, const std::vector<std::pair<int, int>>& springs, double radius,
                   TriangleMesh& mesh);

}  // namespace hooke::command
