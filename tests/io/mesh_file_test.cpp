#include <hooke/error.hpp>
#include <hooke/io/mesh_cache.hpp>
#include <hooke/io/mesh_file.hpp>
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

namespace hooke::io {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

TEST(ObjFile, ComesBackBitwiseAsItWasWritten) {
  TemporaryFolder folder;
  Points<double> vertices(5, 3);
  vertices << 0.1, 1.0 / 3, -2e-17, 1, 0, 0, 0, 1, 0, 1e6 + 1e-9, 1, 2, 7, 8, 9;  // the last is in no face
  const std::vector<Triangle> triangles{{0, 1, 2}, {3, 2, 1}};
  write_obj(folder / "mesh.obj", vertices, triangles);
  const TriangleMesh mesh = read_obj(folder / "mesh.obj");
  EXPECT_EQ(mesh.triangles, triangles);
  ASSERT_EQ(mesh.vertices.rows(), 5);
  EXPECT_TRUE((mesh.vertices == vertices).all());
}

TEST(ObjFile, CutsPolygonsIntoTrianglesAndKeepsTheVertexOrder) {
  TemporaryFolder folder;
  const TriangleMesh mesh = read_obj(folder.write("quad.obj",
                                                  "# a quad\r\no quad\r\nv 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\n"
                                                  "vn 0 0 1\r\nf 1//1 2//1 3//1 -1//1\r\n"));
  ASSERT_EQ(mesh.vertices.rows(), 4);
  EXPECT_EQ(mesh.vertices(2, 0), 1);
  EXPECT_EQ(mesh.vertices(2, 1), 1);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto at = [&](int i) { return Eigen::Vector2d(mesh.vertices(i, 0), mesh.vertices(i, 1)); };
    const Eigen::Vector2d u = at(t[1]) - at(t[0]), v = at(t[2]) - at(t[0]);
    area += 0.5 * (u.x() * v.y() - u.y() * v.x());
  }
  EXPECT_NEAR(area, 1, 1e-12);
}

TEST(ObjFile, BrokenFilesAreToldWithNameLineAndRule) {
  TemporaryFolder folder;
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "without vertices"},
      {"hello, this is no mesh\n", "without vertices"},
      {"f 1 2 3\n", "line 1: vertex index 1"},
      {corners, "has no faces"},
      {corners + "f 1 2 9\n", "line 4: vertex index 9 is not one of the 3"},
      {corners + "f 1 2 0\n", "vertex index 0"},
      {corners + "f 1 2 -4\n", "vertex index -4"},
      {corners + "f 1 2\n", "line 4: a face needs at least three corners, got 2"},
      {corners + "f 1 2 x\n", "must be a vertex index, got \"x\""},
      {"v 0 0 nan\n" + corners + "f 1 2 3\n", "line 1: a coordinate must be a finite number, got \"nan\""},
      {"v 0 inf 0\n" + corners + "f 1 2 3\n", "got \"inf\""},
      {"v 0 1e999 0\n" + corners + "f 1 2 3\n", "finite"},
      {corners + "v 0 0", "line 4: a vertex needs three coordinates, got 2"},
      {corners + "f 1 2 99999999999999999999\n", "vertex index"},
      {std::string("v 0 0 0\0\n", 9), "bytes of 0"},
  };
  for (const auto& [text, rule] : cases) {
    const auto path = folder.write("broken.obj", text);
    try {
      read_obj(path);
      ADD_FAILURE() << "read without complaint:\n" << text;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(rule)) << text;
      EXPECT_THAT(error.what(), HasSubstr("broken.obj"));
      EXPECT_THAT(error.what(), ::testing::Not(HasSubstr("\n")));
    }
  }
}

TEST(ObjFile, MissingFilesAndFoldersAreErrors) {
  TemporaryFolder folder;
  EXPECT_THROW(read_obj(folder / "none.obj"), Error);
  EXPECT_THROW(read_obj(folder.path()), Error);
}

TEST(ObjFile, AnyCutOfAFileIsReadOrRefusedButNeverWrong) {
  TemporaryFolder folder;
  const std::string whole = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 3 2 4\n";
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const auto path = folder.write("cut.obj", whole.substr(0, length));
    try {
      const TriangleMesh mesh = read_obj(path);
      for (const Triangle& t : mesh.triangles)
        for (const int corner : t) EXPECT_LT(corner, mesh.vertices.rows());
    } catch (const Error&) {
    }
  }
}

}  // namespace
}  // namespace hooke::io
