// The surface of a liquid made of particles.
#pragma once

#include <hooke/types.hpp>

#include <filesystem>

namespace hooke::vdb {

/// A closed mesh around the union of balls, smoothed: triangles about a voxel wide, counter-clockwise from outside.
/// A radius below 1.5 voxels counts as that much, for less would not be seen.
/// @param positions [m], (n, 3); n = 0 gives an empty mesh  @param radii [m], (n), > 0  @param voxel [m]
/// @param smoothing rounds of smoothing, >= 0: each takes away bumps of about a voxel
/// @throws std::invalid_argument where sizes differ or a number is not finite or not positive
/// Cost: n (radius / voxel)³, and rounds × surface / voxel². Deterministic for any number of threads.
TriangleMesh surface_from_particles(const Points<double>& positions, const Values<double>& radii, double voxel,
                                    int smoothing = 2);

/// The same surface as a level set called "surface" in an OpenVDB file. Throws hooke::OutputError also.
void write_surface_level_set(const std::filesystem::path& path, const Points<double>& positions,
                             const Values<double>& radii, double voxel, int smoothing = 2);

}  // namespace hooke::vdb
