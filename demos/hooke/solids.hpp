// Triangle meshes of the solids that points meet, for drawing.
#pragma once

#include <hooke/shapes.hpp>
#include <hooke/types.hpp>

#include <utility>
#include <vector>

namespace hooke::command {

/// Appends a sphere or a capsule, smooth enough for close views. A half-space adds nothing.
void append_shape(const Shape& shape, TriangleMesh& mesh);

/// Appends a ball and stick drawing of springs: for bodies that have no triangles.
void append_sticks(const Points<double>& points, const std::vector<std::pair<int, int>>& springs, double radius,
                   TriangleMesh& mesh);

}  // namespace hooke::command
