// What lies over the solid picture: puffs and drops in a veil, sparks and their glow.
#pragma once

#include <render/frame.hpp>

#include <span>
#include <vector>

namespace hooke::render {

/// The passes that draw particles. Made when the first particle is; needs the context of
/// its studio to be current.
class Effects {
 public:
  /// Sizes as drawn, with supersampling.
  Effects(int width, int height);

  /// Draws smoke and drops, the farthest first, into veil(). `scene` is the picture behind
  /// them. Returns false, and leaves the veil alone, if there are none.
  bool draw_veil(const Frame& frame, std::span<const Particles> particles, GLuint scene);
  /// Draws sparks into glow() and what a lens spreads of them into bloom(). Returns false
  /// if there are none.
  bool draw_glow(const Frame& frame, std::span<const Particles> particles);

  GLuint veil() const { return veil_; }            ///< light, and in alpha what it lets through
  GLuint glow() const { return glow_; }            ///< light of the sparks
  GLuint bloom() const { return levels_[0].map; }  ///< the same light, spread; half the size

 private:
  struct Level {
    GLuint map, target;
    int width, height;
  };
  void spread(const Frame& frame);

  gl::Program streaks_, puffs_, drops_, narrow_, widen_;
  GLuint empty_array_ = 0, array_ = 0, buffer_ = 0;
  GLuint veil_ = 0, veil_target_ = 0, glow_ = 0, glow_target_ = 0;
  GLuint puff_map_ = 0;
  std::vector<Level> levels_;
};

}  // namespace hooke::render
