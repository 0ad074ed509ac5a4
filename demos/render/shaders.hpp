// The GLSL sources of the studio, one pair a pass. What each pass does is described in
// stage.cpp; how light is computed is described here, beside the formulas.
#pragma once

#include <string>

namespace hooke::render {

inline constexpr int kDomeDirections = 28;  ///< parallel lights that stand for light from all around
inline constexpr int kDomeUpward = 20;      ///< of these, the first so many shine from above
inline constexpr int kDomeColumns = 7;      ///< tiles side by side in the dome's depth map

/// What the lit pass is compiled for.
enum class Shade { Floor, Matte, Cloth };

std::string depth_vertex_shader();
std::string depth_fragment_shader();
std::string surface_vertex_shader();
std::string floor_vertex_shader();
std::string prepass_fragment_shader();
std::string full_screen_vertex_shader();
std::string visibility_fragment_shader();
std::string blur_fragment_shader();
std::string lit_fragment_shader(Shade shade);
std::string develop_fragment_shader();

}  // namespace hooke::render
