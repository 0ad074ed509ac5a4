// What every sampled field asks of its samples. Internal to hooke::core and not installed.
#pragma once

#include <hooke/types.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke {

/// @throws std::invalid_argument, beginning with `who`
inline void check_samples(const std::string& who, const Vec3& lower, double voxel, const std::array<int, 3>& counts,
                          std::size_t values) {
  if (!lower.allFinite()) throw std::invalid_argument(who + ": lower must be finite");
  if (!(voxel > 0) || !std::isfinite(voxel))
    throw std::invalid_argument(who + ": voxel must be positive, got " + std::to_string(voxel) + " m");
  std::size_t size = 1;
  for (const int count : counts) {
    if (count < 2) throw std::invalid_argument(who + ": needs two samples a direction, got " + std::to_string(count));
    size *= std::size_t(count);
  }
  if (values != size)
    throw std::invalid_argument(who + ": needs " + std::to_string(size) + " values, got " + std::to_string(values));
}

}  // namespace hooke
