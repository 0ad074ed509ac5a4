#include <hooke/distance_grid.hpp>

#include <hooke/check_samples.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hooke {

DistanceGrid::DistanceGrid(const Vec3& lower, double voxel, const std::array<int, 3>& counts, std::vector<float> values)
    : lower_(lower),
      voxel_(voxel),
      inverse_voxel_(1 / voxel),
      last_(counts[0] - 1, counts[1] - 1, counts[2] - 1),
      counts_(counts),
      values_(std::move(values)) {
  check_samples("DistanceGrid", lower, voxel, counts, values_.size());
  for (const float value : values_)
    if (!std::isfinite(value)) throw std::invalid_argument("DistanceGrid: every value must be finite");
}

Vec3 DistanceGrid::upper() const { return lower_ + voxel_ * last_; }

double DistanceGrid::away(const Vec3& point) const {
  return (lower_ - point).cwiseMax(point - upper()).cwiseMax(0.0).norm();
}

double DistanceGrid::distance(const Vec3& point) const {
  Vec3 place = (point - lower_) * inverse_voxel_;
  double beyond = 0;  // [m]
  if (!((place.array() >= 0).all() && (place.array() <= last_.array()).all())) {
    beyond = away(point);
    place = place.cwiseMax(0.0).cwiseMin(last_);
  }
  std::size_t corner = 0, stride = 1;
  for (int k = 0; k < 3; ++k) {
    const int at = std::clamp(int(place[k]), 0, counts_[std::size_t(k)] - 2);  // also what is not a number
    place[k] -= at;
    corner += stride * std::size_t(at);
    stride *= std::size_t(counts_[std::size_t(k)]);
  }
  const std::size_t row = std::size_t(counts_[0]), layer = row * std::size_t(counts_[1]);
  const float* v = values_.data() + corner;
  const auto along = [&](const float* p) { return p[0] + place[0] * (double(p[1]) - p[0]); };
  const auto across = [&](const float* p) {
    const double low = along(p);
    return low + place[1] * (along(p + row) - low);
  };
  const double low = across(v);
  return low + place[2] * (across(v + layer) - low) + beyond;
}

Vec3 DistanceGrid::normal(const Vec3& point) const {
  // Differences over a voxel are smooth from cell to cell, where the trilinear gradient jumps.
  const double h = 0.5 * voxel_;
  Vec3 gradient;
  for (int k = 0; k < 3; ++k) {
    Vec3 step = Vec3::Zero();
    step[k] = h;
    gradient[k] = distance(point + step) - distance(point - step);
  }
  const double length = gradient.norm();
  return length > 0 ? Vec3(gradient / length) : Vec3(0, 1, 0);
}

}  // namespace hooke
