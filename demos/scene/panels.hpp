// Scenes that are shown side by side: the same scene with a few values changed, or several ones.
#pragma once

#include <scene/description.hpp>
#include <scene/library.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace hooke::scene {

/// What is measured in every frame of a panel and told in its caption.
enum class Figure { Speed, Stretch, Energy };

struct Panel {
  std::string title;
  SceneDescription scene;
  bool may_diverge = false;  ///< it is the point of the panel; otherwise it makes the run fail
};

/// All panels have the same duration and frame rate.
struct Panels {
  std::string file, title;
  int columns = 1;
  bool energy_curve = false;  ///< below each panel: total energy over time, the same scale in all
  std::vector<Figure> figures;
  std::vector<Panel> panels;  ///< by rows
};

/// Reads a file of panels; scene files that it names are looked up beside it and by name.
/// @throws hooke::Error "FILE: PATH: RULE, got VALUE", one line
Panels read_panels(const std::filesystem::path& path);

/// Panels by path or by the name of a file that comes with Hooke.
/// @throws hooke::Error as read_panels, and where there is no such file
Panels find_panels(const std::string& path_or_name);

/// All panels that have a name, sorted.
std::vector<NamedScene> named_panels();

}  // namespace hooke::scene
