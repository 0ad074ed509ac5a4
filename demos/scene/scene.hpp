// From a SceneDescription to a world that can be stepped, and what is needed to draw, export
// and measure it.
#pragma once

#include <hooke/softbody/choose_solver.hpp>
#include <hooke/world.hpp>
#include <scene/description.hpp>
#include <scene/parse.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hooke::scene {

/// What World does not know of a body.
struct SceneBody {
  Body* body = nullptr;  ///< in the world
  std::vector<Triangle> triangles;
  Eigen::Array<double, Eigen::Dynamic, 2> uv{0, 2};  ///< [m], (n, 2); empty where there is no grid
  std::shared_ptr<const softbody::SpringNetwork> network;
  std::vector<double> rest;  ///< of its springs [m]
  std::vector<bool> held;    ///< by point: pinned or driven
  double thickness = 0;      ///< [m]
  std::optional<Vec3> color, inside_color;
  BodyLook look = BodyLook::Cloth;
  std::vector<Index> driven;                     ///< points that follow `targets`
  PinMotion targets;                             ///< empty where nothing is driven
  int wears = -1;                                ///< a cape: which of Scene::humans carries it
  std::optional<softbody::SolverChoice> choice;  ///< where the scene names a wanted error
};

struct SceneHuman {
  std::string name;
  human::Human human;
  std::size_t collider = 0;  ///< in World::colliders()
};

struct Scene {
  World world;
  SceneDescription description;
  std::vector<SceneBody> bodies;          ///< in the world's order
  std::vector<SceneParticles> particles;  ///< in the world after them
  std::vector<SceneHuman> humans;
  /// By collider: what is drawn at the offset of its level set; null where its shapes are drawn.
  std::vector<std::shared_ptr<const TriangleMesh>> meshes;

  /// The time that is shown: the world's minus the preroll [s].
  double shown_time() const { return world.time() - description.preroll; }
};

/// Reads the files that the description names and builds everything.
/// @param reuse an earlier scene of the same colliders, whose humans and level sets are taken over (a human
///              costs seconds)
/// @throws hooke::Error naming file, path, rule and value
Scene build(const SceneDescription& description, const Scene* reuse = nullptr);

/// Sets the solver of every body: what is given on the command line.
/// Throws hooke::Error where a body has no such method or precision.
void override_solver(SceneDescription& description, const std::string& method, double dt, const std::string& precision);

/// Lets the chooser pick the solver of every soft body: `error` is a share of each body's size, > 0.
void choose_solvers(SceneDescription& description, double error);

}  // namespace hooke::scene
