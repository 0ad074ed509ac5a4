#include <hooke/velocity_grid.hpp>

#include <hooke/check_samples.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hooke {

VelocityGrid::VelocityGrid(const Vec3& lower, double voxel, const std::array<int, 3>& counts,
                           std::vector<Sample> values)
    : lower_(lower), voxel_(voxel), counts_(counts), values_(std::move(values)) {
  check_samples("VelocityGrid", lower, voxel, counts, values_.size());
  for (const Sample& value : values_)
    if (!value.allFinite()) throw std::invalid_argument("VelocityGrid: every value must be finite");
}

Vec3 VelocityGrid::upper() const { return lower_ + voxel_ * Vec3(counts_[0] - 1, counts_[1] - 1, counts_[2] - 1); }

Vec3 VelocityGrid::velocity(const Vec3& point) const {
  const Vec3 place = (point - lower_) / voxel_;
  std::size_t corner[3];
  Vec3 part;
  for (int k = 0; k < 3; ++k) {
    const int last = counts_[std::size_t(k)] - 1;
    if (!(place[k] >= 0 && place[k] <= last)) return Vec3::Zero();
    const int at = std::min(int(place[k]), last - 1);
    corner[k] = std::size_t(at);
    part[k] = place[k] - at;
  }
  const std::size_t row = std::size_t(counts_[0]), layer = row * std::size_t(counts_[1]);
  const Sample* v = values_.data() + corner[0] + row * corner[1] + layer * corner[2];
  const auto along = [&](const Sample* p) -> Vec3 {
    return (1 - part[0]) * p[0].cast<double>() + part[0] * p[1].cast<double>();
  };
  const auto across = [&](const Sample* p) -> Vec3 { return (1 - part[1]) * along(p) + part[1] * along(p + row); };
  return (1 - part[2]) * across(v) + part[2] * across(v + layer);
}

}  // namespace hooke
