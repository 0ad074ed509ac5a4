// A simulated run as a film: what was kept of each frame, what it looks like, where it is
// seen from.
#pragma once

#include "particle_shot.hpp"
#include "pool.hpp"

#include <render/stage.hpp>
#include <scene/scene.hpp>

#include <string>
#include <vector>

namespace hooke::command {

/// What is kept of a frame until it is drawn.
struct Snapshot {
  double time = 0;  ///< shown [s]
  double simulate_ms = 0;
  double worst_stretch = 0;
  std::vector<Points<float>> points;           ///< one a soft body [m]
  std::vector<scene::ParticleView> particles;  ///< one a particle system
};

/// @param simulate_ms of this frame
Snapshot snapshot_of(const scene::Scene& scene, double simulate_ms);

/// The pictures of a run. Keeps a reference to the scene and the snapshots.
class Shot {
 public:
  Shot(const scene::Scene& scene, const std::vector<Snapshot>& snapshots, double aspect);

  /// The look for the whole shot.
  render::Look look() const;
  /// Draws one of the snapshots.
  render::Image draw(render::Stage& stage, std::size_t frame);
  /// The same with other lines in its caption.
  render::Image draw(render::Stage& stage, std::size_t frame, const std::vector<std::string>& lines);
  /// How the first body is moved, a line; empty where nothing moves.
  std::string solver() const;
  /// What making water's surfaces took, or nothing.
  std::string told() const;

 private:
  struct Drawn {
    TriangleMesh mesh;
    render::Material material;
    render::TextureCoordinates uv;
    double thickness = 0;
    int subdivisions = 0;
  };
  void add_body(const scene::SceneBody& body);
  void add_colliders();
  void find_bounds();
  void find_path();
  void choose_camera(double aspect);
  void place(std::size_t frame);
  render::Camera camera_at(std::size_t frame) const;
  std::vector<std::string> caption(std::size_t frame) const;
  std::vector<Shape> shapes_at(std::size_t collider, double shown_time) const;
  bool any(std::initializer_list<scene::Look> looks) const;
  void fill_pools(std::size_t frame);

  const scene::Scene& scene_;
  const std::vector<Snapshot>& snapshots_;
  std::vector<ParticleShot> particles_;   // one a particle system
  std::vector<Drawn> drawn_;              // bodies, humans, colliders
  std::vector<std::size_t> colliders_;    // those that are not humans
  std::vector<TriangleMesh> meshes_;      // of those, where they are level sets
  std::vector<Pool> pools_;               // colliders that are drawn as water
  std::vector<render::Material> waters_;  // theirs
  std::size_t pool_frame_ = 0;            // what the pools show
  std::size_t pictures_ = 0;              // drawn so far
  Vec3 lower_{0, 0, 0}, upper_{0, 0, 0};  // of everything in all frames
  double lift_ = 0;                       // [m], so that the floor of the scene is the floor of the stage
  std::vector<Vec3> path_;                // what the camera follows, one a frame
  render::Camera camera_;
  double mean_ms_ = 0;
};

}  // namespace hooke::command
