// Signed distances to a solid on a regular grid, dense in memory. Making one from a mesh or a volume
// file is in hooke::vdb.
#pragma once

#include <hooke/types.hpp>

#include <vector>

namespace hooke {

/// Samples of a signed distance [m], negative inside, at lower + voxel · (i, j, k).
class DistanceGrid {
 public:
  /// @param lower the first sample's place [m]  @param voxel spacing [m], > 0
  /// @param counts samples along x, y and z, each >= 2
  /// @param values counts[0] · counts[1] · counts[2] of them, x the fastest, then y
  /// @throws std::invalid_argument where sizes do not fit or a value is not finite
  DistanceGrid(const Vec3& lower, double voxel, const std::array<int, 3>& counts, std::vector<float> values);

  const Vec3& lower() const { return lower_; }
  Vec3 upper() const;  ///< the last sample's place [m]
  double voxel() const { return voxel_; }
  const std::array<int, 3>& counts() const { return counts_; }
  const std::vector<float>& values() const { return values_; }

  /// Trilinear [m]. Outside of the grid: the nearest border value plus the way there, which is never less than the
  /// distance.
  double distance(const Vec3& point) const;
  /// How far a point is from the grid itself, 0 inside [m].
  double away(const Vec3& point) const;
  /// The direction in which the distance grows fastest, of unit length: the outward normal. (0, 1, 0) where the
  /// distance is flat.
  Vec3 normal(const Vec3& point) const;

 private:
  Vec3 lower_;
  double voxel_, inverse_voxel_;
  Vec3 last_;  // the last sample's indices
  std::array<int, 3> counts_;
  std::vector<float> values_;
};

}  // namespace hooke
