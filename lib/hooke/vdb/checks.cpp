#include <hooke/vdb/checks.hpp>

#include <cmath>
#include <stdexcept>

namespace hooke::vdb {

void check_points(const std::string& name, const Points<double>& positions, const Points<double>& velocities,
                  const Values<double>& radii) {
  const Index n = positions.rows();
  const auto refuse = [&](const std::string& rule) { throw std::invalid_argument(name + ": " + rule); };
  if (velocities.rows() != 0 && velocities.rows() != n)
    refuse("needs one velocity a point, " + std::to_string(n) + ", got " + std::to_string(velocities.rows()));
  if (radii.size() != 0 && radii.size() != n)
    refuse("needs one radius a point, " + std::to_string(n) + ", got " + std::to_string(radii.size()));
  for (Index i = 0; i < n; ++i) {
    if (!positions.row(i).allFinite()) refuse("position " + std::to_string(i) + " is not finite");
    if (velocities.rows() != 0 && !velocities.row(i).allFinite())
      refuse("velocity " + std::to_string(i) + " is not finite");
    if (radii.size() != 0 && !std::isfinite(radii[i])) refuse("radius " + std::to_string(i) + " is not finite");
  }
}

void check_particles(const std::string& name, const Points<double>& positions, const Values<double>& radii,
                     double voxel) {
  const auto refuse = [&](const std::string& rule) { throw std::invalid_argument(name + ": " + rule); };
  if (!(voxel > 0) || !std::isfinite(voxel)) refuse("voxel must be positive, got " + std::to_string(voxel) + " m");
  if (radii.size() != positions.rows())
    refuse("needs one radius a point, " + std::to_string(positions.rows()) + ", got " + std::to_string(radii.size()));
  check_points(name, positions, Points<double>(0, 3), radii);
  for (Index i = 0; i < radii.size(); ++i) {
    if (!(radii[i] > 0))
      refuse("radius " + std::to_string(i) + " must be positive, got " + std::to_string(radii[i]) + " m");
    if (!(radii[i] < 500 * voxel))
      refuse("radius " + std::to_string(i) + " must be below 500 voxels, got " + std::to_string(radii[i]) + " m");
    if (!((positions.row(i).abs() < 1e8 * voxel).all()))
      refuse("position " + std::to_string(i) + " is more than 1e8 voxels away");
  }
}

}  // namespace hooke::vdb
