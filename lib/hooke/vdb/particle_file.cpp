#include <hooke/vdb/particle_file.hpp>

#include <hooke/vdb/checks.hpp>
#include <hooke/vdb/grids.hpp>

#include <openvdb/points/PointConversion.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hooke::vdb {

namespace {

namespace points = openvdb::points;

constexpr openvdb::Index kPointsAVoxel = 8;

openvdb::Vec3s vector_of(const Points<double>& p, Index i) { return {float(p(i, 0)), float(p(i, 1)), float(p(i, 2))}; }

template <class T>
void add_column(points::PointDataGrid& grid, const openvdb::tools::PointIndexGrid& order, const std::string& name,
                const std::vector<T>& values) {
  points::appendAttribute<T>(grid.tree(), name);
  points::populateAttribute(grid.tree(), order.tree(), name, points::PointAttributeVector<T>(values));
}

// A voxel that has a few of them, so that coordinates within it keep their digits.
double voxel_for(const std::vector<openvdb::Vec3R>& places) {
  openvdb::Vec3R low(1e300), high(-1e300);
  for (const openvdb::Vec3R& x : places)
    low = openvdb::math::minComponent(low, x), high = openvdb::math::maxComponent(high, x);
  const openvdb::Vec3R size = high - low;
  const double longest = std::max({size.x(), size.y(), size.z()});
  if (!(longest > 0)) return 1;
  // As if they filled the box: an upper bound of the voxel that has that many.
  const double thinnest = 1e-3 * longest;
  const double volume = std::max(size.x(), thinnest) * std::max(size.y(), thinnest) * std::max(size.z(), thinnest);
  return std::max(std::cbrt(volume * kPointsAVoxel / double(places.size())), 1e-5 * longest);
}

}  // namespace

void write_points(const std::filesystem::path& path, const Points<double>& positions, const PointColumns& columns) {
  check_points("write_points", positions, columns.velocities, columns.radii);
  if (!columns.ids.empty() && Index(columns.ids.size()) != positions.rows())
    throw std::invalid_argument("write_points: needs one id a point, got " + std::to_string(columns.ids.size()));
  openvdb::initialize();
  std::vector<openvdb::Vec3R> places(std::size_t(positions.rows()));
  for (std::size_t i = 0; i < places.size(); ++i)
    places[i] = {positions(Index(i), 0), positions(Index(i), 1), positions(Index(i), 2)};
  const auto transform = transform_of(voxel_for(places), Vec3::Zero());
  const points::PointAttributeVector<openvdb::Vec3R> list(places);
  const auto order = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(list, *transform);
  const auto grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*order, list, *transform);
  grid->setName("points");
  if (!places.empty()) {
    std::vector<std::int64_t> ids = columns.ids;
    for (std::size_t i = ids.size(); i < places.size(); ++i) ids.push_back(std::int64_t(i));
    add_column(*grid, *order, "id", ids);
    if (columns.velocities.rows() > 0) {
      std::vector<openvdb::Vec3s> v(places.size());
      for (std::size_t i = 0; i < v.size(); ++i) v[i] = vector_of(columns.velocities, Index(i));
      add_column(*grid, *order, "v", v);
    }
    if (columns.radii.size() > 0) {
      std::vector<float> radii(places.size());
      for (std::size_t i = 0; i < radii.size(); ++i) radii[i] = float(columns.radii[Index(i)]);
      add_column(*grid, *order, "pscale", radii);
    }
  }
  write_grids(path, {grid});
}

void write_density(const std::filesystem::path& path, const Points<double>& positions, const Values<double>& radii,
                   double voxel, const Points<double>& velocities) {
  check_particles("write_density", positions, radii, voxel);
  check_points("write_density", positions, velocities, radii);
  openvdb::initialize();
  auto density = openvdb::FloatGrid::create(0);
  density->setName("density");
  density->setGridClass(openvdb::GRID_FOG_VOLUME);
  density->setTransform(transform_of(voxel, Vec3::Zero()));
  auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("v");
  velocity->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  velocity->setTransform(density->transform().copy());
  auto d = density->getAccessor();
  auto v = velocity->getAccessor();
  const bool moving = velocities.rows() > 0;
  for (Index i = 0; i < positions.rows(); ++i) {
    const Vec3 at = positions.row(i).matrix().transpose() / voxel;
    const double radius = std::max(radii[i] / voxel, 1.0);
    openvdb::Coord low, high;
    for (int k = 0; k < 3; ++k) low[k] = int(std::ceil(at[k] - radius)), high[k] = int(std::floor(at[k] + radius));
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int z = low.z(); z <= high.z(); ++z) {
          const double part = 1 - (Vec3(x, y, z) - at).squaredNorm() / (radius * radius);
          if (part <= 0) continue;
          const openvdb::Coord voxel_at(x, y, z);
          const float weight = float(part * part);
          d.setValueOn(voxel_at, d.getValue(voxel_at) + weight);
          if (moving) v.setValueOn(voxel_at, v.getValue(voxel_at) + weight * vector_of(velocities, i));
        }
  }
  openvdb::GridCPtrVec grids{density};
  if (moving) {
    for (auto it = velocity->beginValueOn(); it; ++it)
      if (const float weight = d.getValue(it.getCoord()); weight > 0) it.setValue(*it / weight);
    grids.push_back(velocity);
  }
  write_grids(path, grids);
}

}  // namespace hooke::vdb
