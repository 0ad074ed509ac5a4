// Particle files as another program that uses OpenVDB reads them.
#include <hooke/vdb/particle_file.hpp>

#include <io/temporary_folder.hpp>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>

#include <map>

namespace {

using namespace hooke;
using test::TemporaryFolder;

openvdb::GridBase::Ptr grid_of(const std::filesystem::path& path, const std::string& name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open();
  return file.readGrid(name);
}

TEST(PointFile, HasPlacesVelocitiesRadiiAndIds) {
  TemporaryFolder folder;
  Points<double> x(1000, 3), v(1000, 3);
  Values<double> radii(1000);
  for (Index i = 0; i < 1000; ++i) {
    x.row(i) << 100 + 0.01 * double(i % 10), 0.01 * double(i / 10 % 10), -0.01 * double(i / 100);
    v.row(i) << double(i), -0.5, 2;
    radii[i] = 1e-3 * double(i + 1);
  }
  vdb::write_points(folder / "p.vdb", x, {v, radii, {}});
  const auto grid = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(grid_of(folder / "p.vdb", "points"));
  ASSERT_TRUE(grid);
  std::map<std::int64_t, int> seen;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::points::AttributeHandle<openvdb::Vec3f> place(leaf->constAttributeArray("P")),
        speed(leaf->constAttributeArray("v"));
    const openvdb::points::AttributeHandle<float> radius(leaf->constAttributeArray("pscale"));
    const openvdb::points::AttributeHandle<std::int64_t> id(leaf->constAttributeArray("id"));
    for (auto point = leaf->beginIndexOn(); point; ++point) {
      const Index i = Index(id.get(*point));
      ++seen[i];
      const openvdb::Vec3d at = grid->indexToWorld(place.get(*point) + point.getCoord().asVec3d());
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(at[k], x(i, k), 1e-7);
        EXPECT_EQ(speed.get(*point)[k], float(v(i, k)));
      }
      EXPECT_EQ(radius.get(*point), float(radii[i]));
    }
  }
  EXPECT_EQ(seen.size(), 1000u);
}

TEST(PointFile, MayBeEmptyOrPlacesAlone) {
  TemporaryFolder folder;
  vdb::write_points(folder / "none.vdb", Points<double>(0, 3));
  EXPECT_EQ(grid_of(folder / "none.vdb", "points")->activeVoxelCount(), 0u);
  vdb::write_points(folder / "one.vdb", Points<double>::Ones(1, 3));
  EXPECT_EQ(grid_of(folder / "one.vdb", "points")->activeVoxelCount(), 1u);
  EXPECT_THROW(vdb::write_points(folder / "x.vdb", Points<double>::Ones(1, 3), {Points<double>::Ones(2, 3), {}, {}}),
               std::invalid_argument);
  EXPECT_THROW(vdb::write_points(folder / "x.vdb", Points<double>::Constant(1, 3, std::nan(""))),
               std::invalid_argument);
}

TEST(DensityFile, IsAFogVolumeWhosePeaksAreTheParticles) {
  TemporaryFolder folder;
  Points<double> x(2, 3);
  x << 0.5, 1, -2, 3, 1, -2;
  vdb::write_density(folder / "smoke.vdb", x, Values<double>::Constant(2, 0.35), 0.1);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(grid_of(folder / "smoke.vdb", "density"));
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(grid->background(), 0.0f);
  const auto at = [&](double px, double py, double pz) {
    const openvdb::Vec3d place = grid->worldToIndex({px, py, pz});
    return grid->tree().getValue(openvdb::Coord::round(place));
  };
  EXPECT_NEAR(at(0.5, 1, -2), 1, 1e-5);
  EXPECT_NEAR(at(3, 1, -2), 1, 1e-5);
  const double part = 1 - 0.04 / (0.35 * 0.35);
  EXPECT_NEAR(at(0.5, 1.2, -2), part * part, 1e-5);
  EXPECT_EQ(at(1.5, 1, -2), 0);
}

}  // namespace
