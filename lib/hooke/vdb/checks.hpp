// What particles that come in must fulfil. Not installed.
#pragma once

#include <hooke/types.hpp>

#include <string>

namespace hooke::vdb {

/// Finite positions within 1e8 voxels of `voxel` of zero, one finite radius > 0 a point, voxel > 0.
/// @throws std::invalid_argument beginning with `name`
void check_particles(const std::string& name, const Points<double>& positions, const Values<double>& radii,
                     double voxel);

/// Finite positions; velocities and radii finite, one a point or none.
void check_points(const std::string& name, const Points<double>& positions, const Points<double>& velocities,
                  const Values<double>& radii);

}  // namespace hooke::vdb
