// The GLSL sources of the studio, one pair a pass. What each pass does is described in
// stage.cpp; how light is computed is described here, beside the formulas.
#pragma once

#include <string>

namespace hooke::render {

inline constexpr int kDomeDirections = 28;  ///< parallel lights that stand for light from all around
inline constexpr int kDomeUpward = 20;      ///< of these, the first so many shine from above
inline constexpr int kDomeColumns = 7;      ///< tiles side by side in the dome's depth map

/// What the lit pass is compiled for.
enum class Shade { Floor, Matte, Cloth, Stone, Metal };
inline constexpr int kShades = 5;
inline constexpr int kMostLamps = 16;  ///< small lights that stand for sparks

std::string depth_vertex_shader();
std::string depth_fragment_shader();
std::string surface_vertex_shader();
std::string floor_vertex_shader();
std::string prepass_fragment_shader();
std::string full_screen_vertex_shader();
std::string visibility_fragment_shader();
std::string blur_fragment_shader();
/// `lamps`: with the light of sparks.
/// `jelly`: with the colour of light that went through jelly.
std::string lit_fragment_shader(Shade shade, bool lamps, bool jelly);
/// `veil`, `glow`: with smoke and drops, with sparks over the solid picture.
std::string develop_fragment_shader(bool veil, bool glow);

/// GLSL functions: where the surface under a pixel is; what a mirror shows of the studio.
std::string place_of_pixel();
std::string studio_functions();

std::string streak_vertex_shader();
std::string streak_fragment_shader();
std::string sprite_vertex_shader();
std::string puff_fragment_shader();
std::string drop_fragment_shader();
std::string narrow_fragment_shader();
std::string widen_fragment_shader();
std::string resolve_fragment_shader();
std::string water_fragment_shader();
std::string tint_fragment_shader();
std::string jelly_fragment_shader();

}  // namespace hooke::render
