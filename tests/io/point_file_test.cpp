// Points as PLY and CSV, with whatever columns there are.
#include <hooke/error.hpp>
#include <hooke/io/point_file.hpp>
#include <io/temporary_folder.hpp>

#include <gtest/gtest.h>

#include <cstring>

namespace hooke::io {
namespace {

using test::contents;
using test::TemporaryFolder;

PointTable two() {
  PointTable points;
  points.positions.resize(2, 3);
  points.positions << 0.1, 2, 3, -4, 5, 6.5;
  points.velocities.resize(2, 3);
  points.velocities << 7, 8, 9, -10, 11, 12;
  points.ids = {3, 4000000000u};
  points.ages.resize(2);
  points.ages << 0.25, 0.5;
  points.radii.resize(2);
  points.radii << 0.01, 0.02;
  return points;
}

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);  // tests run on little-endian machines
  return value;
}

TEST(PointFile, PlyHasAllColumns) {
  TemporaryFolder folder;
  write_ply_points(folder / "p.ply", two());
  const std::string bytes = contents(folder / "p.ply");
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property float vx\nproperty float vy\nproperty float vz\nproperty uint id\nproperty float age\n"
      "property float radius\nend_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  ASSERT_EQ(bytes.size(), header.size() + 2 * 36);
  const std::size_t second = header.size() + 36;
  const float expected[] = {-4, 5, 6.5f, -10, 11, 12};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(number_at<float>(bytes, second + 4 * i), expected[i]);
  EXPECT_EQ(number_at<std::uint32_t>(bytes, second + 24), 4000000000u);
  EXPECT_EQ(number_at<float>(bytes, second + 28), 0.5f);
  EXPECT_EQ(number_at<float>(bytes, second + 32), 0.02f);
}

TEST(PointFile, ColumnsThatAreNotGivenAreLeftOut) {
  TemporaryFolder folder;
  PointTable points = two();
  points.velocities.resize(0, 3);
  points.ids.clear();
  points.ages.resize(0);
  write_ply_points(folder / "p.ply", points);
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property float radius\nend_header\n";
  EXPECT_EQ(contents(folder / "p.ply").substr(0, header.size()), header);
  EXPECT_EQ(contents(folder / "p.ply").size(), header.size() + 2 * 16);
  write_csv_points(folder / "p.csv", points);
  EXPECT_EQ(contents(folder / "p.csv"), "index,x,y,z,radius\n0,0.10000000000000001,2,3,0.01\n1,-4,5,6.5,0.02\n");
  write_ply_points(folder / "none.ply", {});
  EXPECT_NE(contents(folder / "none.ply").find("element vertex 0\n"), std::string::npos);
}

TEST(PointFile, CsvHasAllColumns) {
  TemporaryFolder folder;
  write_csv_points(folder / "p.csv", two());
  EXPECT_EQ(contents(folder / "p.csv"),
            "index,x,y,z,vx,vy,vz,id,age,radius\n"
            "0,0.10000000000000001,2,3,7,8,9,3,0.25,0.01\n"
            "1,-4,5,6.5,-10,11,12,4000000000,0.5,0.02\n");
}

TEST(PointFile, FramesAreNumbered) {
  EXPECT_EQ(frame_name("out", "sparks", 7, ".ply"), "out/sparks.0007.ply");
  EXPECT_EQ(frame_name("out", "sparks", 12345, ".vdb"), "out/sparks.12345.vdb");
}

TEST(PointFile, RefusesColumnsOfAnotherLength) {
  TemporaryFolder folder;
  PointTable points = two();
  points.radii.resize(3);
  EXPECT_THROW(write_ply_points(folder / "p.ply", points), std::invalid_argument);
  EXPECT_THROW(write_csv_points(folder / "p.csv", points), std::invalid_argument);
  EXPECT_THROW(write_csv_points(folder.path() / "none" / "p.csv", two()), OutputError);
}

}  // namespace
}  // namespace hooke::io
