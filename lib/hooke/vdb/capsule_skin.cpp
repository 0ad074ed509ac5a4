#include <hooke/vdb/capsule_skin.hpp>

#include <hooke/vdb/grids.hpp>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace hooke::vdb {
namespace {

constexpr int block = 8;         // voxels along the edge of one leaf
constexpr double half_band = 3;  // [voxels]

void check(std::span<const Capsule> capsules, double voxel_size, double blend_radius) {
  if (capsules.empty()) throw std::invalid_argument("skin_capsules: needs at least one capsule");
  if (!(voxel_size > 0) || !std::isfinite(voxel_size))
    throw std::invalid_argument("skin_capsules: voxel_size must be positive, got " + std::to_string(voxel_size) + " m");
  if (!(blend_radius >= 0) || !std::isfinite(blend_radius))
    throw std::invalid_argument("skin_capsules: blend_radius must not be negative, got " +
                                std::to_string(blend_radius) + " m");
  for (const Capsule& c : capsules) {
    if (!c.a.allFinite() || !c.b.allFinite())
      throw std::invalid_argument("skin_capsules: a capsule's end is not finite");
    if (!(c.radius > voxel_size / 2) || !std::isfinite(c.radius))
      throw std::invalid_argument("skin_capsules: a capsule must be wider than a voxel, got radius " +
                                  std::to_string(c.radius) + " m");
  }
}

// Capsules that can matter within `reach` of the point, nearest first is not needed here.
std::vector<Capsule> near_capsules(std::span<const Capsule> capsules, const Vec3& center, double reach,
                                   double blend_radius) {
  std::vector<double> distance(capsules.size());
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < capsules.size(); ++i) {
    distance[i] = signed_distance(capsules[i], center);
    nearest = std::min(nearest, distance[i]);
  }
  std::vector<Capsule> kept;
  for (std::size_t i = 0; i < capsules.size(); ++i)
    if (distance[i] <= nearest + blend_radius + 2 * reach) kept.push_back(capsules[i]);
  return kept;
}

// The level set: exact values in every leaf the surface can touch, a sign elsewhere.
openvdb::FloatGrid::Ptr level_set(std::span<const Capsule> capsules, double voxel_size, double blend_radius) {
  Vec3 low = capsules[0].a;
  Vec3 high = low;
  for (const Capsule& c : capsules) {
    low = low.cwiseMin((c.a.cwiseMin(c.b).array() - c.radius).matrix());
    high = high.cwiseMax((c.a.cwiseMax(c.b).array() + c.radius).matrix());
  }
  const double margin = blend_radius + half_band * voxel_size;
  const double block_size = block * voxel_size;
  std::array<int, 3> first;
  std::array<int, 3> last;
  double voxels = 1;
  for (int c = 0; c < 3; ++c) {
    const double from = std::floor((low[c] - margin) / block_size);
    const double to = std::floor((high[c] + margin) / block_size);
    voxels *= (to - from + 1) * block;
    if (!(voxels <= 1 << 30) || std::max(std::abs(from), std::abs(to)) > 1e8)
      throw std::invalid_argument(
          "skin_capsules: voxel_size is too small for the capsules: " + std::to_string(voxel_size) + " m");
    first[c] = static_cast<int>(from);
    last[c] = static_cast<int>(to);
  }

  const double background = half_band * voxel_size;
  auto grid = openvdb::FloatGrid::create(static_cast<float>(background));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel_size));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  auto accessor = grid->getAccessor();
  const double reach = std::sqrt(3.0) / 2 * block_size;
  for (int bx = first[0]; bx <= last[0]; ++bx)
    for (int by = first[1]; by <= last[1]; ++by)
      for (int bz = first[2]; bz <= last[2]; ++bz) {
        const Vec3 center = (Vec3(bx, by, bz) * block).array() * voxel_size + (block - 1) / 2.0 * voxel_size;
        const std::vector<Capsule> kept = near_capsules(capsules, center, reach, blend_radius);
        const double middle = smooth_union_distance(kept, blend_radius, center);
        const openvdb::Coord corner(bx * block, by * block, bz * block);
        if (middle > reach + background) continue;
        if (middle < -reach - background) {
          grid->sparseFill(openvdb::CoordBBox::createCube(corner, block), static_cast<float>(-background), false);
          continue;
        }
        for (int i = 0; i < block * block * block; ++i) {
          const openvdb::Coord at = corner.offsetBy(i / (block * block), i / block % block, i % block);
          const double d = smooth_union_distance(kept, blend_radius, Vec3(at.x(), at.y(), at.z()) * voxel_size);
          const auto value = static_cast<float>(std::clamp(d, -background, background));
          if (std::abs(d) < background)
            accessor.setValueOn(at, value);
          else
            accessor.setValueOff(at, value);
        }
      }
  return grid;
}

// The mesher puts a vertex at the mean of its cell's crossings. Even the vertices out and put
// them on the surface itself, so that normals are smooth.
void relax(TriangleMesh& mesh, std::span<const Capsule> capsules, double voxel_size, double blend_radius) {
  const Index count = mesh.vertices.rows();
  std::vector<std::vector<Capsule>> kept(static_cast<std::size_t>(count));
  for (Index v = 0; v < count; ++v)
    kept[static_cast<std::size_t>(v)] =
        near_capsules(capsules, mesh.vertices.row(v).matrix().transpose(), 1.5 * voxel_size, blend_radius);
  for (int round = 0; round < 4; ++round) {
    Points<double> sum = Points<double>::Zero(count, 3);
    Values<double> neighbours = Values<double>::Zero(count);
    for (const Triangle& t : mesh.triangles)
      for (int e = 0; e < 3; ++e) {
        sum.row(t[e]) += mesh.vertices.row(t[(e + 1) % 3]);
        neighbours[t[e]] += 1;
      }
    for (Index v = 0; v < count; ++v) {
      const auto field = [&](const Vec3& x) {
        return smooth_union_distance(kept[static_cast<std::size_t>(v)], blend_radius, x);
      };
      Vec3 x = mesh.vertices.row(v).matrix();
      if (round < 3) x += 0.5 * (Vec3(sum.row(v).matrix() / neighbours[v]) - x);
      for (int newton = 0; newton < (round < 3 ? 1 : 2); ++newton) {
        const double h = 1e-4 * voxel_size;
        const double d = field(x);
        const Vec3 gradient =
            Vec3(field(x + Vec3(h, 0, 0)) - d, field(x + Vec3(0, h, 0)) - d, field(x + Vec3(0, 0, h)) - d) / h;
        const double slope = gradient.squaredNorm();
        if (slope < 0.05) break;
        const double step = std::clamp(d / slope, -voxel_size, voxel_size);
        x -= step * gradient;
      }
      mesh.vertices.row(v) = x.array().transpose();
    }
  }
}

}  // namespace

double smooth_union_distance(std::span<const Capsule> capsules, double blend_radius, const Vec3& point) {
  assert(!capsules.empty());
  const double k = blend_radius;
  // Only the nearest few can matter; they are kept sorted so that the order of the capsules
  // does not count.
  constexpr int most = 6;
  std::array<double, most> nearest{};
  int count = 0;
  for (const Capsule& c : capsules) {
    const double d = signed_distance(c, point);
    if (count == most && d >= nearest[most - 1]) continue;
    int at = count < most ? count++ : most - 1;
    for (; at > 0 && nearest[at - 1] > d; --at) nearest[at] = nearest[at - 1];
    nearest[at] = d;
  }
  double result = nearest[0];
  for (int i = 1; i < count; ++i) {
    const double overlap = k - std::abs(nearest[i] - result);
    if (overlap <= 0) break;
    result = std::min(result, nearest[i]) - overlap * overlap / (4 * k);
  }
  return result;
}

TriangleMesh skin_capsules(std::span<const Capsule> capsules, double voxel_size, double blend_radius) {
  check(capsules, voxel_size, blend_radius);
  openvdb::initialize();
  TriangleMesh mesh = mesh_of(*level_set(capsules, voxel_size, blend_radius));
  relax(mesh, capsules, voxel_size, blend_radius);
  return mesh;
}

}  // namespace hooke::vdb
