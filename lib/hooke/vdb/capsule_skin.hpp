// A smooth closed surface around capsules. Solid shapes and distances to them are in
// hooke/shapes.hpp; how a skin moves is not known here.
#pragma once

#include <hooke/shapes.hpp>

#include <span>

namespace hooke::vdb {

/// Signed distance to the smooth union of capsules [m]: from the nearest to the farthest,
/// d ← min(d, dᵢ) - max(0, k - |d - dᵢ|)²/(4 k), which fills creases within k = blend_radius.
/// Never above the plain union's distance; two equal capsules come k/4 closer, more of them
/// up to about k/2. For k = 0 the plain union.
/// Precondition: at least one capsule (asserted). Cost: the number of capsules.
double smooth_union_distance(std::span<const Capsule> capsules, double blend_radius, const Vec3& point);

/// A closed triangle mesh of the smooth union's surface, counter-clockwise from outside.
/// Vertices lie on the surface to about a thousandth of the voxel size; triangles are about
/// voxel_size [m] wide. blend_radius [m] fills the creases between capsules.
/// Throws std::invalid_argument when there are no capsules, a capsule is not finite or not
/// wider than a voxel, voxel_size is not positive, blend_radius is negative, or the bounding
/// box would have more than 2^30 voxels. Cost: surface area / voxel_size². Deterministic.
TriangleMesh skin_capsules(std::span<const Capsule> capsules, double voxel_size, double blend_radius);

}  // namespace hooke::vdb
