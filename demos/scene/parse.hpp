// From JSON text to a SceneDescription.
#pragma once

#include <scene/description.hpp>

#include <filesystem>
#include <string>

namespace hooke::scene {

/// Parses a scene. Files that it names are looked up relative to `folder` and not opened yet.
/// @param file what messages call the text
/// @throws hooke::Error "FILE: PATH: RULE, got VALUE", one line, e.g.
///         "cape.json: bodies[0].springs[3].points[1]: must be below the point count 4, got 9"
SceneDescription parse_scene(const std::string& text, const std::string& file,
                             const std::filesystem::path& folder = ".");

/// Reads and parses a scene file.
SceneDescription read_scene(const std::filesystem::path& path);

/// Upper bound of the points of one body: a typing error in a count must not fill the memory.
constexpr Index kMostPoints = 4'000'000;

}  // namespace hooke::scene
