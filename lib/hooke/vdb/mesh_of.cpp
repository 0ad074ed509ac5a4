#include <hooke/vdb/grids.hpp>

#include <openvdb/tools/VolumeToMesh.h>
#include <Eigen/Geometry>

namespace hooke::vdb {

namespace {

void orient_outward(TriangleMesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices.row(t[0]).matrix();
    const Vec3 b = mesh.vertices.row(t[1]).matrix();
    const Vec3 c = mesh.vertices.row(t[2]).matrix();
    volume += a.dot(b.cross(c)) / 6;
  }
  if (volume < 0)
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace

TriangleMesh mesh_of(const openvdb::FloatGrid& grid) {
  openvdb::tools::VolumeToMesh mesher(0.0, 0.0);
  mesher(grid);
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Index>(mesher.pointListSize()), 3);
  for (std::size_t v = 0; v < mesher.pointListSize(); ++v)
    for (int c = 0; c < 3; ++c) mesh.vertices(static_cast<Index>(v), c) = mesher.pointList()[v][c];
  const auto point = [&](unsigned v) -> Vec3 { return mesh.vertices.row(v).matrix(); };
  for (std::size_t p = 0; p < mesher.polygonPoolListSize(); ++p) {
    const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[p];
    for (std::size_t i = 0; i < pool.numTriangles(); ++i) {
      const openvdb::Vec3I& t = pool.triangle(i);
      mesh.triangles.push_back({int(t[0]), int(t[1]), int(t[2])});
    }
    for (std::size_t i = 0; i < pool.numQuads(); ++i) {
      const openvdb::Vec4I& q = pool.quad(i);
      const bool along_02 = (point(q[0]) - point(q[2])).squaredNorm() <= (point(q[1]) - point(q[3])).squaredNorm();
      const int s = along_02 ? 0 : 1;
      mesh.triangles.push_back({int(q[s]), int(q[s + 1]), int(q[s + 2])});
      mesh.triangles.push_back({int(q[s]), int(q[s + 2]), int(q[(s + 3) % 4])});
    }
  }
  orient_outward(mesh);
  return mesh;
}

}  // namespace hooke::vdb
