#include <hooke/vdb/mesh_level_set.hpp>

#include <hooke/vdb/grids.hpp>

#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace hooke::vdb {

namespace {

constexpr float kBand = 3;      // [voxels]
constexpr int kMargin = 4;      // [voxels] around the mesh
constexpr int kBeyondBand = 2;  // [voxels] around the active ones, which is at least kMargin around the mesh

[[noreturn]] void refuse(const std::string& rule) { throw std::invalid_argument("level_set_from_mesh: " + rule); }

// For each vertex the first that is at the same place.
std::vector<int> welded(const Points<double>& x) {
  std::vector<int> order(static_cast<std::size_t>(x.rows())), out(order.size());
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&](int a, int b) {
    for (int k = 0; k < 3; ++k)
      if (x(a, k) != x(b, k)) return x(a, k) < x(b, k);
    return a < b;
  };
  std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && (x.row(order[i]) == x.row(order[i - 1])).all();
    out[std::size_t(order[i])] = same ? out[std::size_t(order[i - 1])] : order[i];
  }
  return out;
}

// Edges that belong to an odd number of triangles.
std::size_t open_edges(const std::vector<openvdb::Vec3I>& triangles) {
  std::vector<std::pair<unsigned, unsigned>> edges;
  edges.reserve(3 * triangles.size());
  for (const openvdb::Vec3I& t : triangles)
    for (int e = 0; e < 3; ++e) edges.push_back(std::minmax({t[e], t[(e + 1) % 3]}));
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  for (std::size_t i = 0, next; i < edges.size(); i = next) {
    for (next = i; next < edges.size() && edges[next] == edges[i];) ++next;
    open += (next - i) % 2;
  }
  return open;
}

}  // namespace

std::shared_ptr<const DistanceGrid> level_set_from_mesh(const TriangleMesh& mesh, double voxel) {
  if (!(voxel > 0) || !std::isfinite(voxel)) refuse("voxel must be positive, got " + std::to_string(voxel) + " m");
  if (mesh.vertices.rows() == 0 || mesh.triangles.empty()) refuse("the mesh has no triangles");
  for (Index i = 0; i < mesh.vertices.rows(); ++i)
    if (!mesh.vertices.row(i).allFinite()) refuse("vertex " + std::to_string(i) + " is not finite");
  const std::vector<int> same = welded(mesh.vertices);
  std::vector<openvdb::Vec3I> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    std::array<int, 3> t = mesh.triangles[i];
    for (int& corner : t) {
      if (corner < 0 || corner >= int(same.size()))
        refuse("triangle " + std::to_string(i) + ": vertex " + std::to_string(corner) + " is not below the count " +
               std::to_string(same.size()));
      corner = same[std::size_t(corner)];
    }
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
      triangles.emplace_back(unsigned(t[0]), unsigned(t[1]), unsigned(t[2]));
  }
  if (triangles.empty()) refuse("the mesh has no triangles");
  if (const std::size_t open = open_edges(triangles))
    refuse("the mesh must be closed, got " + std::to_string(open) + " open edges");

  // The mesh relative to its corner, in voxels, so that its place in the world costs no digits.
  const Vec3 low = mesh.vertices.colwise().minCoeff().matrix().transpose();
  const Vec3 size = mesh.vertices.colwise().maxCoeff().matrix().transpose() - low;
  double voxels = 1;
  for (int k = 0; k < 3; ++k) voxels *= size[k] / voxel + 2 * kMargin + 3;
  if (!(voxels <= kMostVoxels))
    refuse("must be at most 2^28 voxels, got " + std::to_string(voxels) + "; take larger ones");
  const Vec3 corner = low.array() - 0.5 * voxel;  // no sample on the flat sides of a box
  openvdb::initialize();
  std::vector<openvdb::Vec3s> points(std::size_t(mesh.vertices.rows()));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k) points[i][k] = float(mesh.vertices(Index(i), k) - corner[k]);
  const auto grid = openvdb::tools::meshToSignedDistanceField<openvdb::FloatGrid>(*transform_of(voxel, Vec3::Zero()),
                                                                                  points, triangles, {}, kBand, kBand);
  const DistanceGrid dense = densify(*grid, kBeyondBand, "level_set_from_mesh");
  return std::make_shared<const DistanceGrid>(dense.lower() + corner, voxel, dense.counts(), dense.values());
}

TriangleMesh mesh_from_level_set(const DistanceGrid& distances) { return mesh_of(*narrow_band(distances)); }

}  // namespace hooke::vdb
