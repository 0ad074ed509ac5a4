// A picture is made in these passes:
//   1. depth maps of the models from the key light, the rim light and each direction of the
//      dome that stands for light from all around;
//   2. a prepass, one sample a pixel: how far each pixel is and how it faces;
//   3. visibility: from 1 and 2, how much of each light every pixel sees; then a blur;
//   4. the lit picture, four samples a pixel, in linear light, with the sparks as lamps;
//   5. jelly, one body after the other from far to near, then water: they bend and mirror the picture so far;
//      jelly colours the key light in 4, by how much of it there is on the way;
//   6. layers of one sample a pixel over it: smoke and drops; sparks and their bloom;
//   7. development: tone curve, averaging, vignette and dither, down to 8 bits.
// Passes that a picture has no use for are left out.
// Nothing is random and nothing is kept between pictures except uploaded connectivity.
#include <render/stage.hpp>

#include <render/caption.hpp>
#include <render/context.hpp>
#include <render/effects.hpp>
#include <render/frame.hpp>
#include <render/shaders.hpp>
#include <render/surface.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

namespace hooke::render {

namespace {

using Eigen::Matrix4f;
using Eigen::Vector3f;

constexpr int kSamples = 4;
constexpr int kKeyMap = 2048, kRimMap = 1024, kDomeTile = 256, kJellyMap = 1024;
constexpr double kJellyDepth = 0.05;  // [m] after which a jelly's colour is what is left of light
constexpr int kDomeRows = kDomeDirections / kDomeColumns;
static_assert(kDomeRows * kDomeColumns == kDomeDirections);

struct Box {
  Vec3 lower{-0.5, 0, -0.5}, upper{0.5, 1, 0.5};
  Vec3 middle() const { return 0.5 * (lower + upper); }
  double radius() const { return 0.5 * (upper - lower).norm(); }
};

// A parallel light's view of a box: what it looks through, and half the size of that [m].
struct LightView {
  Matrix4f to_clip;
  Vec3 half_size;
};

Vec3 any_right_angle(const Vec3& direction) {
  const Vec3 helper = std::abs(direction.y()) < 0.95 ? Vec3(0, 1, 0) : Vec3(0, 0, 1);
  return helper.cross(direction).normalized();
}

// Sizes grow in steps and positions move by whole texels, so a moving subject does not
// make its shadow's edge shimmer.
LightView light_view(const Box& box, const Vec3& direction, int texels) {
  const Vec3 right = any_right_angle(direction), up = direction.cross(right);
  const Vec3 half_box = 0.5 * (box.upper - box.lower), middle = box.middle();
  const Vec3 axes[3] = {right, up, -direction};
  const double step = std::exp2(std::floor(std::log2(std::max(1e-3, box.radius())))) / 8;
  LightView view;
  view.to_clip.setIdentity();
  for (int k = 0; k < 3; ++k) {
    const double needed = half_box.dot(axes[k].cwiseAbs()) * 1.04 + 0.02;
    const double half = step * std::ceil(needed / step);
    const double texel = 2 * half / texels;
    const double at = texel * std::round(axes[k].dot(middle) / texel);
    view.half_size[k] = half;
    view.to_clip.row(k) << (axes[k] / half).transpose().cast<float>(), static_cast<float>(-at / half);
  }
  return view;
}

// Even over the sphere: equal steps in height, golden-angle turns. The first come from above.
std::vector<Vec3> dome_directions() {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3> directions;
  for (int k = 0; k < kDomeDirections; ++k) {
    const bool above = k < kDomeUpward;
    const double y = above ? (k + 0.5) / kDomeUpward : -(k - kDomeUpward + 0.5) / (kDomeDirections - kDomeUpward);
    const double r = std::sqrt(1 - y * y), angle = golden * k + 0.4;
    directions.emplace_back(r * std::cos(angle), y, r * std::sin(angle));
  }
  return directions;
}

View view_of(const Camera& camera, double aspect, double far_away) {
  const double fov = camera.vertical_fov_degrees;
  if (!(fov > 0 && fov < 180))
    throw std::invalid_argument("Stage: the field of view must be in (0, 180) degrees, got " + std::to_string(fov));
  const Vec3 sight = camera.target - camera.eye, across = sight.cross(camera.up);
  if (!camera.eye.allFinite() || !(sight.norm() > 1e-9) || !(across.norm() > 1e-9 * sight.norm() * camera.up.norm()))
    throw std::invalid_argument("Stage: the camera needs a finite eye, another target, and up not along the sight");
  View view;
  view.forward = sight.normalized();
  const Vec3 right = across.normalized(), up = right.cross(view.forward);
  const double tan_v = std::tan(fov * std::numbers::pi / 360);
  view.ray_right = right * tan_v * aspect;
  view.ray_up = up * tan_v;

  const double near = std::clamp(0.02 * sight.norm(), 0.005, 0.1), far = far_away;
  view.near = near;
  Eigen::Matrix4d look = Eigen::Matrix4d::Identity(), lens = Eigen::Matrix4d::Zero();
  look.row(0) << right.transpose(), -right.dot(camera.eye);
  look.row(1) << up.transpose(), -up.dot(camera.eye);
  look.row(2) << -view.forward.transpose(), view.forward.dot(camera.eye);
  lens(0, 0) = 1 / (tan_v * aspect);
  lens(1, 1) = 1 / tan_v;
  lens(2, 2) = -(far + near) / (far - near);
  lens(2, 3) = -2 * far * near / (far - near);
  lens(3, 2) = -1;
  view.to_clip = (lens * look).cast<float>();
  return view;
}

// One mesh on the graphics side; connectivity goes up once.
struct Uploaded {
  std::optional<Surface> surface;
  GLuint array = 0, vertices = 0, indices = 0;

  void make() {
    glGenVertexArrays(1, &array);
    glGenBuffers(1, &vertices);
    glGenBuffers(1, &indices);
    glBindVertexArray(array);
    glBindBuffer(GL_ARRAY_BUFFER, vertices);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
    const int sizes[4] = {3, 3, 2, 2};
    std::size_t offset = 0;
    for (GLuint k = 0; k < 4; ++k) {
      glEnableVertexAttribArray(k);
      glVertexAttribPointer(k, sizes[k], GL_FLOAT, GL_FALSE, sizeof(SurfaceVertex), reinterpret_cast<void*>(offset));
      offset += sizeof(float) * static_cast<std::size_t>(sizes[k]);
    }
  }

  void upload(const Model& model) {
    if (!array) make();
    glBindVertexArray(array);
    if (!surface || !surface->fits(model)) {
      surface.reset();
      surface.emplace(model);
      const auto& list = surface->indices();
      glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(list.size() * sizeof list[0]), list.data(),
                   GL_STATIC_DRAW);
    }
    surface->update(model.mesh->vertices);
    if (model.material.kind == Material::Kind::Water) surface->set_cover(model.cover, 0);
    if (model.material.kind == Material::Kind::Stone) surface->set_cover(model.cover, 1);
    const auto& list = surface->vertices();
    glBindBuffer(GL_ARRAY_BUFFER, vertices);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(list.size() * sizeof list[0]), list.data(), GL_STREAM_DRAW);
  }

  void draw(const Surface::Range& range) const {
    glBindVertexArray(array);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(range.count), GL_UNSIGNED_INT,
                   reinterpret_cast<void*>(range.first * sizeof(std::uint32_t)));
  }
};

void require_drawable(const Model& model) {
  const auto share = [](const Vec3& c) { return c.allFinite() && (c.array() >= 0).all() && (c.array() <= 1).all(); };
  const Material& m = model.material;
  if (!model.mesh) throw std::invalid_argument("it has no mesh");
  if (!share(m.color) || !share(m.inside_color) || !share(m.sheen))
    throw std::invalid_argument("colours must be in [0, 1]");
  if (!(m.roughness > 0 && m.roughness <= 1))
    throw std::invalid_argument("roughness must be in (0, 1], got " + std::to_string(m.roughness));
  if (!(m.weave >= 0) || !(model.thickness >= 0) || !std::isfinite(m.weave) || !std::isfinite(model.thickness))
    throw std::invalid_argument("weave and thickness must not be negative");
  if (!(m.wetness >= 0 && m.wetness <= 1))
    throw std::invalid_argument("wetness must be in [0, 1], got " + std::to_string(m.wetness));
  if (model.thickness > 0 &&
      (m.kind == Material::Kind::Water || m.kind == Material::Kind::Stone || m.kind == Material::Kind::Jelly))
    throw std::invalid_argument("water, stone and jelly must have no thickness");
  if (model.subdivisions < 0 || model.subdivisions > 2)
    throw std::invalid_argument("subdivisions must be 0 to 2, got " + std::to_string(model.subdivisions));
}

void require_look(const Look& look) {
  if (!look.key_direction.allFinite() || !look.rim_direction.allFinite() || look.key_direction.norm() < 1e-9 ||
      look.rim_direction.norm() < 1e-9 || !(look.key_size >= 0 && look.key_size < 2))
    throw std::invalid_argument("Stage: light directions must be finite and not zero, key_size in [0, 2)");
  if (!(look.bloom >= 0 && look.bloom <= 1))
    throw std::invalid_argument("Stage: bloom must be in [0, 1], got " + std::to_string(look.bloom));
}

bool is_water(const Model& model) { return model.material.kind == Material::Kind::Water; }
bool is_jelly(const Model& model) { return model.material.kind == Material::Kind::Jelly; }
bool is_solid(const Model& model) { return !is_water(model) && !is_jelly(model); }

// What a metre of jelly takes of light, as an exponent.
Vec3 absorbed_by(const Material& jelly) {
  return -jelly.color.cwiseMax(0.004).cwiseMin(0.995).array().log().matrix() / kJellyDepth;
}

bool any_of_kind(std::span<const Particles> particles, bool sparks) {
  return std::any_of(particles.begin(), particles.end(), [&](const Particles& p) {
    return (p.kind == Particles::Kind::Sparks) == sparks && p.positions->rows() > 0;
  });
}

Shade shade_of(Material::Kind kind) {
  switch (kind) {
    case Material::Kind::Cloth:
      return Shade::Cloth;
    case Material::Kind::Stone:
      return Shade::Stone;
    case Material::Kind::Metal:
      return Shade::Metal;
    default:
      return Shade::Matte;
  }
}

}  // namespace

Look look_for(const Camera& camera) {
  Look look;
  const Vec3 sight = camera.target - camera.eye;
  const double turn = std::atan2(-sight.x(), -sight.z());  // 0 for a camera on the +z side
  const Eigen::AngleAxisd about_up(turn, Vec3::UnitY());
  look.key_direction = about_up * look.key_direction;
  look.rim_direction = about_up * look.rim_direction;
  return look;
}

Look workshop_for(const Camera& camera) {
  Look look = look_for(camera);
  look.key_intensity = 0.10;
  look.rim_intensity = 0.16;
  look.fill_intensity = 0.07;
  look.floor_color = {0.20, 0.195, 0.19};
  return look;
}

Material water() {
  Material material;
  material.kind = Material::Kind::Water;
  material.color = {0.80, 0.93, 0.93};
  material.roughness = 0.05;
  return material;
}

Material sandstone() {
  Material material;
  material.kind = Material::Kind::Stone;
  material.color = material.inside_color = {0.46, 0.39, 0.30};
  material.roughness = 0.85;
  return material;
}

Material steel() {
  Material material;
  material.kind = Material::Kind::Metal;
  material.color = material.inside_color = {0.56, 0.55, 0.53};
  material.roughness = 0.4;
  return material;
}

Material jelly() {
  Material material;
  material.kind = Material::Kind::Jelly;
  material.color = {0.80, 0.06, 0.10};
  material.roughness = 0.05;
  return material;
}

Lights lights_of(const Look& look) {
  return {look.key_intensity * Vec3(2.05, 1.90, 1.68), look.rim_intensity * Vec3(1.35, 1.68, 2.15),
          look.fill_intensity * Vec3(0.40, 0.44, 0.50), look.fill_intensity * Vec3(0.95, 0.90, 0.85)};
}

void set_pixels(gl::Program& program, const Frame& frame) {
  program.set("eye", frame.camera.eye);
  program.set("forward", frame.view.forward);
  program.set("ray_right", frame.view.ray_right);
  program.set("ray_up", frame.view.ray_up);
  program.set("picture", Eigen::Vector2f(static_cast<float>(frame.width), static_cast<float>(frame.height)));
  program.set_texture("normal_depth", 0, GL_TEXTURE_2D, frame.normal_depth);
}

void set_lights(gl::Program& program, const Look& look) {
  const Lights lights = lights_of(look);
  program.set("key_direction", Vec3(look.key_direction.normalized()));
  program.set("rim_direction", Vec3(look.rim_direction.normalized()));
  program.set("key_color", lights.key);
  program.set("rim_color", lights.rim);
  program.set("sky_color", lights.sky);
  program.set("ground_color", lights.ground);
  program.set("floor_color", look.floor_color);
  program.set("key_size", look.key_size);
}

void set_lamps(gl::Program& program, const std::vector<Lamp>& lamps) {
  constexpr double least_size = 0.02;  // [m] no spark makes a point of light on what it touches
  std::vector<Eigen::Vector4f> places;
  std::vector<Vector3f> powers;
  for (const Lamp& lamp : lamps) {
    const Vector3f at = lamp.place.cast<float>();
    places.emplace_back(at.x(), at.y(), at.z(), static_cast<float>(lamp.size * lamp.size + least_size * least_size));
    powers.push_back(lamp.power.cast<float>());
  }
  program.set("lamps", static_cast<int>(lamps.size()));
  if (lamps.empty()) return;
  program.set("lamp_place", std::span<const Eigen::Vector4f>(places));
  program.set("lamp_power", std::span<const Vector3f>(powers));
}

struct Stage::Studio {
  Studio(int width_, int height_, int supersample_, const Look& look_);
  void make_floor();
  void make_targets();
  Box upload(std::span<const Model> models);
  void draw_depth_maps(std::span<const Model> models, const Box& box);
  void draw_floor(gl::Program& program, const View& view);
  void draw_tint(std::span<const Model> models);
  void draw_prepass(std::span<const Model> models, const Frame& frame, bool (*which)(const Model&));
  void draw_visibility(const Frame& frame, const Box& box);
  gl::Program& lit(Shade shade, bool lamps);
  void draw_lit(std::span<const Model> models, const Frame& frame);
  GLuint resolve();
  void draw_jelly(std::span<const Model> models, const Frame& frame, const Box& box);
  void draw_water(std::span<const Model> models, const Frame& frame);
  Image develop(bool veil, bool glow);
  Image draw(std::span<const Model> models, std::span<const Particles> particles, const Camera& camera);

  int width, height, supersample;
  Look look;
  gl::Context context;
  gl::Program depth, prepass, floor_prepass, visibility, blur;
  // Compiled when first needed.
  std::array<std::array<gl::Program, 4>, kShades> lit_programs;
  std::array<gl::Program, 4> developers;
  gl::Program resolver, water, tint, jelly_program;
  std::optional<Effects> effects;
  GLuint scene = 0, scene_target = 0;
  // Jelly: seen from the key light, its colour and nearest side; seen from the camera, its far side and what is solid.
  GLuint tint_map = 0, tint_target = 0, front_map = 0, front_target = 0, back = 0, back_target = 0, solid = 0,
         solid_target = 0;
  bool any_jelly = false;
  GLuint empty_array = 0, floor_array = 0;
  GLsizei floor_count = 0;
  GLuint key_map = 0, rim_map = 0, dome_map = 0, key_target = 0, rim_target = 0, dome_target = 0;
  GLuint normal_depth = 0, prepass_target = 0;
  GLuint visible[2] = {0, 0}, visible_target[2] = {0, 0};
  GLuint light = 0, light_target = 0, finished_target = 0;
  GLuint compare_sampler = 0;
  std::vector<Uploaded> uploaded;
  std::vector<Vec3> dome = dome_directions();
  LightView key_view, rim_view;
  std::vector<Matrix4f> dome_views;
  double dome_reach = 1;
  Vec3 floor_center{0, 0, 0};
  double floor_radius = 8;

  int drawn_width() const { return width * supersample; }
  int drawn_height() const { return height * supersample; }
};

Stage::Studio::Studio(int width_, int height_, int supersample_, const Look& look_)
    : width(width_), height(height_), supersample(supersample_), look(look_) {
  const gl::Context::Current current(context);
  depth = gl::Program("depth", depth_vertex_shader(), depth_fragment_shader());
  prepass = gl::Program("prepass", surface_vertex_shader(), prepass_fragment_shader());
  floor_prepass = gl::Program("floor prepass", floor_vertex_shader(), prepass_fragment_shader());
  visibility = gl::Program("visibility", full_screen_vertex_shader(), visibility_fragment_shader());
  blur = gl::Program("blur", full_screen_vertex_shader(), blur_fragment_shader());
  make_floor();
  make_targets();
  gl::check("the studio's construction");
}

// Rings of the floor's profile: flat, the quarter circle, and the wall.
void Stage::Studio::make_floor() {
  constexpr int around = 96;
  std::vector<float> rings = {0, 0.25f, 0.5f, 0.75f};
  for (int k = 0; k <= 24; ++k) rings.push_back(1 + 2.36f * static_cast<float>(k) / 24);
  rings.push_back(6);
  std::vector<float> points;
  for (const float ring : rings)
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      for (const float value : {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), ring})
        points.push_back(value);
    }
  std::vector<std::uint32_t> indices;
  for (std::uint32_t ring = 0; ring + 1 < rings.size(); ++ring)
    for (std::uint32_t k = 0; k < around; ++k) {
      const std::uint32_t a = ring * around + k, b = ring * around + (k + 1) % around;
      for (const std::uint32_t i : {a, b, a + around, b, b + around, a + around}) indices.push_back(i);
    }
  floor_count = static_cast<GLsizei>(indices.size());
  GLuint buffers[2];
  glGenVertexArrays(1, &empty_array);
  glGenVertexArrays(1, &floor_array);
  glGenBuffers(2, buffers);
  glBindVertexArray(floor_array);
  glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(points.size() * sizeof points[0]), points.data(),
               GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof indices[0]), indices.data(),
               GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
}

void Stage::Studio::make_targets() {
  const int w = drawn_width(), h = drawn_height();
  key_map = gl::make_depth_map(kKeyMap, kKeyMap);
  rim_map = gl::make_depth_map(kRimMap, kRimMap);
  dome_map = gl::make_depth_map(kDomeTile * kDomeColumns, kDomeTile * kDomeRows);
  key_target = gl::make_framebuffer(GL_TEXTURE_2D, 0, key_map);
  rim_target = gl::make_framebuffer(GL_TEXTURE_2D, 0, rim_map);
  dome_target = gl::make_framebuffer(GL_TEXTURE_2D, 0, dome_map);
  normal_depth = gl::make_texture(GL_RGBA32F, w, h, GL_NEAREST);
  const GLuint prepass_depth = gl::make_texture(GL_DEPTH_COMPONENT32F, w, h, GL_NEAREST);
  prepass_target = gl::make_framebuffer(GL_TEXTURE_2D, normal_depth, prepass_depth);
  for (int k = 0; k < 2; ++k) {
    visible[k] = gl::make_texture(GL_RGBA16F, w, h, GL_NEAREST);
    visible_target[k] = gl::make_framebuffer(GL_TEXTURE_2D, visible[k], 0);
  }
  light = gl::make_texture(GL_RGBA16F, w, h, GL_NEAREST, kSamples);
  const GLuint light_depth = gl::make_texture(GL_DEPTH_COMPONENT32F, w, h, GL_NEAREST, kSamples);
  light_target = gl::make_framebuffer(GL_TEXTURE_2D_MULTISAMPLE, light, light_depth);
  finished_target = gl::make_framebuffer(GL_TEXTURE_2D, gl::make_texture(GL_RGBA8, width, height, GL_NEAREST), 0);

  glGenSamplers(1, &compare_sampler);
  for (const GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glSamplerParameteri(compare_sampler, which, GL_LINEAR);
  for (const GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glSamplerParameteri(compare_sampler, which, GL_CLAMP_TO_EDGE);
  glSamplerParameteri(compare_sampler, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glSamplerParameteri(compare_sampler, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
}

Box Stage::Studio::upload(std::span<const Model> models) {
  if (uploaded.size() < models.size()) uploaded.resize(models.size());
  std::optional<Box> box;
  for (std::size_t i = 0; i < models.size(); ++i) {
    try {
      require_drawable(models[i]);
      uploaded[i].upload(models[i]);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("Stage: model " + std::to_string(i) + ": " + error.what());
    }
    const Surface& surface = *uploaded[i].surface;
    if (surface.vertices().empty()) continue;
    if (!box) box = Box{surface.lower(), surface.upper()};
    box->lower = box->lower.cwiseMin(surface.lower());
    box->upper = box->upper.cwiseMax(surface.upper());
  }
  return box.value_or(Box{});
}

void Stage::Studio::draw_depth_maps(std::span<const Model> models, const Box& box) {
  // Jelly dims the light from all around, not that of the lamps.
  const auto draw_into = [&](const Matrix4f& to_clip, Surface::Range (Surface::*range)() const, bool jelly_too) {
    depth.set("to_clip", to_clip);
    for (std::size_t i = 0; i < models.size(); ++i)
      if (is_solid(models[i]) || (jelly_too && is_jelly(models[i]))) uploaded[i].draw((*uploaded[i].surface.*range)());
  };
  depth.use();
  const Vec3 key_direction = look.key_direction.normalized(), rim_direction = look.rim_direction.normalized();
  key_view = light_view(box, key_direction, kKeyMap);
  rim_view = light_view(box, rim_direction, kRimMap);
  glBindFramebuffer(GL_FRAMEBUFFER, key_target);
  glViewport(0, 0, kKeyMap, kKeyMap);
  glClear(GL_DEPTH_BUFFER_BIT);
  draw_into(key_view.to_clip, &Surface::sheet, false);
  glBindFramebuffer(GL_FRAMEBUFFER, rim_target);
  glViewport(0, 0, kRimMap, kRimMap);
  glClear(GL_DEPTH_BUFFER_BIT);
  draw_into(rim_view.to_clip, &Surface::sheet, false);

  glBindFramebuffer(GL_FRAMEBUFFER, dome_target);
  glClear(GL_DEPTH_BUFFER_BIT);
  dome_views.clear();
  dome_reach = 0;
  for (int k = 0; k < kDomeDirections; ++k) {
    const LightView view = light_view(box, dome[static_cast<std::size_t>(k)], kDomeTile);
    dome_reach = std::max({dome_reach, view.half_size.x(), view.half_size.y()});
    glViewport(kDomeTile * (k % kDomeColumns), kDomeTile * (k / kDomeColumns), kDomeTile, kDomeTile);
    draw_into(view.to_clip, &Surface::coarse, true);
    dome_views.push_back(view.to_clip);
  }
}

void Stage::Studio::draw_tint(std::span<const Model> models) {
  if (!tint) {
    tint = gl::Program("tint", depth_vertex_shader(), tint_fragment_shader());
    jelly_program = gl::Program("jelly", surface_vertex_shader(), jelly_fragment_shader());
    tint_map = gl::make_texture(GL_RGBA32F, kJellyMap, kJellyMap, GL_LINEAR);
    tint_target = gl::make_framebuffer(GL_TEXTURE_2D, tint_map, 0);
    front_map = gl::make_depth_map(kJellyMap, kJellyMap);
    front_target = gl::make_framebuffer(GL_TEXTURE_2D, 0, front_map);
    const int w = drawn_width(), h = drawn_height();
    back = gl::make_texture(GL_RGBA32F, w, h, GL_NEAREST);
    back_target = gl::make_framebuffer(GL_TEXTURE_2D, back, gl::make_texture(GL_DEPTH_COMPONENT32F, w, h, GL_NEAREST));
    solid = gl::make_texture(GL_RGBA32F, w, h, GL_NEAREST);
    solid_target = gl::make_framebuffer(GL_TEXTURE_2D, solid, 0);
  }
  glViewport(0, 0, kJellyMap, kJellyMap);
  glBindFramebuffer(GL_FRAMEBUFFER, front_target);
  glClear(GL_DEPTH_BUFFER_BIT);
  depth.use();
  depth.set("to_clip", key_view.to_clip);
  for (std::size_t i = 0; i < models.size(); ++i)
    if (is_jelly(models[i])) uploaded[i].draw(uploaded[i].surface->sheet());
  glBindFramebuffer(GL_FRAMEBUFFER, tint_target);
  glClear(GL_COLOR_BUFFER_BIT);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  tint.use();
  tint.set("to_clip", key_view.to_clip);
  tint.set("metres", 2 * key_view.half_size.z());
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (!is_jelly(models[i])) continue;
    tint.set("absorbed", absorbed_by(models[i].material));
    uploaded[i].draw(uploaded[i].surface->sheet());
  }
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
}

void Stage::Studio::draw_floor(gl::Program& program, const View& view) {
  program.set("to_clip", view.to_clip);
  program.set("floor_center", floor_center);
  program.set("floor_radius", floor_radius);
  glBindVertexArray(floor_array);
  glDrawElements(GL_TRIANGLES, floor_count, GL_UNSIGNED_INT, nullptr);
}

// The solid models and the floor; or the jelly or water, over what is there.
void Stage::Studio::draw_prepass(std::span<const Model> models, const Frame& frame, bool (*which)(const Model&)) {
  const bool first = which == is_solid;
  glBindFramebuffer(GL_FRAMEBUFFER, prepass_target);
  glViewport(0, 0, drawn_width(), drawn_height());
  if (first) glClear(GL_DEPTH_BUFFER_BIT | GL_COLOR_BUFFER_BIT);
  for (gl::Program* program : {&prepass, &floor_prepass}) {
    program->use();
    program->set("eye", frame.camera.eye);
    program->set("forward", frame.view.forward);
    program->set("to_clip", frame.view.to_clip);
    program->set("two_sided", 0);
  }
  prepass.use();
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (!which(models[i])) continue;
    prepass.set("two_sided", models[i].thickness > 0 ? 0 : 1);
    uploaded[i].draw(uploaded[i].surface->all());
  }
  if (!first) return;
  floor_prepass.use();
  draw_floor(floor_prepass, frame.view);
}

void Stage::Studio::draw_visibility(const Frame& frame, const Box& box) {
  glBindVertexArray(empty_array);
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_FRAMEBUFFER, visible_target[0]);
  visibility.use();
  set_pixels(visibility, frame);
  visibility.set_texture("key_depth", 1, GL_TEXTURE_2D, key_map);
  visibility.set_texture("rim_shadow", 2, GL_TEXTURE_2D, rim_map);
  visibility.set_texture("dome_shadow", 3, GL_TEXTURE_2D, dome_map);
  for (const GLuint unit : {2u, 3u}) glBindSampler(unit, compare_sampler);
  visibility.set("to_key", key_view.to_clip);
  visibility.set("to_rim", rim_view.to_clip);
  visibility.set("to_dome", dome_views);
  visibility.set("key_direction", Vec3(look.key_direction.normalized()));
  visibility.set("rim_direction", Vec3(look.rim_direction.normalized()));
  std::vector<Vector3f> directions;
  for (const Vec3& direction : dome) directions.push_back(direction.cast<float>());
  visibility.set("dome_direction", directions);
  visibility.set("key_extent", key_view.half_size);
  visibility.set("rim_extent", rim_view.half_size);
  visibility.set("dome_reach", dome_reach);
  visibility.set("key_tan", std::tan(0.5 * look.key_size));
  visibility.set("subject", box.middle());
  visibility.set("subject_radius", box.radius());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  for (const GLuint unit : {2u, 3u}) glBindSampler(unit, 0);

  blur.use();
  set_pixels(blur, frame);
  for (int k = 0; k < 2; ++k) {
    glBindFramebuffer(GL_FRAMEBUFFER, visible_target[1 - k]);
    blur.set_texture("visible", 1, GL_TEXTURE_2D, visible[k]);
    blur.set("along", Eigen::Vector2f(k == 0 ? 1.f : 0.f, k == 0 ? 0.f : 1.f));
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glEnable(GL_DEPTH_TEST);
}

gl::Program& Stage::Studio::lit(Shade shade, bool lamps) {
  gl::Program& program = lit_programs[static_cast<std::size_t>(shade)][(lamps ? 1u : 0u) + (any_jelly ? 2u : 0u)];
  if (!program)
    program = gl::Program("lit", shade == Shade::Floor ? floor_vertex_shader() : surface_vertex_shader(),
                          lit_fragment_shader(shade, lamps, any_jelly));
  return program;
}

void Stage::Studio::draw_lit(std::span<const Model> models, const Frame& frame) {
  glBindFramebuffer(GL_FRAMEBUFFER, light_target);
  glClear(GL_DEPTH_BUFFER_BIT | GL_COLOR_BUFFER_BIT);
  const auto set_jelly_light = [&](gl::Program& program) {
    program.set_texture("jelly_tint", 2, GL_TEXTURE_2D, tint_map);
    program.set_texture("jelly_front", 3, GL_TEXTURE_2D, front_map);
    program.set("to_key", key_view.to_clip);
    program.set("key_extent", key_view.half_size);
    program.set("key_tan", std::tan(0.5 * look.key_size));
  };
  const auto prepare = [&](Shade shade) -> gl::Program& {
    gl::Program& program = lit(shade, !frame.lamps.empty());
    program.use();
    set_pixels(program, frame);
    program.set_texture("visible", 1, GL_TEXTURE_2D, visible[0]);
    program.set("to_clip", frame.view.to_clip);
    set_lights(program, frame.look);
    set_lamps(program, frame.lamps);
    if (any_jelly) set_jelly_light(program);
    return program;
  };
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (!is_solid(models[i])) continue;
    const Material& m = models[i].material;
    gl::Program& program = prepare(shade_of(m.kind));
    program.set("two_sided", models[i].thickness > 0 ? 0 : 1);
    program.set("outside_color", m.color);
    program.set("inside_color", m.inside_color);
    program.set("sheen_color", m.sheen);
    program.set("roughness", m.roughness);
    program.set("weave", models[i].uv ? m.weave : 0.0);
    program.set("wetness", m.wetness);
    uploaded[i].draw(uploaded[i].surface->all());
  }
  draw_floor(prepare(Shade::Floor), frame.view);
}

// The picture so far, one sample a pixel.
GLuint Stage::Studio::resolve() {
  if (!resolver) {
    resolver = gl::Program("resolve", full_screen_vertex_shader(), resolve_fragment_shader());
    scene = gl::make_texture(GL_RGBA16F, drawn_width(), drawn_height(), GL_LINEAR);
    scene_target = gl::make_framebuffer(GL_TEXTURE_2D, scene, 0);
  }
  glBindVertexArray(empty_array);
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_FRAMEBUFFER, scene_target);
  resolver.use();
  resolver.set_texture("picture_light", 1, GL_TEXTURE_2D_MULTISAMPLE, light);
  resolver.set("samples", kSamples);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
  return scene;
}

void Stage::Studio::draw_jelly(std::span<const Model> models, const Frame& frame, const Box& box) {
  const int w = drawn_width(), h = drawn_height();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, prepass_target);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, solid_target);
  glBlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  draw_prepass(models, frame, is_jelly);
  draw_visibility(frame, box);

  std::vector<std::pair<double, std::size_t>> far_to_near;
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (!is_jelly(models[i]) || uploaded[i].surface->vertices().empty()) continue;
    const Surface& surface = *uploaded[i].surface;
    const Vec3 middle = 0.5 * (surface.lower() + surface.upper());
    far_to_near.emplace_back(-(middle - frame.camera.eye).dot(frame.view.forward), i);
  }
  std::sort(far_to_near.begin(), far_to_near.end());
  for (const auto& [unused, i] : far_to_near) {
    resolve();
    glBindFramebuffer(GL_FRAMEBUFFER, back_target);
    glClear(GL_DEPTH_BUFFER_BIT | GL_COLOR_BUFFER_BIT);
    glEnable(GL_CULL_FACE);
    glCullFace(GL_FRONT);
    prepass.use();
    prepass.set("two_sided", 0);
    uploaded[i].draw(uploaded[i].surface->all());
    glCullFace(GL_BACK);
    glBindFramebuffer(GL_FRAMEBUFFER, light_target);
    gl::Program& program = jelly_program;
    program.use();
    set_pixels(program, frame);
    set_lights(program, frame.look);
    program.set_texture("scene", 1, GL_TEXTURE_2D, scene);
    program.set_texture("solid", 2, GL_TEXTURE_2D, solid);
    program.set_texture("back", 3, GL_TEXTURE_2D, back);
    program.set_texture("visible", 4, GL_TEXTURE_2D, visible[0]);
    program.set_texture("jelly_front", 5, GL_TEXTURE_2D, front_map);
    program.set("to_clip", frame.view.to_clip);
    program.set("to_key", key_view.to_clip);
    program.set("key_extent", key_view.half_size);
    program.set("absorbed", absorbed_by(models[i].material));
    program.set("roughness", models[i].material.roughness);
    uploaded[i].draw(uploaded[i].surface->all());
    glDisable(GL_CULL_FACE);
  }
}

void Stage::Studio::draw_water(std::span<const Model> models, const Frame& frame) {
  resolve();
  if (!water) water = gl::Program("water", surface_vertex_shader(), water_fragment_shader());
  glBindFramebuffer(GL_FRAMEBUFFER, light_target);
  water.use();
  set_pixels(water, frame);
  set_lights(water, frame.look);
  water.set_texture("scene", 1, GL_TEXTURE_2D, scene);
  water.set("to_clip", frame.view.to_clip);
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (!is_water(models[i])) continue;
    water.set("outside_color", models[i].material.color);
    water.set("roughness", models[i].material.roughness);
    water.set("stream", models[i].material.stream ? 1 : 0);
    uploaded[i].draw(uploaded[i].surface->all());
  }
}

Image Stage::Studio::develop(bool veil, bool glow) {
  gl::Program& developer = developers[(veil ? 1u : 0u) + (glow ? 2u : 0u)];
  if (!developer) developer = gl::Program("develop", full_screen_vertex_shader(), develop_fragment_shader(veil, glow));
  glBindVertexArray(empty_array);
  glDisable(GL_DEPTH_TEST);
  glBindFramebuffer(GL_FRAMEBUFFER, finished_target);
  glViewport(0, 0, width, height);
  developer.use();
  developer.set_texture("picture_light", 0, GL_TEXTURE_2D_MULTISAMPLE, light);
  developer.set("supersample", supersample);
  developer.set("samples", kSamples);
  developer.set("exposure", look.exposure);
  if (veil) developer.set_texture("veil", 1, GL_TEXTURE_2D, effects->veil());
  if (glow) {
    developer.set_texture("glow", 2, GL_TEXTURE_2D, effects->glow());
    developer.set_texture("bloom", 3, GL_TEXTURE_2D, effects->bloom());
    developer.set("bloom_share", look.bloom);
  }
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);

  Image image{width, height, {}};
  const std::size_t row = 3 * static_cast<std::size_t>(width);
  image.rgb.resize(row * static_cast<std::size_t>(height));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
  for (int y = 0; y < height / 2; ++y)  // OpenGL's first row is the bottom
    std::swap_ranges(image.at(0, y), image.at(0, y) + row, image.at(0, height - 1 - y));
  return image;
}

Image Stage::Studio::draw(std::span<const Model> models, std::span<const Particles> particles, const Camera& camera) {
  for (std::size_t i = 0; i < particles.size(); ++i) {
    try {
      require_drawable(particles[i]);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("Stage: particles " + std::to_string(i) + ": " + error.what());
    }
  }
  const gl::Context::Current current(context);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_MULTISAMPLE);
  // The floor follows what the camera looks at and is always wider than the camera is far.
  floor_center = Vec3(camera.target.x(), 0, camera.target.z());
  const Vec3 away = camera.eye - floor_center;
  floor_radius = std::max(6.0, 1.2 * std::hypot(away.x(), away.z()));
  const Frame frame{
      camera,         view_of(camera, static_cast<double>(width) / height, 12 * floor_radius + away.norm()),
      look,           drawn_width(),
      drawn_height(), supersample,
      normal_depth,   lamps_of(particles, kMostLamps)};

  const Box box = upload(models);
  draw_depth_maps(models, box);
  any_jelly = std::any_of(models.begin(), models.end(), is_jelly);
  if (any_jelly) draw_tint(models);
  draw_prepass(models, frame, is_solid);
  draw_visibility(frame, box);
  draw_lit(models, frame);
  if (any_jelly) draw_jelly(models, frame, box);
  if (std::any_of(models.begin(), models.end(), is_water)) {
    draw_water(models, frame);
    draw_prepass(models, frame, is_water);
  }
  bool veil = false, glow = false;
  if (any_of_kind(particles, true) || any_of_kind(particles, false)) {
    if (!effects) effects.emplace(drawn_width(), drawn_height());
    if (any_of_kind(particles, false)) veil = effects->draw_veil(frame, particles, resolve());
    if (any_of_kind(particles, true)) glow = effects->draw_glow(frame, particles);
  }
  Image image = develop(veil, glow);
  gl::check("draw");
  return image;
}

Stage::Stage(int width, int height, int supersample, const Look& look) {
  if (width < 1 || height < 1 || width > 8192 || height > 8192 || supersample < 1 || supersample > 4)
    throw std::invalid_argument("Stage: width and height must be 1 to 8192 and supersample 1 to 4, got " +
                                std::to_string(width) + " x " + std::to_string(height) + ", " +
                                std::to_string(supersample));
  require_look(look);
  studio_ = std::make_unique<Studio>(width, height, supersample, look);
}

Stage::~Stage() = default;
Stage::Stage(Stage&&) noexcept = default;
Stage& Stage::operator=(Stage&&) noexcept = default;

void Stage::set_look(const Look& look) {
  require_look(look);
  studio_->look = look;
}

Image Stage::draw(std::span<const Model> models, const Camera& camera, const std::vector<std::string>& caption_lines) {
  return draw(models, {}, camera, caption_lines);
}

Image Stage::draw(std::span<const Model> models, std::span<const Particles> particles, const Camera& camera,
                  const std::vector<std::string>& caption_lines) {
  Image image = studio_->draw(models, particles, camera);
  draw_caption(image, caption_lines);
  return image;
}

}  // namespace hooke::render
