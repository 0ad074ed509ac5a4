// The standard scenes, each defined once: demo, test, benchmark and report all use these.
#pragma once

#include <hooke/world.hpp>
#include <scene/description.hpp>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hooke::scene {

/// A scene with a question that has an answer: where are the points after `duration`?
struct StandardScene {
  std::string name, title;
  std::string problem;  ///< what moves and why it is asked, a few sentences

  double duration = 1;  ///< [s]; within the time in which a disturbance stays small, where points are compared
  int ticks = 1;        ///< that the duration is cut into; no step can be longer than a tick

  enum class Compare {
    Points,     ///< every point with the same point of the reference
    Statistics  ///< centre of mass and spread: contacts make single points chaotic
  };
  Compare compare = Compare::Points;
  bool conservative = true;  ///< the total energy is constant
  bool free = false;         ///< nothing but gravity acts from outside: momentum is known at any time
  bool large = false;        ///< takes minutes to do with care

  /// A world of `ticks` ticks in `duration`, every body moved by this solver.
  /// @throws std::invalid_argument or hooke::Error where the solver does not accept the scene
  std::function<World(const Solver&)> build;

  /// Positions of all points of all bodies at a time [s], in closed form; empty where there is none.
  std::function<Points<double>(double t)> exact;

  /// The same as a scene description; absent where a scene file cannot say it.
  std::optional<SceneDescription> description;
};

/// All of them, from one point to many.
std::vector<StandardScene> standard_scenes();

/// S1: N × N points of equal mass, 1 m, 0.3 kg, structural 500, shear 100, bend 5 N/m, no damping,
/// first row pinned, tilted by 45°.
SceneDescription hanging_sheet(int n);

}  // namespace hooke::scene
