#include "shot.hpp"

#include "solids.hpp"

#include <scene/figures.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

namespace hooke::command {

namespace {

constexpr double kClothThickness = 2.5e-3;  // [m] as drawn
constexpr double kFollowWidth = 0.6;        // [s], standard deviation of the camera's average
constexpr Index kMostSticks = 20000;
constexpr double kShutter = 0.5;           // open for this share of a frame
constexpr double kStray = 0.02;            // share of the particles at either end that the picture need not hold
constexpr double kWetness = 0.7;           // of stone beside water
constexpr double kPoolStart = 2;           // [s] of drops that fell in before the first picture
constexpr double kPoolRim = 2;             // water shows by what it mirrors
const Vec3 kPoolFloor{0.09, 0.10, 0.115};  // drops are seen by the light they bend: before a dark ground
constexpr double kCrease = 40 * std::numbers::pi / 180;
const Vec3 kClothColor{0.42, 0.022, 0.028}, kInsideColor{0.05, 0.04, 0.045}, kSolidColor{0.40, 0.42, 0.45};

render::Material material_of(scene::Surface look, const std::optional<Vec3>& color, bool wet) {
  render::Material material;
  material.color = kSolidColor;
  if (look == scene::Surface::Stone) material = render::sandstone();
  if (look == scene::Surface::Steel) material = render::steel();
  if (look == scene::Surface::Water) material = render::water();  // a pool
  if (color) material.color = *color;
  if (look == scene::Surface::Stone || look == scene::Surface::Steel) material.inside_color = material.color;
  if (look == scene::Surface::Stone && wet) material.wetness = kWetness;
  return material;
}

// What is drawn at zero.
Vec3 drawn_from(const scene::SceneDescription& scene) { return scene.camera ? scene.camera->origin : Vec3(0, 0, 0); }

// Where all but the outermost `kStray` of them are.
void cover_most(std::vector<float>& values, double& low, double& high) {
  const auto at = [&](double share) {
    const auto place = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return double(*place);
  };
  low = std::min(low, at(kStray)), high = std::max(high, at(1 - kStray));
}

// The hips, as they would move if they did nothing abruptly: a Gaussian average over time.
Vec3 followed(const human::Human& human, double t, double least_time, std::vector<io::JointFrame>& joints) {
  Vec3 sum = Vec3::Zero();
  double weights = 0;
  for (double offset = -3 * kFollowWidth; offset <= 3 * kFollowWidth + 1e-9; offset += kFollowWidth / 10) {
    human.pose(std::max(t + offset, least_time), joints);
    const double weight = std::exp(-0.5 * offset * offset / (kFollowWidth * kFollowWidth));
    sum += weight * joints[0].position;
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

Snapshot snapshot_of(const scene::Scene& scene, double simulate_ms) {
  Snapshot out{scene.shown_time(), simulate_ms, scene::worst_stretch(scene), {}, {}};
  const Eigen::Array3d from = drawn_from(scene.description).array();
  for (const scene::SceneBody& body : scene.bodies)
    out.points.push_back((body.body->positions().rowwise() - from.transpose()).cast<float>());
  for (const scene::SceneParticles& particles : scene.particles) {
    out.particles.push_back(particles.view());
    out.particles.back().positions.rowwise() -= from.cast<float>().transpose();
  }
  return out;
}

Shot::Shot(const scene::Scene& scene, const std::vector<Snapshot>& snapshots, double aspect)
    : scene_(scene), snapshots_(snapshots) {
  for (const Snapshot& snapshot : snapshots) mean_ms_ += snapshot.simulate_ms;
  if (snapshots.size() > 1) mean_ms_ /= double(snapshots.size() - 1);  // nothing is simulated for the first
  find_bounds();
  find_path();
  for (const scene::SceneBody& body : scene.bodies) add_body(body);
  for (const scene::SceneParticles& particles : scene.particles)
    particles_.emplace_back(particles.kinds(), kShutter / scene.description.frame_rate);
  add_colliders();
  choose_camera(aspect);
}

void Shot::add_body(const scene::SceneBody& body) {
  Drawn drawn;
  drawn.material.color = body.color.value_or(kClothColor);
  drawn.material.inside_color = body.inside_color.value_or(kInsideColor);
  if (body.look == scene::BodyLook::Jelly) {
    drawn.mesh.triangles = body.triangles;
    drawn.material = render::jelly();
    if (body.color) drawn.material.color = *body.color;
    drawn.subdivisions = body.body->size() <= 20000 ? 2 : 1;
  } else if (!body.triangles.empty()) {  // else sticks, made anew in every picture
    drawn.mesh.triangles = body.triangles;
    drawn.material.kind = render::Material::Kind::Cloth;
    drawn.material.sheen = 0.25 * drawn.material.color + Vec3::Constant(0.09);
    drawn.uv = body.uv;
    drawn.thickness = kClothThickness;
    drawn.subdivisions = body.body->size() <= 20000 ? 1 : 0;
  }
  drawn_.push_back(std::move(drawn));
}

void Shot::add_colliders() {
  const auto& colliders = scene_.world.colliders();
  for (const scene::SceneHuman& human : scene_.humans) {
    Drawn drawn;
    drawn.mesh = human.human.skin();
    if (const auto& color = scene_.description.colliders[human.collider].color) drawn.material.color = *color;
    drawn_.push_back(std::move(drawn));
  }
  for (std::size_t i = 0; i < colliders.size(); ++i) {
    const bool human = std::any_of(scene_.humans.begin(), scene_.humans.end(),
                                   [&](const scene::SceneHuman& each) { return each.collider == i; });
    if (human || colliders[i].shapes.empty() || std::holds_alternative<HalfSpace>(colliders[i].shapes[0])) continue;
    colliders_.push_back(i);
    const scene::ColliderDescription& says = scene_.description.colliders[i];
    const auto* set = std::get_if<LevelSet>(&colliders[i].shapes[0]);
    if (says.look == scene::Surface::Water && set && !colliders[i].motion) {
      colliders_.pop_back();
      LevelSet seen = *set;
      seen.offset -= drawn_from(scene_.description);
      pools_.emplace_back(seen);
      waters_.push_back(material_of(says.look, says.color, false));
      continue;
    }
    meshes_.push_back(scene_.meshes[i] ? with_creases(*scene_.meshes[i], kCrease) : TriangleMesh{});
    Drawn drawn;
    drawn.material = material_of(says.look, says.color, any({scene::Look::Drop, scene::Look::Water}));
    drawn_.push_back(std::move(drawn));
  }
}

std::vector<Shape> Shot::shapes_at(std::size_t collider, double shown_time) const {
  const Collider& solid = scene_.world.colliders()[collider];
  std::vector<Shape> shapes = solid.shapes;
  if (solid.motion) solid.motion(shown_time + scene_.description.preroll, shapes);
  const Vec3 from = drawn_from(scene_.description);
  for (Shape& shape : shapes) {
    if (auto* half = std::get_if<HalfSpace>(&shape))
      half->offset -= half->normal.dot(from);
    else if (auto* sphere = std::get_if<Sphere>(&shape))
      sphere->center -= from;
    else if (auto* capsule = std::get_if<Capsule>(&shape))
      capsule->a -= from, capsule->b -= from;
    else if (auto* box = std::get_if<Box>(&shape))
      box->center -= from;
    else
      std::get<LevelSet>(shape).offset -= from;
  }
  return shapes;
}

void Shot::find_bounds() {
  Vec3 low = Vec3::Constant(1e300), high = -low;
  const auto cover = [&](const Vec3& x, double radius) {
    low = low.cwiseMin((x.array() - radius).matrix());
    high = high.cwiseMax((x.array() + radius).matrix());
  };
  std::optional<double> floor;
  for (const Snapshot& snapshot : snapshots_) {
    for (const Points<float>& points : snapshot.points) {
      if (points.rows() == 0) continue;
      cover(points.colwise().minCoeff().matrix().transpose().cast<double>(), 0);
      cover(points.colwise().maxCoeff().matrix().transpose().cast<double>(), 0);
    }
    for (std::size_t i = 0; i < scene_.world.colliders().size(); ++i)
      for (const Shape& shape : shapes_at(i, snapshot.time)) {
        if (const auto* half = std::get_if<HalfSpace>(&shape)) {
          if (half->normal.y() > 0.999) floor = std::max(floor.value_or(half->offset), half->offset);
        } else if (const auto* sphere = std::get_if<Sphere>(&shape)) {
          cover(sphere->center, sphere->radius);
        } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
          cover(capsule->a, capsule->radius);
          cover(capsule->b, capsule->radius);
        } else if (const auto* box = std::get_if<Box>(&shape)) {
          const Vec3 extent = box->axes.cwiseAbs() * box->half_extent;
          cover(box->center - extent, 0);
          cover(box->center + extent, 0);
        } else {
          const auto& set = std::get<LevelSet>(shape);
          cover(set.offset + set.grid->lower(), 0);
          cover(set.offset + set.grid->upper(), 0);
        }
      }
  }
  std::vector<float> places;
  for (int k = 0; k < 3; ++k) {
    places.clear();
    for (const Snapshot& snapshot : snapshots_)
      for (const scene::ParticleView& view : snapshot.particles)
        places.insert(places.end(), view.positions.col(k).begin(), view.positions.col(k).end());
    if (!places.empty()) cover_most(places, low[k], high[k]);
  }
  if (low.x() > high.x()) low = Vec3::Zero(), high = Vec3::Ones();
  // Without a floor everything hangs a little above that of the stage.
  const double gap = 0.15 * (high - low).norm();
  lift_ = floor ? -*floor : std::max(0.0, gap - low.y());
  lower_ = low, upper_ = high;
  lower_.y() += lift_;
  upper_.y() += lift_;
}

void Shot::find_path() {
  path_.assign(snapshots_.size(), Vec3::Zero());
  if (scene_.humans.empty()) return;
  const human::Human& human = scene_.humans[0].human;
  std::vector<io::JointFrame> joints(human.joint_names().size());
  for (std::size_t i = 0; i < path_.size(); ++i) {
    path_[i] = followed(human, snapshots_[i].time, human.start_time(), joints) - drawn_from(scene_.description);
    path_[i].y() = 0;
  }
}

void Shot::choose_camera(double aspect) {
  if (const auto& given = scene_.description.camera) {
    camera_.eye = given->eye + Vec3(0, lift_, 0);
    camera_.target = given->target + Vec3(0, lift_, 0);
    camera_.vertical_fov_degrees = given->fov;
    if (!given->follow) path_.assign(path_.size(), Vec3::Zero());
    return;
  }
  if (scene_.humans.empty()) {
    camera_ = render::frame_subject(lower_, upper_, {-0.45, -0.30, -1}, 30, aspect, 0.10);
    return;
  }
  // From the floor to the highest the figure ever reaches, at the smoothed place.
  camera_.vertical_fov_degrees = 28;
  const double half = 0.54 * upper_.y(), slope = std::tan(14 * std::numbers::pi / 180);
  const double distance = half / slope + 0.25 * upper_.y();
  camera_.target = {0, 0.49 * upper_.y(), 0};
  camera_.eye = camera_.target + distance * Vec3(0.52, 0.10, 0.85).normalized();
}

render::Camera Shot::camera_at(std::size_t frame) const {
  render::Camera camera = camera_;
  camera.eye += path_[frame];
  camera.target += path_[frame];
  return camera;
}

render::Look Shot::look() const {
  if (any({scene::Look::Spark})) {
    render::Look look = render::workshop_for(camera_at(0));
    // Cloth and people are to be seen beside the sparks.
    if (!scene_.bodies.empty()) look.key_intensity *= 2.5, look.rim_intensity *= 2.5, look.fill_intensity *= 2;
    return look;
  }
  render::Look look = render::look_for(camera_at(0));
  if (any({scene::Look::Drop, scene::Look::Water})) look.floor_color = kPoolFloor, look.rim_intensity = kPoolRim;
  return look;
}

bool Shot::any(std::initializer_list<scene::Look> looks) const {
  for (const scene::SceneParticles& particles : scene_.particles)
    for (const scene::ParticleKind& kind : particles.kinds())
      if (std::find(looks.begin(), looks.end(), kind.look) != looks.end()) return true;
  return false;
}

// Pools remember: every frame before this one has its share in the waves.
void Shot::fill_pools(std::size_t frame) {
  if (pools_.empty()) return;
  std::vector<std::vector<scene::ParticleKind>> kinds;
  for (const scene::SceneParticles& particles : scene_.particles) kinds.push_back(particles.kinds());
  const double seconds = 1 / scene_.description.frame_rate;
  const auto advance = [&](std::size_t with) {
    for (Pool& pool : pools_) pool.advance(snapshots_[with].particles, kinds, seconds);
  };
  if (frame + 1 < pool_frame_) {
    for (Pool& pool : pools_) pool.calm();
    pool_frame_ = 0;
  }
  if (pool_frame_ == 0) {  // what was there before the first picture is taken from those after it
    const auto before = std::min(snapshots_.size(), std::size_t(kPoolStart / seconds));
    for (std::size_t k = before; k-- > 0;) advance(k);
    advance(0);
    pool_frame_ = 1;
  }
  for (; pool_frame_ <= frame; ++pool_frame_) advance(pool_frame_);
}

void Shot::place(std::size_t frame) {
  const Snapshot& snapshot = snapshots_[frame];
  std::size_t next = 0;
  for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
    TriangleMesh& mesh = drawn_[next++].mesh;
    const Points<double> points = snapshot.points[b].cast<double>();
    if (!scene_.bodies[b].triangles.empty()) {
      mesh.vertices = points;
      continue;
    }
    mesh = {};
    std::vector<std::pair<int, int>> sticks;
    for (const softbody::Spring& spring : scene_.bodies[b].network->springs)
      if (Index(sticks.size()) < kMostSticks) sticks.emplace_back(spring.a, spring.b);
    if (points.rows() <= kMostSticks)
      append_sticks(points, sticks, 0.004 * std::max(0.05, (upper_ - lower_).norm()), mesh);
  }
  for (const scene::SceneHuman& human : scene_.humans) {
    human.human.skin(snapshot.time, drawn_[next].mesh.vertices);
    drawn_[next++].mesh.vertices.rowwise() -= drawn_from(scene_.description).transpose().array();
  }
  for (std::size_t i = 0; i < colliders_.size(); ++i) {
    TriangleMesh& mesh = drawn_[next++].mesh;
    mesh = meshes_[i];
    for (const Shape& shape : shapes_at(colliders_[i], snapshot.time)) {
      append_shape(shape, mesh);
      if (const auto* set = std::get_if<LevelSet>(&shape)) mesh.vertices.rowwise() += set->offset.transpose().array();
    }
  }
  for (Drawn& drawn : drawn_) drawn.mesh.vertices.col(1) += lift_;
}

std::string Shot::solver() const {
  if (scene_.bodies.empty() && scene_.particles.empty()) return {};
  const Body& first = scene_.bodies.empty() ? scene_.particles[0].body() : *scene_.bodies[0].body;
  const MotionFacts facts = first.motion_facts();
  char text[200];
  std::snprintf(text, sizeof text, "%s, %s, step %.3g ms", facts.method.c_str(), facts.precision.c_str(),
                1e3 * scene_.world.clock().tick() / double(std::max<Index>(1, facts.substeps)));
  return text;
}

std::vector<std::string> Shot::caption(std::size_t frame) const {
  const scene::SceneDescription& d = scene_.description;
  std::vector<std::string> lines{d.title.empty() ? d.file : d.title};
  Index points = 0;
  for (const scene::SceneBody& body : scene_.bodies) points += body.body->size();
  if (const std::string line = solver(); !line.empty())
    lines.push_back(scene_.bodies.empty() ? line : std::to_string(points) + " points, " + line);
  char text[200];
  Index alive = 0;
  for (const scene::ParticleView& view : snapshots_[frame].particles) alive += view.positions.rows();
  std::string line;
  if (!scene_.particles.empty()) line += std::to_string(alive) + " particles, ";
  std::snprintf(text, sizeof text, "%.3g ms a frame", mean_ms_);
  line += text;
  if (!scene_.bodies.empty()) {
    std::snprintf(text, sizeof text, ", worst stretch %.1f %%", 100 * snapshots_[frame].worst_stretch);
    line += text;
  }
  lines.push_back(line);
  return lines;
}

render::Image Shot::draw(render::Stage& stage, std::size_t frame) { return draw(stage, frame, caption(frame)); }

render::Image Shot::draw(render::Stage& stage, std::size_t frame, const std::vector<std::string>& lines) {
  place(frame);
  std::vector<render::Model> models;
  for (const Drawn& drawn : drawn_) {
    if (drawn.mesh.vertices.rows() == 0 || drawn.mesh.triangles.empty()) continue;
    render::Model model;
    model.mesh = &drawn.mesh;
    model.material = drawn.material;
    if (drawn.uv.rows() > 0) model.uv = &drawn.uv;
    model.thickness = drawn.thickness;
    model.subdivisions = drawn.subdivisions;
    models.push_back(model);
  }
  fill_pools(frame);
  std::vector<TriangleMesh> pools;
  for (const Pool& pool : pools_) {
    pools.push_back(pool.mesh());
    pools.back().vertices.col(1) += lift_;
  }
  for (std::size_t i = 0; i < pools_.size(); ++i) {
    render::Model model;
    model.mesh = &pools[i];
    model.material = waters_[i];
    model.cover = &pools_[i].foam();
    models.push_back(model);
  }
  std::vector<render::Particles> particles;
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    particles_[i].place(snapshots_[frame].particles[i], lift_);
    particles_[i].append(particles);
    particles_[i].append(models);
  }
  ++pictures_;
  return stage.draw(models, particles, camera_at(frame), lines);
}

std::string Shot::told() const {
  double seconds = 0;
  for (const ParticleShot& particles : particles_) seconds += particles.meshing_seconds();
  if (seconds == 0) return {};
  char text[80];
  std::snprintf(text, sizeof text, "water surface: %.3g ms a picture\n", 1e3 * seconds / double(pictures_));
  return text;
}

}  // namespace hooke::command
