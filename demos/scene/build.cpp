#include <scene/scene.hpp>

#include <scene/form.hpp>
#include <scene/told.hpp>

#include <hooke/error.hpp>
#include <hooke/io/mesh_file.hpp>
#include <hooke/point_body.hpp>

#include <algorithm>
#include <stdexcept>

namespace hooke::scene {

namespace {

using softbody::Family;

[[noreturn]] void fail(const SceneDescription& scene, const std::string& path, const std::string& rule) {
  fail_at(scene.file, path, rule);
}

template <class Work>
auto told_at(const SceneDescription& scene, const std::string& path, const Work& work) {
  return hooke::scene::told_at(scene.file, path, work);
}

softbody::Cloth cloth_of(const Grid& grid, const Material& material) {
  const auto make = [&](const softbody::ClothMaterial& cloth) {
    return softbody::cloth_from_grid(grid.width, grid.height, grid.columns, grid.rows, grid.right, grid.down, cloth);
  };
  if (const auto* cloth = std::get_if<softbody::ClothMaterial>(&material)) return make(*cloth);

  // The same points, springs and triangles with other numbers.
  const auto& fixed = std::get<FixedMaterial>(material);
  softbody::ClothMaterial any;
  any.stretch = any.shear = any.bend = 1;
  softbody::Cloth cloth = make(any);
  cloth.masses.setConstant(fixed.mass / double(cloth.masses.size()));
  auto network = std::make_shared<softbody::SpringNetwork>();
  for (softbody::Spring spring : cloth.network->springs) {
    spring.stiffness = spring.family == Family::Stretch ? fixed.structural
                       : spring.family == Family::Shear ? fixed.shear
                                                        : fixed.bend;
    spring.damping = fixed.damping;
    if (spring.stiffness > 0) network->springs.push_back(spring);
  }
  cloth.network = std::move(network);
  return cloth;
}

// Of the core, or of soft bodies alone.
const Method& method_of(const std::string& name) {
  for (const Method* method : {&softbody::filtered_leapfrog(), &softbody::xpbd()})
    if (name == method->name) return *method;
  return method_named(name);
}

softbody::Lattice lattice_of(const LatticeBox& box, const Material& material) {
  if (const auto* fixed = std::get_if<softbody::FixedLatticeMaterial>(&material))
    return softbody::lattice_from_box(box.size, box.points, *fixed, box.turn);
  return softbody::lattice_from_box(box.size, box.points, std::get<softbody::LatticeMaterial>(material), box.turn);
}

// How the points of a body with named sides are laid out.
struct Layout {
  int columns = 0, rows = 0, layers = 1;  // 0: none
  bool upwards = false;                   // row 0 is the bottom
};

void choose_points(const SceneDescription& scene, const std::string& path, const std::vector<PointChoice>& choices,
                   Index count, const Layout& layout, std::vector<Index>& out) {
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const std::string here = path + "[" + std::to_string(i) + "]";
    if (const auto* index = std::get_if<Index>(&choices[i])) {
      if (*index >= count)
        fail(scene, here, "must be below the point count " + std::to_string(count) + ", got " + std::to_string(*index));
      out.push_back(*index);
      continue;
    }
    const std::string& name = std::get<std::string>(choices[i]);
    if (layout.rows == 0) fail(scene, here, "only grids, capes and lattices have sides, got \"" + name + "\"");
    const auto on = [&](const char* side) { return name.find(side) != std::string::npos; };
    const int last = layout.rows - 1, top = layout.upwards ? last : 0;
    for (int layer = 0; layer < layout.layers; ++layer)
      for (int row = 0; row < layout.rows; ++row)
        for (int column = 0; column < layout.columns; ++column)
          if ((!on("top") || row == top) && (!on("bottom") || row == last - top) && (!on("left") || column == 0) &&
              (!on("right") || column == layout.columns - 1) && (!on("back") || layer == 0) &&
              (!on("front") || layer == layout.layers - 1))
            out.push_back((Index(layer) * layout.rows + row) * layout.columns + column);
  }
  std::vector<Index> once;
  std::vector<bool> seen(std::size_t(count), false);
  for (const Index point : out) {
    if (!seen[std::size_t(point)]) once.push_back(point);
    seen[std::size_t(point)] = true;
  }
  out = std::move(once);
}

void lay_out_uv(const Layout& layout, double width, double height, SceneBody& out) {
  out.uv.resize(Index(layout.columns) * layout.rows, 2);
  for (int row = 0; row < layout.rows; ++row)
    for (int column = 0; column < layout.columns; ++column)
      out.uv.row(Index(row) * layout.columns + column) << double(column) / (layout.columns - 1) * width,
          double(row) / (layout.rows - 1) * height;
}

class Builder {
 public:
  Builder(const SceneDescription& description, const Scene* reuse)
      : d_(description), reuse_(reuse), scene_{World(description.tick_rate), description, {}, {}, {}, {}} {}

  Scene run() {
    scene_.world.set_gravity(d_.gravity);
    scene_.world.set_damping(d_.damping);
    for (const ColliderDescription& collider : d_.colliders) {
      const auto* form = std::get_if<MovingForm>(&collider.solid);
      if (form)
        told_at(d_, collider.path + (std::holds_alternative<LatheForm>(form->form) ? ".profile" : ".file"),
                [&] { add_form(collider, *form); });
      else
        told_at(d_, collider.path, [&] { add_collider(collider); });
      scene_.meshes.resize(scene_.world.colliders().size());
    }
    for (const SoftBody& body : d_.bodies) add_body(body);
    for (const ParticleBody& body : d_.particles)
      scene_.particles.emplace_back(body, d_.file, d_.preroll, scene_.world);
    return std::move(scene_);
  }

 private:
  void add_collider(const ColliderDescription& description) {
    Collider collider;
    collider.name = description.name;
    collider.friction = description.friction;
    collider.restitution = description.restitution;
    if (const auto* solid = std::get_if<MovingShape>(&description.solid)) {
      collider.shapes = {solid->shape};
      if (solid->motion) collider.motion = move_shape(solid->shape, *solid->motion);
    } else {
      add_human(description, collider);
    }
    scene_.world.add_collider(std::move(collider));
  }

  void add_form(const ColliderDescription& description, const MovingForm& solid) {
    const std::size_t number = scene_.world.colliders().size();
    Form form;
    if (reuse_ && number < reuse_->meshes.size() && reuse_->meshes[number])
      form = {std::get<LevelSet>(reuse_->world.colliders()[number].shapes[0]).grid, reuse_->meshes[number]};
    else
      form = make_form(solid);
    Collider collider;
    collider.name = description.name;
    collider.friction = description.friction;
    collider.restitution = description.restitution;
    collider.shapes = {LevelSet{form.grid, solid.origin}};
    if (solid.motion) collider.motion = move_shape(collider.shapes[0], *solid.motion);
    scene_.world.add_collider(std::move(collider));
    scene_.meshes.push_back(form.mesh);
  }

  std::function<void(double, std::span<Shape>)> move_shape(const Shape& shape, const Drive& motion) const {
    return [start = shape, drive = motion, preroll = d_.preroll](double t, std::span<Shape> shapes) {
      const Vec3 offset = drive.offset(t - preroll);
      shapes[0] = start;
      if (auto* sphere = std::get_if<Sphere>(&shapes[0])) sphere->center += offset;
      if (auto* capsule = std::get_if<Capsule>(&shapes[0])) {
        capsule->a += offset;
        capsule->b += offset;
      }
      if (auto* box = std::get_if<Box>(&shapes[0])) box->center += offset;
      if (auto* set = std::get_if<LevelSet>(&shapes[0])) set->offset += offset;
    };
  }

  void add_human(const ColliderDescription& description, Collider& collider) {
    const auto& settings = std::get<human::HumanSettings>(description.solid);
    if (!std::filesystem::exists(settings.motion))
      throw Error("there is no motion file " + settings.motion.string() +
                  "; the recorded walk is in the Debian package assimp-testmodels (apt-get install assimp-testmodels)");
    const double needed = settings.hold + settings.blend_in;
    if (d_.preroll < needed - 1e-9)
      throw Error(
          "the human stands still and begins to walk before the first frame: preroll must be at least hold + "
          "blend_in = " +
          std::to_string(needed) + " s, got " + std::to_string(d_.preroll) + " s");
    const std::size_t number = scene_.humans.size();
    const human::Human human =
        reuse_ && number < reuse_->humans.size() ? reuse_->humans[number].human : human::Human(settings);
    scene_.humans.push_back({description.name, human, scene_.world.colliders().size()});
    std::vector<Capsule> capsules(std::size_t(human.capsule_count()));
    human.capsules(-d_.preroll, capsules);
    collider.shapes.assign(capsules.begin(), capsules.end());
    collider.motion = [human, preroll = d_.preroll](double t, std::span<Shape> shapes) {
      thread_local std::vector<Capsule> now;
      now.resize(shapes.size());
      human.capsules(t - preroll, now);
      std::copy(now.begin(), now.end(), shapes.begin());
    };
  }

  void add_body(const SoftBody& description) {
    SceneBody out;
    softbody::SoftBodySettings settings;
    Layout layout;
    std::optional<Cape> cape;
    if (const auto* raw = std::get_if<RawPoints>(&description.form)) {
      settings.positions = raw->points;
      settings.velocities = raw->velocities;
      settings.masses = raw->masses;
      settings.network = std::make_shared<const softbody::SpringNetwork>(raw->network);
      settings.pins = raw->pins;
    } else if (const auto* grid = std::get_if<Grid>(&description.form)) {
      settings =
          told_at(d_, description.path, [&] { return softbody::settings_of(cloth_of(*grid, description.material)); });
      layout = {grid->columns, grid->rows, 1, false};
      lay_out_uv(layout, grid->width, grid->height, out);
    } else if (const auto* mesh = std::get_if<MeshFile>(&description.form)) {
      settings = told_at(d_, description.path + ".mesh", [&] {
        return softbody::settings_of(softbody::cloth_from_mesh(
            io::read_obj(mesh->file), std::get<softbody::ClothMaterial>(description.material)));
      });
    } else if (const auto* box = std::get_if<LatticeBox>(&description.form)) {
      settings = told_at(d_, description.path + ".lattice",
                         [&] { return softbody::settings_of(lattice_of(*box, description.material)); });
      settings.positions.rowwise() += box->center.transpose().array();
      layout = {box->points[0], box->points[1], box->points[2], true};
    } else {
      const auto& cut = std::get<CapeCut>(description.form);
      cape = dress_human(description, cut, out);
      settings = softbody::settings_of(cape->cloth);
      layout = {cut.columns, cut.rows, 1, false};
      lay_out_uv(layout, cut.width, cut.height, out);
    }
    settings.name = description.name;
    settings.origin = description.origin;
    const Index count = settings.positions.rows();
    choose_points(d_, description.path + ".pin", description.pin, count, layout, settings.pins);
    settings.linear_drag = description.linear_drag;
    settings.quadratic_drag = description.quadratic_drag;
    settings.motion.thickness = description.thickness;
    settings.motion.dt = description.solver.dt;
    settings.motion.tolerance = description.solver.tolerance;
    settings.motion.iterations = description.solver.iterations;
    settings.motion.compensated = description.solver.compensated;
    settings.motion.retries = description.solver.retries;
    settings.motion.method = &method_of(description.solver.method);
    settings.wanted_error = description.solver.wanted_error;
    settings.precision = description.solver.precision;

    if (description.wind) {
      settings.wind = description.wind;
      settings.wind->start = d_.preroll;  // its clock is the shown time
    }

    std::unique_ptr<Body> body = told_at(d_, description.path, [&] { return softbody::make_soft_body(settings); });
    out.triangles = settings.triangles;
    out.network = settings.network;
    out.rest = softbody::rest_lengths(*settings.network, settings.positions);
    out.thickness = description.thickness;
    out.color = description.color;
    out.inside_color = description.inside_color;
    out.look = description.look;
    if (cape) wear(*cape, out);
    drive_pins(description, layout, *body, out);
    if (description.solver.error > 0) {
      told_at(d_, description.path + ".solver.error", [&] { choose(description.solver.error, settings, out); });
      body = softbody::make_soft_body(settings);
    }
    if (!out.driven.empty())
      told_at(d_, description.path + ".pin_motion", [&] { body->drive_pins(out.driven, out.targets); });
    out.held.resize(std::size_t(count));
    for (Index i = 0; i < count; ++i) out.held[std::size_t(i)] = body->pinned(i);
    out.body = body.get();
    scene_.world.add(std::move(body));
    scene_.bodies.push_back(std::move(out));
  }

  void choose(double error, softbody::SoftBodySettings& settings, SceneBody& out) const {
    softbody::RunSetting run;
    run.gravity = d_.gravity;
    run.duration = d_.preroll + d_.duration;
    run.tick_rate = d_.tick_rate;
    run.damping = d_.damping;
    run.colliders = scene_.world.colliders();
    if (!out.driven.empty()) run.prepare = [&out](Body& body) { body.drive_pins(out.driven, out.targets); };
    out.choice = softbody::choose_solver(settings, run, error);
    out.choice->apply(settings);
  }

  Cape dress_human(const SoftBody& description, const CapeCut& cut, SceneBody& out) {
    const auto found = std::find_if(scene_.humans.begin(), scene_.humans.end(),
                                    [&](const SceneHuman& human) { return human.name == cut.human; });
    if (found == scene_.humans.end())
      fail(d_, description.path + ".cape.human", "there is no human collider called \"" + cut.human + "\"");
    out.wears = int(found - scene_.humans.begin());
    CapeSettings settings;
    settings.width = cut.width;
    settings.height = cut.height;
    settings.columns = cut.columns;
    settings.rows = cut.rows;
    settings.thickness = description.thickness;
    settings.material = std::get<softbody::ClothMaterial>(description.material);
    return told_at(d_, description.path + ".cape", [&] { return dress(found->human, settings, -d_.preroll); });
  }

  void wear(const Cape& cape, SceneBody& out) {
    out.driven = cape.pins;
    out.targets = [human = scene_.humans[std::size_t(out.wears)].human, attachment = cape.attachment,
                   preroll = d_.preroll](double t, Points<double>& places) {
      human.attached(attachment, t - preroll, places);
    };
  }

  void drive_pins(const SoftBody& description, const Layout& layout, const Body& body, SceneBody& out) {
    if (description.pin_motion.empty()) return;
    if (out.wears >= 0) fail(d_, description.path + ".pin_motion", "a cape hangs on its human");
    struct Driven {
      Vec3 start;
      std::size_t group;
    };
    std::vector<Driven> driven;
    std::vector<Drive> drives;
    std::vector<bool> taken(std::size_t(body.size()), false);
    const Points<double> start = body.positions();
    for (std::size_t g = 0; g < description.pin_motion.size(); ++g) {
      const std::string path = description.path + ".pin_motion[" + std::to_string(g) + "].points";
      std::vector<Index> points;
      choose_points(d_, path, description.pin_motion[g].points, body.size(), layout, points);
      for (const Index point : points) {
        if (taken[std::size_t(point)]) fail(d_, path, "point " + std::to_string(point) + " is driven by two groups");
        taken[std::size_t(point)] = true;
        out.driven.push_back(point);
        driven.push_back({start.row(point).matrix().transpose(), g});
      }
      drives.push_back(description.pin_motion[g].drive);
    }
    out.targets = [driven, drives, preroll = d_.preroll](double t, Points<double>& places) {
      for (std::size_t i = 0; i < driven.size(); ++i)
        places.row(Index(i)) = (driven[i].start + drives[driven[i].group].offset(t - preroll)).transpose().array();
    };
  }

  const SceneDescription& d_;
  const Scene* reuse_;
  Scene scene_;
};

}  // namespace

Scene build(const SceneDescription& description, const Scene* reuse) { return Builder(description, reuse).run(); }

void override_solver(SceneDescription& description, const std::string& method, double dt,
                     const std::string& precision) {
  if (!method.empty()) method_of(method);
  if (!precision.empty()) try {
      softbody::precision_named(precision);
    } catch (const std::invalid_argument& error) {
      throw Error(error.what());
    }
  for (SoftBody& body : description.bodies) {
    if (!method.empty() || dt > 0 || !precision.empty()) body.solver.error = 0;
    if (!method.empty()) body.solver.method = method;
    if (dt > 0 || body.solver.method != softbody::filtered_leapfrog().name) body.solver.wanted_error = 0;
    if (body.solver.method != softbody::xpbd().name) body.solver.iterations = 0;
    if (dt > 0) body.solver.dt = dt;
    if (!precision.empty()) body.solver.precision = softbody::precision_named(precision);
  }
  for (ParticleBody& body : description.particles) override_solver(body, method, dt, precision);
}

void choose_solvers(SceneDescription& description, double error) {
  for (SoftBody& body : description.bodies) {
    body.solver = {};
    body.solver.error = error;
  }
}

}  // namespace hooke::scene
