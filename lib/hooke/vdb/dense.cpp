#include <hooke/vdb/grids.hpp>

#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hooke::vdb {

namespace {
constexpr float kBand = 3;  // [voxels]
}

std::size_t count_voxels(const openvdb::CoordBBox& box, const std::string& name) {
  double count = 1;
  for (int k = 0; k < 3; ++k) count *= double(box.max()[k]) - double(box.min()[k]) + 1;
  if (!(count <= kMostVoxels))
    throw std::invalid_argument(name + ": must be at most 2^28 voxels, got " + std::to_string(count) +
                                "; take larger ones");
  return std::size_t(count);
}

void fill_distances(std::vector<float>& values, const std::array<int, 3>& counts, double voxel, double band) {
  const int n[3] = {counts[0], counts[1], counts[2]};
  const Index stride[3] = {1, n[0], Index(n[0]) * n[1]};
  const float h = float(voxel);
  std::vector<Eigen::Vector3f> feet;            // points of the surface
  std::vector<int> nearest(values.size(), -1);  // which of them, sample by sample
  std::vector<float> squared(values.size(), std::numeric_limits<float>::infinity());
  const auto known = [&](Index i) { return std::abs(values[std::size_t(i)]) < float(band); };
  const auto each = [&](const auto& work) {
    Index i = 0;
    for (int z = 0; z < n[2]; ++z)
      for (int y = 0; y < n[1]; ++y)
        for (int x = 0; x < n[0]; ++x, ++i) work(i, Eigen::Vector3i(x, y, z));
  };
  each([&](Index i, const Eigen::Vector3i& at) {
    if (!known(i)) return;
    Eigen::Vector3f gradient;
    for (int k = 0; k < 3; ++k) {
      if (at[k] == 0 || at[k] == n[k] - 1 || !known(i - stride[k]) || !known(i + stride[k])) return;
      gradient[k] = (values[std::size_t(i + stride[k])] - values[std::size_t(i - stride[k])]) / (2 * h);
    }
    // Where two sides are as near as each other, the gradient is that of neither.
    const float slope = gradient.norm();
    if (slope < 0.9f || slope > 1.1f) return;
    nearest[std::size_t(i)] = int(feet.size());
    squared[std::size_t(i)] = 0;
    feet.push_back(h * at.cast<float>() - values[std::size_t(i)] / slope * gradient);
  });
  // The thirteen neighbours that a pass has been at before; the way back has the other thirteen.
  std::array<std::array<int, 3>, 13> before{};
  for (int at = 0; at < 13; ++at) before[std::size_t(at)] = {at % 3 - 1, at / 3 % 3 - 1, at / 9 - 1};
  for (int pass = 0; pass < 4; ++pass) {
    const int sense = pass % 2 ? -1 : 1;
    const auto turn = [&](int at, int count) { return sense > 0 ? at : count - 1 - at; };
    for (int kz = 0; kz < n[2]; ++kz)
      for (int ky = 0; ky < n[1]; ++ky)
        for (int kx = 0; kx < n[0]; ++kx) {
          const int x = turn(kx, n[0]), y = turn(ky, n[1]), z = turn(kz, n[2]);
          const Index i = x + stride[1] * y + stride[2] * z;
          if (squared[std::size_t(i)] == 0) continue;
          const Eigen::Vector3f here = h * Eigen::Vector3f(float(x), float(y), float(z));
          for (const auto& [dx, dy, dz] : before) {
            const int nx = x + sense * dx, ny = y + sense * dy, nz = z + sense * dz;
            if (nx < 0 || ny < 0 || nz < 0 || nx >= n[0] || ny >= n[1] || nz >= n[2]) continue;
            const int foot = nearest[std::size_t(nx + stride[1] * ny + stride[2] * nz)];
            if (foot < 0 || foot == nearest[std::size_t(i)]) continue;
            const float d = (here - feet[std::size_t(foot)]).squaredNorm();
            if (d < squared[std::size_t(i)]) squared[std::size_t(i)] = d, nearest[std::size_t(i)] = foot;
          }
        }
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!known(Index(i)) && std::isfinite(squared[i]))
      values[i] = std::copysign(std::max(std::sqrt(squared[i]), float(band)), values[i]);
}

DistanceGrid densify(const openvdb::FloatGrid& grid, int margin, const std::string& name) {
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) throw std::invalid_argument(name + ": has no active voxels");
  box.expand(margin);
  const std::size_t size = count_voxels(box, name);
  const auto dim = box.dim();
  const std::array<int, 3> counts{dim.x(), dim.y(), dim.z()};
  std::vector<float> values(size);
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, values.data());
  openvdb::tools::copyToDense(grid, dense);
  bool any_inside = false;
  for (const float value : values) {
    if (!std::isfinite(value)) throw std::invalid_argument(name + ": has a value that is not finite");
    any_inside = any_inside || value < 0;
  }
  if (!any_inside) throw std::invalid_argument(name + ": has nothing inside: no distance is negative");
  const double voxel = grid.voxelSize()[0];
  // A little less than the background, for values that were stored with fewer digits.
  fill_distances(values, counts, voxel, 0.999 * std::abs(double(grid.background())));
  const openvdb::Vec3d lower = grid.indexToWorld(box.min());
  return DistanceGrid({lower.x(), lower.y(), lower.z()}, voxel, counts, std::move(values));
}

openvdb::FloatGrid::Ptr narrow_band(const DistanceGrid& distances) {
  openvdb::initialize();
  const float band = kBand * float(distances.voxel());
  auto out = openvdb::FloatGrid::create(band);
  out->setGridClass(openvdb::GRID_LEVEL_SET);
  out->setTransform(transform_of(distances.voxel(), distances.lower()));
  auto accessor = out->getAccessor();
  const auto& n = distances.counts();
  const float* value = distances.values().data();
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x, ++value) {
        if (std::abs(*value) < band)
          accessor.setValueOn({x, y, z}, *value);
        else if (*value < 0)
          accessor.setValueOff({x, y, z}, -band);
      }
  return out;
}

}  // namespace hooke::vdb
