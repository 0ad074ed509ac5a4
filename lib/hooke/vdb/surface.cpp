#include <hooke/vdb/surface.hpp>

#include <hooke/vdb/checks.hpp>
#include <hooke/vdb/grids.hpp>

#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointRasterizeSDF.h>
#include <openvdb/tools/LevelSetFilter.h>

#include <algorithm>
#include <stdexcept>

namespace hooke::vdb {

namespace {

constexpr double kBand = 3;           // [voxels]
constexpr double kSmallest = 1.5;     // radius [voxels]
constexpr double kVoxelsACell = 4.0;  // of the grid that sorts the points

openvdb::FloatGrid::Ptr level_set_of(const char* name, const Points<double>& positions, const Values<double>& radii,
                                     double voxel, int smoothing) {
  namespace points = openvdb::points;
  check_particles(name, positions, radii, voxel);
  if (smoothing < 0)
    throw std::invalid_argument(std::string(name) + ": smoothing must not be negative, got " +
                                std::to_string(smoothing));
  openvdb::initialize();
  const auto transform = transform_of(voxel, Vec3::Zero());
  openvdb::FloatGrid::Ptr grid;
  if (positions.rows() == 0) {
    grid = openvdb::FloatGrid::create(float(kBand * voxel));
    grid->setTransform(transform);
  } else {
    std::vector<openvdb::Vec3R> places(std::size_t(positions.rows()));
    std::vector<float> sizes(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      places[i] = {positions(Index(i), 0), positions(Index(i), 1), positions(Index(i), 2)};
      sizes[i] = float(std::max(radii[Index(i)], kSmallest * voxel));
    }
    // Each voxel looks for its points, so that no sum or minimum depends on the threads.
    const auto cells = transform_of(kVoxelsACell * voxel, Vec3::Zero());
    const points::PointAttributeVector<openvdb::Vec3R> list(places);
    const auto order = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(list, *cells);
    const auto sorted = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*order, list, *cells);
    points::appendAttribute<float>(sorted->tree(), "radius");
    points::populateAttribute(sorted->tree(), order->tree(), "radius", points::PointAttributeVector<float>(sizes));
    grid = points::rasterizeSpheres<points::PointDataGrid, float>(*sorted, "radius", 1.0, kBand, transform);
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    for (int round = 0; round < smoothing; ++round) filter.mean(1);
  }
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

}  // namespace

TriangleMesh surface_from_particles(const Points<double>& positions, const Values<double>& radii, double voxel,
                                    int smoothing) {
  return mesh_of(*level_set_of("surface_from_particles", positions, radii, voxel, smoothing));
}

void write_surface_level_set(const std::filesystem::path& path, const Points<double>& positions,
                             const Values<double>& radii, double voxel, int smoothing) {
  write_grids(path, {level_set_of("write_surface_level_set", positions, radii, voxel, smoothing)});
}

}  // namespace hooke::vdb
