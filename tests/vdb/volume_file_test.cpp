// Level sets and velocities from OpenVDB files and back, and what is said of files that are none.
#include <hooke/error.hpp>
#include <hooke/vdb/particle_file.hpp>
#include <hooke/vdb/surface.hpp>
#include <hooke/vdb/volume_file.hpp>

#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace hooke;
using test::contents;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

DistanceGrid ball(const Vec3& center, double radius, double voxel) {
  const int n = int(std::ceil(2 * (radius + 5 * voxel) / voxel)) + 1;
  const Vec3 lower = center - Vec3::Constant(0.5 * voxel * (n - 1));
  std::vector<float> values;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) values.push_back(float((lower + voxel * Vec3(x, y, z) - center).norm() - radius));
  return DistanceGrid(lower, voxel, {n, n, n}, std::move(values));
}

std::string level_set_error(const std::filesystem::path& path, const std::string& grid = "") {
  try {
    vdb::read_level_set(path, grid);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string velocity_error(const std::filesystem::path& path, const std::string& grid = "") {
  try {
    vdb::read_velocity_field(path, grid);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(VolumeFile, ALevelSetComesBackNearAndFar) {
  TemporaryFolder folder;
  const Vec3 center(3, -1, 0.7);
  vdb::write_level_set(folder / "ball.vdb", ball(center, 0.4, 0.03), "ball");
  for (const char* name : {"", "ball"}) {
    const auto grid = vdb::read_level_set(folder / "ball.vdb", name);
    EXPECT_NEAR(grid->voxel(), 0.03, 1e-12);
    for (double r = 0.02; r < 0.48; r += 0.01) {
      const Vec3 way = Vec3(2, -1, 2) / 3;
      // The interpolated ball within its band; beyond it, solved from there.
      EXPECT_NEAR(grid->distance(center + r * way), r - 0.4, std::abs(r - 0.4) < 0.06 ? 0.002 : 0.015) << r;
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "ball.part.vdb"));
}

TEST(VolumeFile, TheSameGridGivesTheSameBytes) {
  TemporaryFolder folder;
  vdb::write_level_set(folder / "a.vdb", ball({0, 0, 0}, 0.4, 0.05));
  vdb::write_level_set(folder / "b.vdb", ball({0, 0, 0}, 0.4, 0.05));
  vdb::write_level_set(folder / "c.vdb", ball({0, 0, 0}, 0.41, 0.05));
  EXPECT_EQ(contents(folder / "a.vdb"), contents(folder / "b.vdb"));
  EXPECT_NE(contents(folder / "a.vdb").substr(21, 36), contents(folder / "c.vdb").substr(21, 36));
}

TEST(VolumeFile, VelocitiesComeBack) {
  TemporaryFolder folder;
  Points<double> x(2, 3), v(2, 3);
  x << 0.5, 0.5, 0.5, 2.5, 0.5, 0.5;
  v << 1, -2, 3, -4, 0, 0.5;
  vdb::write_density(folder / "smoke.vdb", x, Values<double>::Constant(2, 0.3), 0.1, v);
  const VelocityGrid field = vdb::read_velocity_field(folder / "smoke.vdb", "v");
  EXPECT_NEAR(field.voxel(), 0.1, 1e-12);
  EXPECT_LT((field.velocity({0.5, 0.5, 0.5}) - Vec3(1, -2, 3)).norm(), 1e-5);
  EXPECT_LT((field.velocity({2.53, 0.48, 0.5}) - Vec3(-4, 0, 0.5)).norm(), 1e-5);
  EXPECT_EQ(field.velocity({1.5, 0.5, 0.5}), Vec3(0, 0, 0));
  EXPECT_EQ(field.velocity({50, 0.5, 0.5}), Vec3(0, 0, 0));
}

TEST(VolumeFile, ErrorsNameFileGridAndRule) {
  TemporaryFolder folder;
  EXPECT_THAT(level_set_error(folder / "none.vdb"), AllOf(HasSubstr("none.vdb"), HasSubstr("cannot open")));
  EXPECT_THAT(level_set_error(folder.path()), HasSubstr("is a folder"));
  folder.write("text.vdb", "solid this is not a volume");
  EXPECT_THAT(level_set_error(folder / "text.vdb"), HasSubstr("is not an OpenVDB file"));
  folder.write("empty.vdb", "");
  EXPECT_THAT(level_set_error(folder / "empty.vdb"), HasSubstr("is not an OpenVDB file"));

  Points<double> x(1, 3);
  x << 0, 0, 0;
  vdb::write_density(folder / "smoke.vdb", x, Values<double>::Constant(1, 0.5), 0.1, x);
  EXPECT_THAT(level_set_error(folder / "smoke.vdb", "fog"), HasSubstr("has no grid \"fog\"; there are: density, v"));
  EXPECT_THAT(level_set_error(folder / "smoke.vdb", "density"),
              AllOf(HasSubstr("grid \"density\""), HasSubstr("must be a level set, got a fog volume")));
  EXPECT_THAT(level_set_error(folder / "smoke.vdb", "v"),
              AllOf(HasSubstr("grid \"v\""), HasSubstr("must be a level set of floats, got values of the type vec3s")));
  EXPECT_THAT(velocity_error(folder / "smoke.vdb", "density"), HasSubstr("must be a grid of float vectors"));
  vdb::write_surface_level_set(folder / "nothing.vdb", Points<double>(0, 3), Values<double>(0), 0.1);
  EXPECT_THAT(level_set_error(folder / "nothing.vdb"), AllOf(HasSubstr("\"surface\""), HasSubstr("no active voxels")));
}

TEST(VolumeFile, CutOffAnywhereItIsAnError) {
  TemporaryFolder folder;
  vdb::write_level_set(folder / "ball.vdb", ball({0, 0, 0}, 0.4, 0.05));
  const std::string whole = contents(folder / "ball.vdb");
  ASSERT_GT(whole.size(), 1000u);
  for (std::size_t length = 0; length < whole.size(); length += 1 + length / 20) {
    folder.write("cut.vdb", whole.substr(0, length));
    EXPECT_THAT(level_set_error(folder / "cut.vdb"), HasSubstr("cut.vdb: ")) << length << " bytes";
  }
}

TEST(VolumeFile, AFullDiskIsAnOutputError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder / "ball.part.vdb");
  EXPECT_THROW(vdb::write_level_set(folder / "ball.vdb", ball({0, 0, 0}, 0.4, 0.05)), OutputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "ball.vdb"));
  EXPECT_THROW(vdb::write_level_set(folder.path() / "none" / "ball.vdb", ball({0, 0, 0}, 0.4, 0.05)), OutputError);
}

}  // namespace
