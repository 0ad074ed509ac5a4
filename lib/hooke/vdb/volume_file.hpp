// Solids and moving air as OpenVDB files. OpenVDB's reader (10.0) trusts its input: what is cut off or of another kind
// is refused, but a few changed bytes can make it write where it must not. Read files from people you trust.
#pragma once

#include <hooke/distance_grid.hpp>
#include <hooke/velocity_grid.hpp>

#include <filesystem>
#include <memory>
#include <string>

namespace hooke::vdb {

/// The distances of a level set in a file, dense on the box of its active voxels and four more around;
/// what is beyond its narrow band is found from there.
/// @param grid its name; empty: the first level set
/// @throws hooke::Error naming file, grid and rule: no such file, not an OpenVDB file, cut off or damaged, no such
/// grid (lists those there are), not a level set of floats, no voxels or nothing inside, a value that is not finite,
/// voxels that are not cubes along the axes, more than 2^28 voxels
std::shared_ptr<const DistanceGrid> read_level_set(const std::filesystem::path& path, const std::string& grid = "");

/// Writes distances as the narrow-band level set that other programs expect: three voxels each way.
/// Throws hooke::OutputError.
void write_level_set(const std::filesystem::path& path, const DistanceGrid& distances,
                     const std::string& grid = "surface");

/// The velocities [m/s] of a vector grid in a file, dense on the box of its active voxels and one more around.
/// Values on the faces of voxels (staggered grids) are averaged to the centres.
/// @param grid its name; empty: the first vector grid
/// @throws hooke::Error as read_level_set
VelocityGrid read_velocity_field(const std::filesystem::path& path, const std::string& grid = "");

}  // namespace hooke::vdb
