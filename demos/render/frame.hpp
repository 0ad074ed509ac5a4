// What the passes over one picture share. Included by stage.cpp and effects.cpp only.
#pragma once

#include <render/camera.hpp>
#include <render/context.hpp>
#include <render/particles.hpp>
#include <render/stage.hpp>

namespace hooke::render {

/// A camera as the shaders use it.
struct View {
  Vec3 forward, ray_right, ray_up;  ///< forward + s ray_right + t ray_up spans the picture for s, t in [-1, 1]
  double near;                      ///< [m]
  Eigen::Matrix4f to_clip;
};

/// One picture on its way.
struct Frame {
  Camera camera;
  View view;
  Look look;
  int width, height, supersample;  ///< [pixels] as drawn, supersample of them a finished one
  GLuint normal_depth;             ///< how every pixel faces and how deep it is
  std::vector<Lamp> lamps;         ///< the light of sparks
};

/// Sets the uniforms of place_of_pixel() and the lights.
void set_pixels(gl::Program& program, const Frame& frame);
void set_lights(gl::Program& program, const Look& look);
void set_lamps(gl::Program& program, const std::vector<Lamp>& lamps);

/// Intensities of the studio's lights, linear RGB.
struct Lights {
  Vec3 key, rim, sky, ground;
};
Lights lights_of(const Look& look);

}  // namespace hooke::render
