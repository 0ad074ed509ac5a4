// What simulate writes beside the tables of all points: moving meshes, particles, and their counts.
#pragma once

#include <hooke/io/mesh_cache.hpp>
#include <hooke/io/output_file.hpp>
#include <scene/scene.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace hooke::command {

/// Throws hooke::Error unless `format` is obj, ply, pc2, csv or vdb.
void check_export_format(const std::string& format);

/// Soft bodies as obj, ply or pc2; particles as one file a frame: ply, csv or vdb. As vdb smoke is also written as
/// a fog volume and water as the level set of its surface.
class Exports {
 public:
  /// @param format empty: nothing is written
  /// @throws hooke::Error where no body of the scene can be written so
  Exports(const std::string& format, const scene::Scene& scene);

  /// Begins the files, or goes on after the first `frames` frames of an earlier run. `folder` must exist.
  /// Throws hooke::OutputError, as do the others, and hooke::Error where those frames are not there.
  void open(const std::filesystem::path& folder, std::int64_t frames);
  void add();
  void sync();
  void finish();
  /// Bodies that are left out, a line each.
  const std::string& left_out() const { return left_out_; }

 private:
  void write(const scene::SceneParticles& particles, const std::string& name) const;
  void write_volumes(const scene::SceneParticles& particles, const scene::ParticleView& view,
                     const std::string& name) const;

  const scene::Scene& scene_;
  std::string format_, left_out_;
  bool meshes_ = false, points_ = false;
  std::filesystem::path folder_;
  std::vector<std::string> names_;  // of particles, as file names
  std::vector<std::unique_ptr<io::MeshCache>> caches_;
  std::int64_t frame_ = 0;
};

/// particles.csv: a row a frame and particle system. What was written stays readable when a run is cut off.
class CountsTable {
 public:
  /// @param keep bytes of an earlier run's table after which this one goes on; < 0: a new one
  CountsTable(const std::filesystem::path& path, std::int64_t keep);
  void add(const scene::Scene& scene);
  std::int64_t sync() { return file_.sync(), file_.size(); }
  void finish() { file_.commit(); }

 private:
  io::OutputFile file_;
};

}  // namespace hooke::command
