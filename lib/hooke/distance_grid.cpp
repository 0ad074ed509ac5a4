#include <hooke/distance_grid.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke {

namespace {

// The cell of a point and the place in it, clamped to the grid.
struct Cell {
  std::size_t corner;
  Vec3 part;
  double away;  // from the grid [m]
};

Cell cell_of(const DistanceGrid& grid, const Vec3& point) {
  const auto& n = grid.counts();
  const Vec3 inside = point.cwiseMax(grid.lower()).cwiseMin(grid.upper());
  const Vec3 place = (inside - grid.lower()) / grid.voxel();
  int at[3];
  Cell cell;
  for (int k = 0; k < 3; ++k) {
    at[k] = std::clamp(int(place[k]), 0, n[std::size_t(k)] - 2);
    cell.part[k] = place[k] - at[k];
  }
  cell.corner = std::size_t(at[0]) + std::size_t(n[0]) * (std::size_t(at[1]) + std::size_t(n[1]) * std::size_t(at[2]));
  cell.away = (point - inside).norm();
  return cell;
}

}  // namespace

DistanceGrid::DistanceGrid(const Vec3& lower, double voxel, const std::array<int, 3>& counts, std::vector<float> values)
    : lower_(lower), voxel_(voxel), counts_(counts), values_(std::move(values)) {
  if (!lower.allFinite()) throw std::invalid_argument("DistanceGrid: lower must be finite");
  if (!(voxel > 0) || !std::isfinite(voxel))
    throw std::invalid_argument("DistanceGrid: voxel must be positive, got " + std::to_string(voxel) + " m");
  std::size_t size = 1;
  for (const int count : counts) {
    if (count < 2)
      throw std::invalid_argument("DistanceGrid: needs two samples a direction, got " + std::to_string(count));
    size *= std::size_t(count);
  }
  if (values_.size() != size)
    throw std::invalid_argument("DistanceGrid: needs " + std::to_string(size) + " values, got " +
                                std::to_string(values_.size()));
  for (const float value : values_)
    if (!std::isfinite(value)) throw std::invalid_argument("DistanceGrid: every value must be finite");
}

Vec3 DistanceGrid::upper() const { return lower_ + voxel_ * Vec3(counts_[0] - 1, counts_[1] - 1, counts_[2] - 1); }

double DistanceGrid::away(const Vec3& point) const {
  return (lower_ - point).cwiseMax(point - upper()).cwiseMax(0.0).norm();
}

double DistanceGrid::distance(const Vec3& point) const {
  const Cell cell = cell_of(*this, point);
  const std::size_t row = std::size_t(counts_[0]), layer = row * std::size_t(counts_[1]);
  const float* v = values_.data() + cell.corner;
  const auto along = [&](const float* p) { return p[0] + cell.part[0] * (double(p[1]) - p[0]); };
  const auto across = [&](const float* p) {
    const double low = along(p);
    return low + cell.part[1] * (along(p + row) - low);
  };
  const double low = across(v);
  return low + cell.part[2] * (across(v + layer) - low) + cell.away;
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
