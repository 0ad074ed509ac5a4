#include "scenes.hpp"

#include <hooke/softbody/lattice.hpp>
#include <scene/scene.hpp>

#include <cmath>

namespace hooke::stability {

using scene::SceneDescription;

namespace {

constexpr double kGravity = 9.81;
constexpr double kToRest = 0.99;  // of the speed is lost a second

}  // namespace

SceneDescription empty_scene(const std::string& name, double duration) {
  SceneDescription d;
  d.file = name;
  d.duration = duration;
  return d;
}

scene::SoftBody& add_body(SceneDescription& d, const std::string& name, scene::RawPoints form) {
  scene::SoftBody& body = d.bodies.emplace_back();
  body.name = name;
  body.path = "bodies[" + std::to_string(d.bodies.size() - 1) + "]";
  body.form = std::move(form);
  return body;
}

void add_collider(SceneDescription& d, const std::string& name, const Shape& shape, double friction) {
  scene::ColliderDescription& collider = d.colliders.emplace_back();
  collider.name = name;
  collider.path = "colliders[" + std::to_string(d.colliders.size() - 1) + "]";
  collider.solid = scene::MovingShape{shape, {}};
  collider.friction = friction;
}

scene::RawPoints points_of(const SceneDescription& d) {
  const scene::Scene built = scene::build(d);
  const scene::SceneBody& body = built.bodies.front();
  scene::RawPoints raw;
  raw.points = body.body->positions().rowwise() - d.bodies.front().origin.transpose().array();
  raw.velocities = body.body->velocities();
  raw.masses = body.body->masses();
  raw.network = *body.network;
  for (Index i = 0; i < raw.masses.size(); ++i)
    if (body.held[std::size_t(i)]) raw.pins.push_back(i);
  return raw;
}

SceneDescription heavy_chain(double ratio) {
  constexpr int kLinks = 10;
  constexpr double kLength = 0.1, kMass = 0.1;
  SceneDescription d = empty_scene("heavy-chain", 5);
  d.damping = kToRest;
  scene::RawPoints raw;
  raw.points = Points<double>::Zero(kLinks + 1, 3);
  raw.velocities = Points<double>::Zero(kLinks + 1, 3);
  raw.masses = Values<double>::Constant(kLinks + 1, kMass);
  raw.masses[kLinks] = ratio * kMass;
  const double hanging = kMass * (kLinks - 1 + ratio) * kGravity;
  for (int i = 1; i <= kLinks; ++i) {
    raw.points(i, 1) = -kLength * i;
    raw.network.springs.push_back({i - 1, i, hanging / (0.1 * kLength), 0, kLength, softbody::Family::Raw});
  }
  raw.pins = {0};
  add_body(d, "chain", std::move(raw));
  return d;
}

SceneDescription heavy_sheet(double ratio) {
  constexpr int kPoints = 8;
  constexpr double kMass = 0.3;
  SceneDescription d = scene::hanging_sheet(kPoints);
  d.file = "heavy-sheet";
  d.damping = kToRest;
  d.duration = 5;
  const double point = kMass / (kPoints * kPoints), hanging = (ratio + kPoints) * point * kGravity;
  const double stiffness = hanging / (0.1 / (kPoints - 1));
  std::get<scene::Grid>(d.bodies[0].form).down = {0, -1, 0};
  d.bodies[0].material = scene::FixedMaterial{kMass, stiffness, 0.2 * stiffness, 0.01 * stiffness, 0};
  scene::RawPoints raw = points_of(d);
  raw.masses[raw.masses.size() - 1] *= ratio;
  d.bodies[0].form = std::move(raw);
  d.bodies[0].pin.clear();
  return d;
}

SceneDescription hard_sheet(int n, double stiffness, double ratio) {
  SceneDescription d = scene::hanging_sheet(n);
  auto& material = std::get<scene::FixedMaterial>(d.bodies[0].material);
  for (double* k : {&material.structural, &material.shear, &material.bend}) *k *= stiffness;
  if (ratio == 1) return d;
  scene::RawPoints raw = points_of(d);
  raw.masses[raw.masses.size() - 1] *= ratio;
  d.bodies[0].form = std::move(raw);
  d.bodies[0].pin.clear();
  return d;
}

SceneDescription hammock(int n) {
  SceneDescription d = empty_scene("hammock", 3);
  d.damping = kToRest;
  scene::SoftBody& body = add_body(d, "cloth", {});
  body.form = scene::Grid{1, 1, n, n, {1, 0, 0}, {0, 0, 1}};
  softbody::ClothMaterial material;
  material.stretch = 1000;
  material.bend = 0;
  material.damping_ratio = {0, 0, 0};
  body.material = material;
  body.pin = {"left", "right"};
  return d;
}

scene::RawPoints jelly(int count, double height, double stiffness) {
  softbody::FixedLatticeMaterial material;
  material.stiffness = stiffness;
  softbody::Lattice box = softbody::lattice_from_box(Vec3::Constant(0.2), {count, count, count}, material);
  scene::RawPoints raw;
  raw.points = box.positions;
  raw.points.col(1) += height + 0.1;
  raw.velocities = Points<double>::Zero(raw.points.rows(), 3);
  raw.masses = box.masses;
  raw.network = *box.network;
  // As it is now, wherever a case puts the points.
  const std::vector<double> rest = softbody::rest_lengths(raw.network, raw.points);
  for (std::size_t i = 0; i < rest.size(); ++i) raw.network.springs[i].rest_length = rest[i];
  return raw;
}

std::vector<SceneDescription> hashed_scenes() {
  std::vector<SceneDescription> out;
  SceneDescription sheet = empty_scene("damped-sheet", 0.5);
  scene::SoftBody& cloth = add_body(sheet, "cloth", {});
  cloth.form = scene::Grid{1, 1, 8, 8, {1, 0, 0}, {0, 0, 1}};
  cloth.pin = {"top"};
  out.push_back(sheet);

  cloth.pin = {"top-left"};
  cloth.thickness = 0.01;
  sheet.file = "damped-sheet-on-sphere";
  add_collider(sheet, "ball", Sphere{{0, -0.25, 0.5}, 0.25});
  out.push_back(std::move(sheet));

  SceneDescription fall = empty_scene("jelly-on-floor", 0.5);
  add_body(fall, "jelly", jelly(4, 0.05));
  add_collider(fall, "floor", HalfSpace{}, 0.5);
  out.push_back(std::move(fall));
  return out;
}

}  // namespace hooke::stability
