// Standing water as it is drawn: ripples and foam where drops fall in.
#pragma once

#include <hooke/shapes.hpp>
#include <scene/particles.hpp>

#include <span>
#include <vector>

namespace hooke::command {

/// The upper surface of a level set that is drawn as water. Its waves are for the eye alone: they follow the wave
/// equation, nothing collides with them.
class Pool {
 public:
  explicit Pool(const LevelSet& body);

  /// Lets `seconds` go by, in which the drops of a frame's systems that are about to reach the surface fall in.
  /// @param kinds of each system  Cost: cells of the surface, and drops.
  void advance(std::span<const scene::ParticleView> drops, std::span<const std::vector<scene::ParticleKind>> kinds,
               double seconds);

  void calm();  ///< as at first: no waves, no foam

  const TriangleMesh& mesh() const { return mesh_; }   ///< an open sheet [m]
  const Values<float>& foam() const { return foam_; }  ///< by vertex, in [0, 1]

 private:
  double& at(std::vector<double>& field, int i, int j) const { return field[std::size_t(j * across_ + i)]; }
  void fall_in(const Vec3& place, double momentum);
  void ripple(double seconds);

  LevelSet body_;
  double level_ = 0;              // of the calm surface [m]
  double low_x_ = 0, low_z_ = 0;  // of the first cell [m]
  int across_ = 0, along_ = 0;
  std::vector<bool> wet_;
  std::vector<double> height_, speed_, lather_;  // [m], [m/s], amount of foam
  TriangleMesh mesh_;
  Values<float> foam_;
};

}  // namespace hooke::command
