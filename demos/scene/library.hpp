// Scenes by name: files that come with Hooke and the standard scenes.
#pragma once

#include <scene/standard.hpp>

#include <filesystem>
#include <functional>
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

/// Adds the files that come with Hooke in a folder beside the scenes, sorted; a broken one with its error as title.
void add_named_files(const std::string& subfolder,
                     const std::function<std::string(const std::filesystem::path&)>& title_of,
                     std::vector<NamedScene>& out);

/// Their names with commas between.
std::string names_of(const std::vector<NamedScene>& scenes);

/// The file of a scene that comes with Hooke; empty where there is none of that name.
std::filesystem::path scene_file(const std::string& name);

}  // namespace hooke::scene
