#include <scene/parse.hpp>

#include <hooke/error.hpp>
#include <hooke/method.hpp>
#include <scene/parts.hpp>
#include <scene/reader.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

namespace hooke::scene {

namespace {

constexpr double kLongest = 1e6;  // [s]
constexpr std::size_t kMostProfile = 10000;

Points<double> read_points(const Value& value, Index count = -1) {
  const Index n = Index(value.array());
  if (count >= 0 && n != count)
    value.fail("must have one entry a point, " + std::to_string(count) + ", got " + std::to_string(n));
  if (n > kMostPoints) value.fail("must be at most " + std::to_string(kMostPoints) + " points");
  Points<double> points(n, 3);
  for (Index i = 0; i < n; ++i) points.row(i) = value.at(std::size_t(i)).vec3().transpose().array();
  return points;
}

Index read_point(const Value& value, Index count) {
  if (!value.json().is_number_integer()) value.fail_got("must be a point index");
  if (value.json().is_number_unsigned() ? value.json().get<std::uint64_t>() >= std::uint64_t(count)
                                        : value.json().get<std::int64_t>() >= count)
    value.fail_got("must be below the point count " + std::to_string(count));
  return value.whole(0, count - 1);
}

std::vector<PointChoice> read_choices(const Value& value, bool lattice) {
  std::vector<PointChoice> out;
  std::vector<std::string> names{"top",      "bottom",    "left",        "right",
                                 "top-left", "top-right", "bottom-left", "bottom-right"};
  if (lattice) names.insert(names.end(), {"front", "back"});
  const auto one = [&](const Value& choice) {
    if (choice.json().is_string())
      out.emplace_back(choice.choice(names));
    else if (choice.json().is_number_integer())
      out.emplace_back(choice.whole(0, kMostPoints - 1));
    else
      choice.fail_got(lattice ? "must be a point index or the name of a face or edge"
                              : "must be a point index or the name of an edge or corner");
  };
  if (value.json().is_string()) {
    one(value);
  } else {
    for (std::size_t i = 0; i < value.array(); ++i) one(value.at(i));
  }
  return out;
}

RawPoints read_raw(const Object& body) {
  RawPoints raw;
  raw.points = read_points(body["points"]);
  const Index n = raw.points.rows();
  if (n == 0) body["points"].fail("must have at least one point");
  if (const auto velocities = body.find("velocities")) raw.velocities = read_points(*velocities, n);
  const auto masses = body.find("masses");
  const auto mass = body.find("mass");
  if (masses && mass) mass->fail("excludes masses");
  if (!masses && !mass) body.value().fail("raw points need \"masses\" [kg] or their sum \"mass\" [kg]");
  raw.masses.resize(n);
  if (mass) {
    raw.masses.setConstant(mass->number(Range::positive(), "kg") / double(n));
  } else {
    if (Index(masses->array()) != n)
      masses->fail("must have one mass a point, " + std::to_string(n) + ", got " + std::to_string(masses->array()));
    for (Index i = 0; i < n; ++i) raw.masses[i] = masses->at(std::size_t(i)).number(Range::positive(), "kg");
  }
  if (const auto springs = body.find("springs"))
    for (std::size_t i = 0; i < springs->array(); ++i) {
      const Object object(springs->at(i), "spring");
      const Value points = object["points"];
      if (points.array() != 2) points.fail_got("must be the two points that are joined");
      softbody::Spring spring;
      spring.a = int(read_point(points.at(0), n));
      spring.b = int(read_point(points.at(1), n));
      if (spring.a == spring.b) points.fail("must be two different points, got " + std::to_string(spring.a) + " twice");
      spring.stiffness = object["stiffness"].number(Range::not_negative(), "N/m");
      spring.damping = object.number("damping", 0, Range::not_negative(), "N s/m");
      spring.rest_length = object.number("rest_length", softbody::Spring::kFromStart, Range::not_negative(), "m");
      raw.network.springs.push_back(spring);
    }
  if (const auto pins = body.find("pins"))
    for (std::size_t i = 0; i < pins->array(); ++i) raw.pins.push_back(read_point(pins->at(i), n));
  return raw;
}

// "size" and "points" of grids and capes.
template <class Form>
void read_sheet(const Object& object, Form& form) {
  if (const auto size = object.find("size")) {
    if (size->array() != 2) size->fail_got("must be [width, height]");
    form.width = size->at(0).number(Range::positive(), "m");
    form.height = size->at(1).number(Range::positive(), "m");
  }
  if (const auto points = object.find("points")) {
    if (points->array() != 2) points->fail_got("must be [columns, rows]");
    form.columns = int(points->at(0).whole(2, kMostPoints / 2));
    form.rows = int(points->at(1).whole(2, kMostPoints / 2));
    if (Index(form.columns) * form.rows > kMostPoints)
      points->fail("must make at most " + std::to_string(kMostPoints) + " points");
  }
}

Grid read_grid(const Object& grid) {
  Grid form;
  grid["size"];
  grid["points"];
  read_sheet(grid, form);
  if (grid.has("right")) form.right = read_direction(grid["right"]);
  if (grid.has("down")) form.down = read_direction(grid["down"]);
  if (!(form.right.normalized().cross(form.down.normalized()).norm() > 1e-6))
    grid.value().fail("right and down must be two different directions");
  return form;
}

Mat3 read_rotation(const Object& rotation) {
  const Vec3 axis = read_direction(rotation["axis"]).normalized();
  return Eigen::AngleAxisd(rotation["angle"].number(Range::any(), "degrees") * std::numbers::pi / 180, axis).matrix();
}

LatticeBox read_lattice(const Object& lattice) {
  LatticeBox form;
  const Value size = lattice["size"], points = lattice["points"];
  if (size.array() != 3) size.fail_got("must be [x, y, z]");
  if (points.array() != 3) points.fail_got("must be [nx, ny, nz]");
  Index count = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    form.size[Index(k)] = size.at(k).number(Range::positive(), "m");
    form.points[k] = int(points.at(k).whole(2, kMostPoints / 4));
    if (form.points[k] > kMostPoints / count)
      points.fail("must make at most " + std::to_string(kMostPoints) + " points");
    count *= form.points[k];
  }
  form.center = lattice.vec3("center", form.center);
  if (const auto rotation = lattice.find("rotation")) form.turn = read_rotation(Object(*rotation, "rotation"));
  return form;
}

CapeCut read_cape(const Object& cape) {
  CapeCut form;
  form.human = cape["human"].text();
  read_sheet(cape, form);
  return form;
}

softbody::ClothMaterial read_cloth_material(const Object& object) {
  softbody::ClothMaterial material;
  material.density = object.number("density", material.density, Range::positive(), "kg/m2");
  material.stretch = object.number("stretch", material.stretch, Range::not_negative(), "N/m");
  material.shear = object.number("shear", material.shear, Range::not_negative(), "N/m");
  material.bend = object.number("bend", material.bend, Range::not_negative(), "N/m");
  softbody::DampingRatios& ratio = material.damping_ratio;
  if (const auto found = object.find("damping_ratio")) {
    if (found->json().is_number()) {
      ratio.stretch = ratio.shear = ratio.bend = found->number(Range::not_negative());
    } else {
      const Object ratios(*found, "damping_ratio");
      ratio.stretch = ratios.number("stretch", ratio.stretch, Range::not_negative());
      ratio.shear = ratios.number("shear", ratio.shear, Range::not_negative());
      ratio.bend = ratios.number("bend", ratio.bend, Range::not_negative());
    }
  }
  return material;
}

softbody::LatticeMaterial read_lattice_material(const Object& object) {
  softbody::LatticeMaterial material;
  material.density = object.number("density", material.density, Range::positive(), "kg/m3");
  material.young = object.number("young", material.young, Range::positive(), "Pa");
  const Range poisson{0.25, 0.5, true, false, "at least 0.25 and below 0.5"};
  material.poisson_ratio = object.number("poisson_ratio", material.poisson_ratio, poisson);
  material.damping_ratio = object.number("damping_ratio", material.damping_ratio, Range::not_negative());
  return material;
}

softbody::FixedLatticeMaterial read_fixed_lattice_material(const Object& object) {
  softbody::FixedLatticeMaterial material;
  material.mass = object["mass"].number(Range::positive(), "kg");
  material.stiffness = object["stiffness"].number(Range::not_negative(), "N/m");
  material.damping_ratio = object.number("damping_ratio", material.damping_ratio, Range::not_negative());
  return material;
}

Material read_material(const Value& value, bool grid, bool lattice) {
  const bool fixed = value.json().is_object() && (value.json().contains("mass") || value.json().contains("stiffness"));
  if (lattice && fixed) return read_fixed_lattice_material(Object(value, "fixed_lattice_material"));
  if (lattice) return read_lattice_material(Object(value, "lattice_material"));
  if (!fixed) return read_cloth_material(Object(value, "cloth_material"));
  if (!grid) value.fail("mass and stiffness are for grids and lattices; give density, stretch, shear and bend here");
  const Object object(value, "fixed_material");
  FixedMaterial material;
  material.mass = object["mass"].number(Range::positive(), "kg");
  const Object stiffness(object["stiffness"], "fixed_stiffness");
  material.structural = stiffness["structural"].number(Range::not_negative(), "N/m");
  material.shear = stiffness.number("shear", 0, Range::not_negative(), "N/m");
  material.bend = stiffness.number("bend", 0, Range::not_negative(), "N/m");
  material.damping = object.number("damping", 0, Range::not_negative(), "N s/m");
  return material;
}

softbody::Wind read_wind(const Object& object) {
  softbody::Wind wind;
  wind.velocity = object.vec3("velocity", wind.velocity);
  wind.gust = object.number("gust", wind.gust, Range::not_negative());
  wind.gust_period = object.number("gust_period", wind.gust_period, Range::positive(), "s");
  wind.swing = object.number("swing", wind.swing, Range::any(), "rad");
  wind.stop = object.number("stop", wind.stop, Range::any(), "s");
  if (object.has("once_a_tick")) wind.once_a_tick = object["once_a_tick"].truth();
  wind.fade = object.number("fade", wind.fade, Range::not_negative(), "s");
  wind.air_density = object.number("air_density", wind.air_density, Range::not_negative(), "kg/m3");
  wind.drag = object.number("drag", wind.drag, Range::not_negative());
  wind.lift = object.number("lift", wind.lift, Range::not_negative());
  if (const auto seed = object.find("seed")) wind.seed = std::uint32_t(seed->whole(0, 0xffffffff));
  return wind;
}

Solver read_solver(const Object& object) {
  Solver solver;
  if (const auto error = object.find("error")) {
    for (const char* key : {"method", "dt", "wanted_error", "iterations", "precision"})
      if (object.has(key)) object[key].fail("is chosen where an \"error\" is wanted; give one or the other");
    solver.error = error->number(Range::positive());
    return solver;
  }
  std::vector<std::string> names;
  for (const Method* method : methods()) names.emplace_back(method->name);
  names.emplace_back(softbody::filtered_leapfrog().name);
  names.emplace_back(softbody::xpbd().name);
  if (const auto method = object.find("method")) solver.method = method->choice(names);
  solver.dt = object.number("dt", solver.dt, Range::positive(), "s");
  if (const auto error = object.find("wanted_error")) {
    if (solver.method != softbody::filtered_leapfrog().name)
      error->fail("is for filtered-leapfrog, got the method " + solver.method);
    if (solver.dt > 0) error->fail("excludes dt");
    solver.wanted_error = error->number(Range::positive(), "m");
  }
  if (const auto iterations = object.find("iterations")) {
    if (solver.method != softbody::xpbd().name) iterations->fail("is for xpbd, got the method " + solver.method);
    solver.iterations = int(iterations->whole(1, 1000));
  }
  if (object.has("compensated")) solver.compensated = object["compensated"].truth();
  if (const auto retries = object.find("retries")) solver.retries = int(retries->whole(0, 20));
  if (const auto precision = object.find("precision"))
    solver.precision = softbody::precision_named(precision->choice({"float", "double", "double-float"}));
  return solver;
}

SoftBody read_soft(const Value& value, std::size_t number, const std::filesystem::path& folder) {
  const Object object(value, "soft");
  SoftBody body;
  body.path = value.path();
  body.name = object.has("name") ? object["name"].text() : "body" + std::to_string(number);
  body.origin = object.vec3("origin", body.origin);

  int forms = 0;
  for (const char* key : {"points", "grid", "mesh", "cape", "lattice"}) forms += object.has(key);
  if (forms != 1) value.fail("needs exactly one of points, grid, mesh, cape and lattice, got " + std::to_string(forms));
  const bool raw = object.has("points"), grid = object.has("grid"), cape = object.has("cape"),
             lattice = object.has("lattice");
  if (raw) body.form = read_raw(object);
  if (grid) body.form = read_grid(Object(object["grid"], "grid"));
  if (object.has("mesh")) body.form = MeshFile{folder / object["mesh"].text()};
  if (cape) body.form = read_cape(Object(object["cape"], "cape"));
  if (lattice) {
    body.form = read_lattice(Object(object["lattice"], "lattice"));
    body.material = softbody::LatticeMaterial{};
    body.look = BodyLook::Jelly;
  }

  for (const char* key : {"velocities", "masses", "mass", "springs", "pins"})
    if (!raw && object.has(key))
      object[key].fail(std::string("belongs to raw points") +
                       (std::string(key) == "pins" ? "; grids, meshes and lattices have \"pin\"" : ""));
  if (raw && object.has("material"))
    object["material"].fail("belongs to grids, meshes, capes and lattices; raw points have springs");
  if (raw && object.has("pin")) object["pin"].fail("belongs to grids, meshes and lattices; raw points have \"pins\"");
  if (raw && object.has("wind")) object["wind"].fail("needs triangles: a grid, a mesh, a cape or a lattice");
  if (cape && object.has("origin")) object["origin"].fail("a cape begins on its human's shoulders");

  if (object.has("material")) body.material = read_material(object["material"], grid, lattice);
  if (object.has("pin")) body.pin = read_choices(object["pin"], lattice);
  if (const auto groups = object.find("pin_motion"))
    for (std::size_t i = 0; i < groups->array(); ++i) {
      const Object group(groups->at(i), "pin_motion");
      body.pin_motion.push_back({read_choices(group["points"], lattice), read_drive(group)});
    }
  if (object.has("wind")) body.wind = read_wind(Object(object["wind"], "wind"));
  if (object.has("drag")) {
    const Object drag(object["drag"], "drag");
    body.linear_drag = drag.number("linear", 0, Range::not_negative(), "N s/m");
    body.quadratic_drag = drag.number("quadratic", 0, Range::not_negative(), "N s2/m2");
  }
  body.thickness = object.number("thickness", cape ? CapeSettings().thickness : 0, Range::not_negative(), "m");
  if (object.has("color")) body.color = read_color(object["color"]);
  if (object.has("inside_color")) body.inside_color = read_color(object["inside_color"]);
  if (object.has("look")) {
    const std::vector<std::string> names{"cloth", "jelly"};
    if (raw) object["look"].fail("needs triangles: a grid, a mesh, a cape or a lattice");
    body.look = BodyLook(std::find(names.begin(), names.end(), object["look"].choice(names)) - names.begin());
  }
  if (object.has("solver")) body.solver = read_solver(Object(object["solver"], "solver"));
  return body;
}

// Adds it to the scene and returns its name.
std::string read_body(const Value& value, std::size_t number, const std::filesystem::path& folder,
                      SceneDescription& scene) {
  if (!value.json().is_object()) value.fail_got("must be an object");
  const auto type = value.json().find("type");
  if (type == value.json().end()) value.fail("the key \"type\" is missing");
  const Value type_value(*type, value.file(), value.path() + ".type");
  const std::string kind = type_value.choice({"soft", "particles", "rigid"});
  if (kind == "rigid")
    type_value.fail("bodies of type \"rigid\" are not available in scene files yet; use \"soft\" or \"particles\"");
  if (kind == "particles") {
    scene.particles.push_back(read_particles(value, number, folder));
    return scene.particles.back().settings.name;
  }
  scene.bodies.push_back(read_soft(value, number, folder));
  return scene.bodies.back().name;
}

human::HumanSettings read_human(const Object& object, const std::filesystem::path& folder) {
  human::HumanSettings human;
  if (const auto motion = object.find("motion")) human.motion = folder / motion->text();
  human.height = object.number("height", human.height, Range::between(0.5, 3, "from 0.5 to 3"), "m");
  human.from = object.number("from", human.from, Range::not_negative(), "s");
  human.until = object.number("until", human.until, Range::positive(), "s");
  human.hold = object.number("hold", human.hold, Range::between(0, 100, "from 0 to 100"), "s");
  human.blend_in = object.number("blend_in", human.blend_in, Range::between(1e-3, 100, "from 0.001 to 100"), "s");
  human.settle = object.number("settle", human.settle, Range::between(0, 100, "from 0 to 100"), "s");
  human.filter_hz = object.number("filter_hz", human.filter_hz, Range::between(0.1, 1000, "from 0.1 to 1000"), "Hz");
  return human;
}

Box read_box(const Object& object) {
  Box box;
  box.center = object["center"].vec3();
  const Value size = object["size"];
  if (size.array() != 3) size.fail_got("must be an array of 3 numbers");
  for (int k = 0; k < 3; ++k) box.half_extent[k] = size.at(std::size_t(k)).number(Range::positive(), "m") / 2;
  if (const auto rotation = object.find("rotation")) box.axes = read_rotation(Object(*rotation, "rotation"));
  return box;
}

std::vector<std::array<double, 2>> read_profile(const Value& value) {
  std::vector<std::array<double, 2>> profile;
  const std::size_t count = value.array();
  if (count < 2 || count > kMostProfile)
    value.fail("must have from 2 to " + std::to_string(kMostProfile) + " points, got " + std::to_string(count));
  for (std::size_t i = 0; i < count; ++i) {
    const Value point = value.at(i);
    if (point.array() != 2) point.fail_got("must be [radius, height]");
    profile.push_back({point.at(0).number(Range::not_negative(), "m"), point.at(1).number(Range::any(), "m")});
    if (i > 0 && profile[i] == profile[i - 1]) point.fail("is the same as the point before");
    if (i > 0 && i + 1 < count && profile[i][0] == 0)
      point.fail("only the first and the last point may be on the axis, at radius 0");
  }
  if (count == 2 && profile[0][0] == 0 && profile[1][0] == 0) value.fail("must have a point off the axis");
  return profile;
}

MovingForm read_form(const Object& object, const std::string& type, const std::filesystem::path& folder) {
  MovingForm solid;
  if (type == "lathe") {
    LatheForm lathe{read_profile(object["profile"])};
    if (object.has("axis")) lathe.axis = read_direction(object["axis"]);
    solid.form = lathe;
    solid.origin = object["center"].vec3();
  } else {
    const std::filesystem::path file = folder / object["file"].text();
    if (type == "mesh")
      solid.form = MeshForm{file};
    else
      solid.form = VolumeForm{file, object.has("grid") ? object["grid"].text() : ""};
    solid.origin = object.vec3("origin", solid.origin);
  }
  if (type != "level-set") solid.voxel = object.number("voxel", solid.voxel, Range::positive(), "m");
  if (const auto motion = object.find("motion")) solid.motion = read_drive(Object(*motion, "motion"));
  return solid;
}

MovingShape read_shape(const Object& object, const std::string& type) {
  MovingShape solid;
  if (type == "half-space") {
    HalfSpace shape;
    if (object.has("normal")) shape.normal = read_direction(object["normal"]).normalized();
    shape.offset = object.number("offset", shape.offset, Range::any(), "m");
    solid.shape = shape;
    return solid;
  }
  if (type == "sphere") {
    solid.shape = Sphere{object["center"].vec3(), object["radius"].number(Range::positive(), "m")};
  } else if (type == "box") {
    solid.shape = read_box(object);
  } else {
    solid.shape = Capsule{object["a"].vec3(), object["b"].vec3(), object["radius"].number(Range::positive(), "m")};
  }
  if (const auto motion = object.find("motion")) solid.motion = read_drive(Object(*motion, "motion"));
  return solid;
}

ColliderDescription read_collider(const Value& value, std::size_t number, const std::filesystem::path& folder) {
  if (!value.json().is_object()) value.fail_got("must be an object");
  const auto found = value.json().find("type");
  if (found == value.json().end()) value.fail("the key \"type\" is missing");
  const std::string type =
      Value(*found, value.file(), value.path() + ".type")
          .choice({"half-space", "sphere", "capsule", "box", "mesh", "lathe", "level-set", "human"});
  const Object object(value, type == "half-space" ? "half_space" : type == "level-set" ? "level_set" : type);
  ColliderDescription collider;
  collider.path = value.path();
  collider.name = object.has("name") ? object["name"].text() : type + std::to_string(number);
  if (type == "human")
    collider.solid = read_human(object, folder);
  else if (type == "mesh" || type == "lathe" || type == "level-set")
    collider.solid = read_form(object, type, folder);
  else
    collider.solid = read_shape(object, type);
  collider.friction = object.number("friction", collider.friction, Range::not_negative());
  collider.restitution = object.number("restitution", collider.restitution, fraction());
  if (type != "half-space" && object.has("color")) collider.color = read_color(object["color"]);
  if (type != "half-space" && type != "human" && object.has("look")) {
    const std::vector<std::string> names{"matte", "stone", "steel", "water"};
    collider.look = Surface(std::find(names.begin(), names.end(), object["look"].choice(names)) - names.begin());
  }
  return collider;
}

CameraDescription read_camera(const Object& object) {
  CameraDescription camera;
  camera.eye = object["eye"].vec3();
  camera.target = object["target"].vec3();
  camera.origin = object.vec3("origin", camera.origin);
  camera.fov = object.number("fov", camera.fov, Range::between(1, 120, "from 1 to 120"), "degrees");
  if (object.has("follow")) camera.follow = object["follow"].truth();
  const Vec3 sight = camera.target - camera.eye;
  if (!(std::hypot(sight.x(), sight.z()) > 1e-6)) object.value().fail("must not look straight up or down");
  return camera;
}

}  // namespace

SceneDescription parse_scene(const std::string& text, const std::string& file, const std::filesystem::path& folder) {
  const Json json = parse_json(text, file);
  const Value root(json, file, "");
  const Object object(root, "scene");
  if (const Value version = object["hooke"]; !version.json().is_number_integer() || version.json() != 1)
    version.fail_got("must be 1, the version of the format");

  SceneDescription scene;
  scene.file = file;
  if (object.has("title")) scene.title = object["title"].text();
  scene.gravity = object.vec3("gravity", scene.gravity);
  Range loss = fraction();
  loss.most_allowed = false, loss.words = "a fraction per second, from 0 to below 1";
  scene.damping = object.number("damping", scene.damping, loss);
  const Range seconds{0, kLongest, false, true, "positive and at most 1e6"};
  scene.duration = object.number("duration", scene.duration, seconds, "s");
  scene.frame_rate = object.number("frame_rate", scene.frame_rate, {1e-3, 1e4, true, true, "from 0.001 to 1e4"}, "1/s");
  scene.tick_rate = object.number("tick_rate", scene.tick_rate, {1e-3, 1e6, true, true, "from 0.001 to 1e6"}, "1/s");
  scene.preroll = object.number("preroll", scene.preroll, Range::between(0, kLongest, "from 0 to 1e6"), "s");
  scene.poster = object.number("poster", scene.poster, Range::not_negative(), "s");
  if (object.has("camera")) scene.camera = read_camera(Object(object["camera"], "camera"));

  const Value bodies = object["bodies"];
  std::set<std::string> names;
  for (std::size_t i = 0; i < bodies.array(); ++i) {
    const std::string name = read_body(bodies.at(i), i, folder, scene);
    if (!names.insert(name).second)
      Value(bodies.at(i).json(), file, bodies.at(i).path() + ".name").fail("two bodies are called \"" + name + "\"");
  }
  names.clear();
  if (const auto colliders = object.find("colliders"))
    for (std::size_t i = 0; i < colliders->array(); ++i) {
      scene.colliders.push_back(read_collider(colliders->at(i), i, folder));
      if (!names.insert(scene.colliders.back().name).second)
        Value(colliders->at(i).json(), file, colliders->at(i).path() + ".name")
            .fail("two colliders are called \"" + scene.colliders.back().name + "\"");
    }
  return scene;
}

SceneDescription read_scene(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw Error(path.string() + ": is a folder, not a scene file");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path.string() + ": cannot open: " + std::strerror(errno));
  std::ostringstream text;
  text << file.rdbuf();
  if (file.bad()) throw Error(path.string() + ": cannot read: " + std::strerror(errno));
  return parse_scene(text.str(), path.string(), path.has_parent_path() ? path.parent_path() : ".");
}

}  // namespace hooke::scene
