// Solids of any form: what becomes a level set, and the mesh that is drawn for it.
#pragma once

#include <hooke/distance_grid.hpp>
#include <scene/description.hpp>

#include <array>
#include <memory>
#include <vector>

namespace hooke::scene {

/// A solid of revolution about the y axis, counter-clockwise from outside. A profile that begins or ends off the
/// axis is closed by a flat disc; one that ends where it began is a ring.
/// @param profile at least two (radius, height) [m], in order along the surface; radius >= 0, on the axis only at
/// the ends @param around corners of a circle, >= 3
TriangleMesh turned_on_lathe(const std::vector<std::array<double, 2>>& profile, int around);

/// A solid as it is collided with, and as it is drawn.
struct Form {
  std::shared_ptr<const DistanceGrid> grid;
  std::shared_ptr<const TriangleMesh> mesh;
};

/// Reads or makes it. Throws hooke::Error or std::invalid_argument with file and rule.
Form make_form(const MovingForm& description);

}  // namespace hooke::scene
