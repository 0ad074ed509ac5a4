// What the tools of this folder share. Not installed: it names OpenVDB's types.
#pragma once

#include <hooke/distance_grid.hpp>

#include <openvdb/openvdb.h>

#include <filesystem>
#include <string>

namespace hooke::vdb {

constexpr double kMostVoxels = 1 << 28;  // of a dense grid: 1 GiB

/// Samples of a narrow-band level set on the box of its active voxels with `margin` voxels around, the
/// distances beyond the band filled in. The transform must be a uniform scale and a translation.
/// @param name what messages call it  @throws std::invalid_argument no active voxel, nothing inside, a value
/// that is not finite, more than 2^28 samples
DistanceGrid densify(const openvdb::FloatGrid& grid, int margin, const std::string& name);

/// The distances beyond a band: in `values`, x the fastest, those with |value| >= band become true distances
/// to the nearest of the surface's points below the band, each with its sign: sweeps hand the nearest point on from
/// sample to sample (Danielsson, Euclidean distance mapping, Comput. Graph. Image Process. 14, 1980).
void fill_distances(std::vector<float>& values, const std::array<int, 3>& counts, double voxel, double band);

/// The other way: the narrow band of three voxels each way.
openvdb::FloatGrid::Ptr narrow_band(const DistanceGrid& distances);

/// Number of samples of a box of voxels. Throws std::invalid_argument beginning with `name` where that is more
/// than 2^28.
std::size_t count_voxels(const openvdb::CoordBBox& box, const std::string& name);

/// Writes grids under a temporary name and renames; the same grids give the same bytes.
/// @throws hooke::OutputError
void write_grids(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids);

/// Its surface, counter-clockwise from outside; quads are cut along the shorter diagonal.
TriangleMesh mesh_of(const openvdb::FloatGrid& grid);

/// A transform of that voxel size whose voxel (0, 0, 0) is at `origin`.
openvdb::math::Transform::Ptr transform_of(double voxel, const Vec3& origin);

}  // namespace hooke::vdb
