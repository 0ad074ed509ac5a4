#include <scene/form.hpp>

#include <hooke/error.hpp>
#include <hooke/io/mesh_file.hpp>
#include <hooke/vdb/mesh_level_set.hpp>
#include <hooke/vdb/volume_file.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hooke::scene {

namespace {

constexpr int kAround = 128;
constexpr double kVoxelsASide = 128;

TriangleMesh turned(const LatheForm& lathe) {
  TriangleMesh mesh = turned_on_lathe(lathe.profile, kAround);
  const Mat3 turn = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitY(), lathe.axis).toRotationMatrix();
  mesh.vertices = (mesh.vertices.matrix() * turn.transpose()).array().eval();
  return mesh;
}

double longest_side(const TriangleMesh& mesh) {
  return (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).maxCoeff();
}

}  // namespace

TriangleMesh turned_on_lathe(const std::vector<std::array<double, 2>>& profile, int around) {
  std::vector<std::array<double, 2>> line = profile;
  const bool ring = line.front() == line.back() && line.front()[0] > 0;
  if (ring) line.pop_back();
  if (!ring && line.front()[0] > 0) line.insert(line.begin(), {0, line.front()[1]});
  if (!ring && line.back()[0] > 0) line.push_back({0, line.back()[1]});

  TriangleMesh mesh;
  std::vector<int> first;  // vertex of each point of the line
  int count = 0;
  for (const auto& [radius, height] : line) {
    first.push_back(count);
    count += radius > 0 ? around : 1;
  }
  mesh.vertices.resize(count, 3);
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto [radius, height] = line[i];
    if (radius == 0) mesh.vertices.row(first[i]) << 0, height, 0;
    for (int j = 0; radius > 0 && j < around; ++j) {
      const double turn = 2 * std::numbers::pi * j / around;
      mesh.vertices.row(first[i] + j) << radius * std::cos(turn), height, -radius * std::sin(turn);
    }
  }
  // Twice the area that the line encloses with the axis: its sign tells on which side the solid is.
  double area = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto &a = line[i], &b = line[(i + 1) % line.size()];
    area += a[0] * b[1] - b[0] * a[1];
  }
  const auto add = [&](int a, int b, int c) {
    if (area > 0) std::swap(b, c);
    mesh.triangles.push_back({a, b, c});
  };
  for (std::size_t i = 0; i + 1 < line.size() + std::size_t(ring); ++i) {
    const std::size_t next = (i + 1) % line.size();
    const bool here = line[i][0] > 0, there = line[next][0] > 0;
    for (int j = 0; j < around; ++j) {
      const int k = (j + 1) % around;
      const int a = first[i] + (here ? j : 0), b = first[i] + (here ? k : 0);
      const int c = first[next] + (there ? j : 0), d = first[next] + (there ? k : 0);
      if (here) add(a, c, b);
      if (there) add(b, c, d);
    }
  }
  return mesh;
}

Form make_form(const MovingForm& description) {
  if (const auto* volume = std::get_if<VolumeForm>(&description.form)) {
    Form form;
    form.grid = vdb::read_level_set(volume->file, volume->grid);
    form.mesh = std::make_shared<const TriangleMesh>(vdb::mesh_from_level_set(*form.grid));
    return form;
  }
  const auto* file = std::get_if<MeshForm>(&description.form);
  auto mesh = file ? io::read_obj(file->file) : turned(std::get<LatheForm>(description.form));
  const double voxel = description.voxel > 0 ? description.voxel : longest_side(mesh) / kVoxelsASide;
  return {vdb::level_set_from_mesh(mesh, voxel), std::make_shared<const TriangleMesh>(std::move(mesh))};
}

}  // namespace hooke::scene
