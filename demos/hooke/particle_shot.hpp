// Particles of a scene as the renderer draws them: one group a kind, and water as a surface.
#pragma once

#include <render/stage.hpp>
#include <scene/particles.hpp>

#include <span>
#include <vector>

namespace hooke::command {

/// The particles of one system, ready to draw.
class ParticleShot {
 public:
  /// @param shutter how long it is open [s]
  ParticleShot(const std::vector<scene::ParticleKind>& kinds, double shutter);

  /// @param lift [m] that everything is raised by
  void place(const scene::ParticleView& view, double lift);
  /// Appends what place() was given; it lives until the next place().
  void append(std::vector<render::Particles>& out) const;
  /// The same for the surfaces of kinds that look like water.
  void append(std::vector<render::Model>& out) const;
  /// How long making surfaces took in all [s].
  double meshing_seconds() const { return meshing_seconds_; }

 private:
  struct Group {
    Points<float> positions, velocities, colors;
    Values<float> radii, ages, opacities, turns;
    TriangleMesh surface;
  };
  void make_surface(Group& group);
  Vec3 color(std::size_t kind, float life, const Vec3& ramp) const;

  std::vector<scene::ParticleKind> kinds_;
  std::vector<std::vector<Vec3>> glow_;  // by kind and life, where it is given by temperature
  double shutter_;
  std::vector<Group> groups_;  // by kind
  double meshing_seconds_ = 0;
};

}  // namespace hooke::command
