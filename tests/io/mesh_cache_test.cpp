#include <hooke/error.hpp>
#include <hooke/io/mesh_cache.hpp>
#include <hooke/io/mesh_file.hpp>
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <bit>
#include <cstring>

namespace hooke::io {
namespace {

using test::contents;
using test::TemporaryFolder;

const std::vector<Triangle> kTriangles{{0, 1, 2}, {2, 1, 3}};

Points<double> sample(double t) {
  Points<double> x(4, 3);
  x << 0, 0, t, 1, 0, t, 0, 1, t, 1, 1, 2 * t;
  return x;
}

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes.at(at + std::size_t(i)));
  return value;
}

float float_at(const std::string& bytes, std::size_t at) { return std::bit_cast<float>(number_at(bytes, at)); }

void expect_point_cache(const std::string& bytes, std::uint32_t samples) {
  ASSERT_EQ(bytes.size(), 32 + samples * 4 * 12);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(number_at(bytes, 12), 1u);
  EXPECT_EQ(number_at(bytes, 16), 4u);
  EXPECT_EQ(float_at(bytes, 20), 0.0f);
  EXPECT_EQ(float_at(bytes, 24), 1.0f);
  EXPECT_EQ(number_at(bytes, 28), samples);
  for (std::uint32_t s = 0; s < samples; ++s)
    for (Index i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k)
        EXPECT_EQ(float_at(bytes, 32 + s * 48 + std::size_t(i) * 12 + std::size_t(k) * 4),
                  float(sample(0.1 * s)(i, k)));
}

TEST(PointCache, HeaderAndSamplesAreWhatThePlayerExpects) {
  TemporaryFolder folder;
  const auto cache = make_mesh_cache(CacheFormat::Pc2, folder.path(), "cloth", kTriangles);
  for (int i = 0; i < 3; ++i) cache->add(sample(0.1 * i));
  cache->finish();
  expect_point_cache(contents(folder / "cloth.pc2"), 3);
  EXPECT_EQ(read_obj(folder / "cloth.obj").triangles, kTriangles);
}

TEST(PointCache, CutOffAnywhereTheHeaderHasTheRightCount) {
  TemporaryFolder folder;
  {
    const auto cache = make_mesh_cache(CacheFormat::Pc2, folder.path(), "cloth", kTriangles);
    for (std::uint32_t i = 0; i < 3; ++i) {
      cache->add(sample(0.1 * i));
      expect_point_cache(contents(folder / "cloth.part.pc2"), i + 1);
    }
  }  // no finish()
  expect_point_cache(contents(folder / "cloth.part.pc2"), 3);
}

TEST(MeshCache, ASequenceHasOneCompleteFileASample) {
  TemporaryFolder folder;
  const auto cache = make_mesh_cache(CacheFormat::Obj, folder.path(), "cloth", kTriangles);
  cache->add(sample(0));
  cache->add(sample(0.5));
  const TriangleMesh mesh = read_obj(folder / "cloth.0001.obj");
  EXPECT_EQ(mesh.triangles, kTriangles);
  EXPECT_TRUE((mesh.vertices == sample(0.5)).all());
  EXPECT_THROW(cache->add(Points<double>::Zero(3, 3)), std::invalid_argument);
}

TEST(MeshCache, PlyIsBinaryLittleEndianWithItsFaces) {
  TemporaryFolder folder;
  make_mesh_cache(CacheFormat::Ply, folder.path(), "cloth", kTriangles)->add(sample(0.25));
  const std::string bytes = contents(folder / "cloth.0000.ply");
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  ASSERT_EQ(bytes.substr(0, header.size()), header);
  ASSERT_EQ(bytes.size(), header.size() + 4 * 12 + 2 * 13);
  EXPECT_EQ(float_at(bytes, header.size() + 3 * 12 + 8), 0.5f);
  const std::size_t face = header.size() + 48 + 13;
  EXPECT_EQ(bytes[face], 3);
  EXPECT_EQ(number_at(bytes, face + 1), 2u);
  EXPECT_EQ(number_at(bytes, face + 9), 3u);
}

TEST(MeshCache, AFullDiskIsAnOutputError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  TemporaryFolder folder;
  for (const char* name : {"cloth.0000.part.obj", "cloth.0000.part.ply", "cloth.part.pc2"})
    std::filesystem::create_symlink("/dev/full", folder / name);
  for (const CacheFormat format : {CacheFormat::Obj, CacheFormat::Ply, CacheFormat::Pc2})
    EXPECT_THROW(make_mesh_cache(format, folder.path(), "cloth", kTriangles)->add(sample(0)), OutputError);
  EXPECT_THROW(cache_format_named("fbx"), Error);
}

}  // namespace
}  // namespace hooke::io
