// The scenes of the hard cases, each defined once for table, tests and hashes.
#pragma once

#include <scene/standard.hpp>

namespace hooke::stability {

scene::SceneDescription empty_scene(const std::string& name, double duration);
scene::SoftBody& add_body(scene::SceneDescription& d, const std::string& name, scene::RawPoints form);
void add_collider(scene::SceneDescription& d, const std::string& name, const Shape& shape, double friction = 0.3);

/// The points and springs that a scene's first body is made of, to be changed; relative to its origin.
scene::RawPoints points_of(const scene::SceneDescription& d);

/// Ten links of 0.1 m and 0.1 kg hang straight down, the last point `ratio` times heavier; springs so stiff
/// that the uppermost gives by a tenth of its length. Damped to rest (99 % of speed a second).
scene::SceneDescription heavy_chain(double ratio);

/// 8 × 8 points, 1 m, hang straight down from their first row, the last point `ratio` times heavier; springs
/// so stiff that one column would give by a tenth. Damped as the chain.
scene::SceneDescription heavy_sheet(double ratio);

/// The hanging sheet with its last, free corner `ratio` times as heavy as a point and springs `stiffness`
/// times as stiff.
scene::SceneDescription hard_sheet(int n, double stiffness, double ratio);

/// A square metre of one cloth, pinned along two opposite edges, level at the start; damped to rest.
scene::SceneDescription hammock(int n);

/// The classical cube of springs: `count`³ points, 0.2 m, 1 kg, one stiffness [N/m] and the default damping, its
/// lowest points at `height`, centred over the origin.
scene::RawPoints jelly(int count, double height, double stiffness = 2000);

/// Scenes whose state is compared bit by bit: springs with dampers, which no vector kernel moves, and no function
/// of the mathematics library but roots.
std::vector<scene::SceneDescription> hashed_scenes();

}  // namespace hooke::stability
