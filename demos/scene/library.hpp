// Scenes by name: files that come with Hooke and scenes that are generated.
#pragma once

#include <scene/description.hpp>

#include <string>
#include <vector>

namespace hooke::scene {

struct NamedScene {
  std::string name, title;
};

/// All scenes that have a name, sorted; one whose file is broken has the error as its title.
std::vector<NamedScene> named_scenes();

/// A scene by path or by name. Throws hooke::Error, which lists the names where there is neither.
SceneDescription find_scene(const std::string& path_or_name);

/// S1: N × N points of equal mass, 1 m, 0.3 kg, structural 500, shear 100, bend 5 N/m, no damping,
/// first row pinned, tilted by 45°.
SceneDescription hanging_sheet(int n);

}  // namespace hooke::scene
