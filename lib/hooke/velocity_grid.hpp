// A velocity field on a regular grid, dense in memory: moving air or water from elsewhere. Reading one
// from a volume file is in hooke::vdb.
#pragma once

#include <hooke/types.hpp>

#include <vector>

namespace hooke {

/// Samples of a velocity [m/s] at lower + voxel · (i, j, k).
class VelocityGrid {
 public:
  using Sample = Eigen::Vector3f;

  /// @param lower the first sample's place [m]  @param voxel spacing [m], > 0
  /// @param counts samples along x, y and z, each >= 2
  /// @param values counts[0] · counts[1] · counts[2] of them, x the fastest, then y
  /// @throws std::invalid_argument where sizes do not fit or a value is not finite
  VelocityGrid(const Vec3& lower, double voxel, const std::array<int, 3>& counts, std::vector<Sample> values);

  const Vec3& lower() const { return lower_; }
  Vec3 upper() const;  ///< the last sample's place [m]
  double voxel() const { return voxel_; }
  const std::array<int, 3>& counts() const { return counts_; }
  const std::vector<Sample>& values() const { return values_; }

  /// Trilinear [m/s]; zero outside of the grid.
  Vec3 velocity(const Vec3& point) const;

 private:
  Vec3 lower_;
  double voxel_;
  std::array<int, 3> counts_;
  std::vector<Sample> values_;
};

}  // namespace hooke
