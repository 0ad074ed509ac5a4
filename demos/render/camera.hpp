// Where the picture is taken from, and how to choose that place for a subject.
#pragma once

#include <hooke/types.hpp>

namespace hooke::render {

/// A pinhole camera.
struct Camera {
  Vec3 eye{0, 1.3, 5};               ///< [m]
  Vec3 target{0, 0.9, 0};            ///< the point in the middle of the picture [m], not the eye
  Vec3 up{0, 1, 0};                  ///< not parallel to the line of sight; need not be unit
  double vertical_fov_degrees = 30;  ///< full angle of view from bottom to top, in (0, 180)
};

/// The camera that sees the whole box [lower, upper] [m] from as near as it can, looking
/// along `view_direction` (any length, not vertical) at the middle of the box.
/// `aspect` is picture width / height; `margin` is the share of the picture left free on
/// each side, in [0, 0.5). Throws std::invalid_argument if an argument breaks its rule.
Camera frame_subject(const Vec3& lower, const Vec3& upper, const Vec3& view_direction, double vertical_fov_degrees,
                     double aspect, double margin = 0.08);

}  // namespace hooke::render
