// Particles as OpenVDB files for renderers: as points, or as smoke.
#pragma once

#include <hooke/types.hpp>

#include <filesystem>
#include <vector>

namespace hooke::vdb {

/// What is known of points beside where they are. Empty arrays are left out of the file.
struct PointColumns {
  Points<double> velocities{0, 3};  ///< "v" [m/s]
  Values<double> radii;             ///< "pscale" [m]
  std::vector<std::int64_t> ids;    ///< "id"; the index where empty: the file has an order of its own
};

/// Writes points as a grid of points called "points", single precision.
/// @param positions [m], shape (n, 3); n may be 0
/// @throws std::invalid_argument where sizes differ or a number is not finite; hooke::OutputError
void write_points(const std::filesystem::path& path, const Points<double>& positions, const PointColumns& columns = {});

/// Writes smoke as a fog volume: "density", the sum over particles of (1 - (distance / radius)²)² within
/// their radius, of peak 1 each, and where velocities are given "v" [m/s], their mean under the same weights.
/// A radius below a voxel counts as one.
/// @param positions [m], (n, 3)  @param radii [m], (n), > 0  @param voxel [m]  @param velocities [m/s], (n, 3) or empty
/// @throws std::invalid_argument where sizes differ or a number is not finite or not positive; hooke::OutputError
/// Cost: n (radius / voxel)³.
void write_density(const std::filesystem::path& path, const Points<double>& positions, const Values<double>& radii,
                   double voxel, const Points<double>& velocities = Points<double>(0, 3));

}  // namespace hooke::vdb
