#include "exports.hpp"

#include <hooke/error.hpp>
#include <hooke/io/point_file.hpp>
#include <hooke/io/tables.hpp>
#include <hooke/vdb/particle_file.hpp>
#include <hooke/vdb/surface.hpp>

#include <set>

namespace hooke::command {

namespace {

// A name as part of a file name; different ones stay different.
std::string file_name(const std::string& name, std::set<std::string>& taken) {
  std::string out;
  for (const char c : name)
    out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ? c : '_';
  std::string unique = out.substr(0, 100);
  for (int i = 2; !taken.insert(unique).second; ++i) unique = out.substr(0, 100) + "-" + std::to_string(i);
  return unique;
}

constexpr double kVoxelsARadius = 2;  // of fog volumes and surfaces

bool for_meshes(const std::string& format) { return format == "obj" || format == "ply" || format == "pc2"; }
bool for_points(const std::string& format) { return format == "ply" || format == "csv" || format == "vdb"; }

}  // namespace

void check_export_format(const std::string& format) {
  if (!for_meshes(format) && !for_points(format))
    throw Error("--export must be one of obj, ply, pc2, csv, vdb, got " + format);
}

Exports::Exports(const std::string& format, const scene::Scene& scene) : scene_(scene), format_(format) {
  if (format.empty()) return;
  check_export_format(format);
  meshes_ = for_meshes(format) && !scene.bodies.empty();
  points_ = for_points(format) && !scene.particles.empty();
  if (!meshes_ && !points_ && for_points(format))
    throw Error("--export " + format + " is for particles, and the scene has none; use obj, ply or pc2");
  if (!meshes_ && !points_)
    throw Error("--export " + format + " is for soft bodies, and the scene has none; use ply, csv or vdb");
  if (!meshes_)
    for (const scene::SceneBody& body : scene.bodies)
      left_out_ += body.body->name() + ": not exported, " + format + " is for particles\n";
  if (!points_)
    for (const scene::SceneParticles& particles : scene.particles)
      left_out_ += particles.body().name() + ": not exported, " + format + " is for soft bodies\n";
}

void Exports::open(const std::filesystem::path& folder, std::int64_t frames) {
  folder_ = folder;
  std::set<std::string> taken;
  if (meshes_)
    for (const scene::SceneBody& body : scene_.bodies)
      caches_.push_back(io::make_mesh_cache(io::cache_format_named(format_), folder_,
                                            file_name(body.body->name(), taken), body.triangles));
  if (points_)
    for (const scene::SceneParticles& particles : scene_.particles)
      names_.push_back(file_name(particles.body().name(), taken));
  frame_ = frames;
  for (std::size_t i = 0; i < caches_.size() && frames > 0; ++i)
    caches_[i]->resume(Index(frames), scene_.bodies[i].body->size());
}

void Exports::sync() {
  for (const auto& cache : caches_) cache->sync();
}

void Exports::add() {
  for (std::size_t i = 0; i < caches_.size(); ++i) caches_[i]->add(scene_.bodies[i].body->positions());
  for (std::size_t i = 0; i < names_.size(); ++i) write(scene_.particles[i], names_[i]);
  ++frame_;
}

void Exports::finish() {
  for (const auto& cache : caches_) cache->finish();
}

void Exports::write(const scene::SceneParticles& particles, const std::string& name) const {
  const std::filesystem::path path = io::frame_name(folder_, name, frame_, "." + format_);
  const scene::ParticleView view = particles.view();
  const Points<double> positions = particles.body().positions(), velocities = particles.body().velocities();
  if (format_ == "vdb") {
    vdb::PointColumns columns;
    columns.velocities = velocities;
    columns.radii = view.radii.cast<double>();
    columns.ids.assign(view.serials.begin(), view.serials.end());
    vdb::write_points(path, positions, columns);
    return write_volumes(particles, view, name);
  }
  io::PointTable table;
  table.positions = positions, table.velocities = velocities;
  for (const std::uint64_t serial : view.serials) table.ids.push_back(std::uint32_t(serial));
  table.ages = view.ages.cast<double>();
  table.radii = view.radii.cast<double>();
  if (format_ == "ply")
    io::write_ply_points(path, table);
  else
    io::write_csv_points(path, table);
}

void Exports::write_volumes(const scene::SceneParticles& particles, const scene::ParticleView& view,
                            const std::string& name) const {
  const Points<double> positions = particles.body().positions(), velocities = particles.body().velocities();
  std::set<std::string> taken;
  for (std::size_t k = 0; k < particles.kinds().size(); ++k) {
    const scene::ParticleKind& kind = particles.kinds()[k];
    const std::string kind_name = file_name(kind.name, taken);
    if (kind.look != scene::Look::Smoke && kind.look != scene::Look::Water) continue;
    std::vector<Index> rows;
    for (Index i = 0; i < positions.rows(); ++i)
      if (view.kinds[std::size_t(i)] == int(k) && view.radii[i] > 0) rows.push_back(i);
    if (rows.empty()) continue;
    const Values<double> radii = view.radii(rows).cast<double>();
    const double voxel = radii.mean() / kVoxelsARadius;
    const std::filesystem::path path = io::frame_name(folder_, name + "." + kind_name, frame_, ".vdb");
    if (kind.look == scene::Look::Smoke)
      vdb::write_density(path, positions(rows, Eigen::all), radii, voxel, velocities(rows, Eigen::all));
    else
      vdb::write_surface_level_set(path, positions(rows, Eigen::all), radii, voxel);
  }
}

CountsTable::CountsTable(const std::filesystem::path& path, std::int64_t keep)
    : file_(keep < 0 ? io::OutputFile(path, io::OutputFile::Leftover::Keep)
                     : io::OutputFile(path, io::OutputFile::Leftover::Keep, keep)) {
  if (keep < 0) file_.write("time,body,alive,born,died,refused,displaced,impacts\n");
}

void CountsTable::add(const scene::Scene& scene) {
  for (const scene::SceneParticles& particles : scene.particles) {
    const particles::Counts& counts = particles.counts();
    file_.write(io::text_of(scene.shown_time()) + "," + io::csv_field(particles.body().name()));
    for (const std::int64_t count : {std::int64_t(particles.body().size()), counts.born, counts.died, counts.refused,
                                     counts.displaced, counts.impacts})
      file_.write("," + std::to_string(count));
    file_.write("\n");
  }
  file_.flush();
}

}  // namespace hooke::command
