#include <render/effects.hpp>

#include <render/shaders.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

namespace hooke::render {

namespace {

constexpr int kPuffSize = 128, kPuffPatterns = 4;
constexpr int kPuffUnit = 2;
constexpr int kShadeCells = 96;

struct Streak {
  float head[3], radius, tail[3], radiance[3];
};
constexpr int kStreakSizes[] = {4, 3, 3};

struct Sprite {
  float place[3], radius, color[3], opacity, way[3], turn, lamp[3], shade;
};
constexpr int kSpriteSizes[] = {4, 4, 4, 4};

struct SortedSprite {
  float depth;
  Sprite sprite;
  Particles::Kind kind;
  const Image* texture;
};

Vec3 row(const Points<float>& points, Index i) { return points.row(i).matrix().transpose().cast<double>(); }

void copy(const Vec3& from, float* to) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(from[k]);
}

double seconds_seen(const Particles& p, Index i) {
  return p.ages ? std::min(p.shutter, double((*p.ages)(i))) : p.shutter;
}

double hash(int x, int y, int z) {
  auto h = std::uint32_t(x) * 0x8da6b343u ^ std::uint32_t(y) * 0xd8163841u ^ std::uint32_t(z) * 0xcb1ab31fu;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return double((h ^ (h >> 15)) & 0xffffff) / double(0x1000000);
}

double noise(double x, double y, int layer) {
  const double fx = std::floor(x), fy = std::floor(y);
  const int i = int(fx), j = int(fy);
  double u = x - fx, v = y - fy;
  u *= u * (3 - 2 * u);
  v *= v * (3 - 2 * v);
  return std::lerp(std::lerp(hash(i, j, layer), hash(i + 1, j, layer), u),
                   std::lerp(hash(i, j + 1, layer), hash(i + 1, j + 1, layer), u), v);
}

// How much a puff hides at a place of [-1, 1]²: a round cloud, frayed by noise.
double puff_density(double x, double y, int pattern) {
  const double rim = std::hypot(x, y);
  if (rim >= 1) return 0;
  double billows = 0, share = 0.5, scale = 2.2;
  for (int octave = 0; octave < 5; ++octave, share *= 0.52, scale *= 2.07)
    billows += share * (noise(scale * x + 17.3, scale * y + 5.9, 7 * pattern + octave) - 0.5);
  const double body = std::clamp(1.35 * (1 - rim) + 1.1 * billows, 0.0, 1.0);
  const double soft = 1 - rim * rim;
  return body * body * (3 - 2 * body) * soft * std::min(1.0, 3 * (1 - rim));
}

// Four patterns side by side: which way each place leans, and how much it hides.
std::vector<float> puff_pixels() {
  const int width = kPuffSize * kPuffPatterns;
  std::vector<double> density(std::size_t(width) * kPuffSize);
  const auto at = [&](int pattern, int x, int y) -> double& {
    return density[std::size_t(y) * width + std::size_t(pattern) * kPuffSize + std::size_t(x)];
  };
  std::vector<float> pixels(4 * density.size());
  for (int pattern = 0; pattern < kPuffPatterns; ++pattern) {
    for (int y = 0; y < kPuffSize; ++y)
      for (int x = 0; x < kPuffSize; ++x)
        at(pattern, x, y) = puff_density((2 * x + 1.0) / kPuffSize - 1, (2 * y + 1.0) / kPuffSize - 1, pattern);
    for (int y = 0; y < kPuffSize; ++y)
      for (int x = 0; x < kPuffSize; ++x) {
        const int e = kPuffSize - 1, reach = 3;
        const double dx = at(pattern, std::min(x + reach, e), y) - at(pattern, std::max(x - reach, 0), y);
        const double dy = at(pattern, x, std::min(y + reach, e)) - at(pattern, x, std::max(y - reach, 0));
        float* pixel = &pixels[4 * (std::size_t(y) * width + std::size_t(pattern) * kPuffSize + std::size_t(x))];
        pixel[0] = float(std::clamp(0.5 - 1.4 * dx, 0.0, 1.0));
        pixel[1] = float(std::clamp(0.5 - 1.4 * dy, 0.0, 1.0));
        pixel[2] = 0;
        pixel[3] = float(at(pattern, x, y));
      }
  }
  return pixels;
}

std::vector<float> picture_pixels(const Image& image) {
  std::vector<float> pixels;
  for (int y = image.height - 1; y >= 0; --y)  // OpenGL's first row is the bottom
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* rgb = image.at(x, y);
      const int most = std::max({rgb[0], rgb[1], rgb[2], std::uint8_t(1)});
      for (int k = 0; k < 3; ++k) pixels.push_back(std::pow(float(rgb[k]) / float(most), 2.2f));
      pixels.push_back(float(most) / 255.f);
    }
  return pixels;
}

GLuint upload_picture(GLuint into, int width, int height, const std::vector<float>& pixels) {
  if (!into) glGenTextures(1, &into);
  glActiveTexture(GL_TEXTURE0 + kPuffUnit);  // other units are in use
  glBindTexture(GL_TEXTURE_2D, into);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, width, height, 0, GL_RGBA, GL_FLOAT, pixels.data());
  for (const GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, which, GL_LINEAR);
  for (const GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, which, GL_CLAMP_TO_EDGE);
  return into;
}

// How much of the key light reaches each puff through those before it: they are laid, the
// nearest to the light first, on a coarse picture of what is let through.
void shade_smoke(std::vector<SortedSprite>& sprites, const Vec3& towards_key) {
  std::vector<std::pair<double, std::size_t>> order;
  const Vec3 right = towards_key.unitOrthogonal(), up = towards_key.cross(right);
  double low_u = 1e300, high_u = -1e300, low_v = 1e300, high_v = -1e300;
  const auto place = [&](std::size_t i) {
    const float* p = sprites[i].sprite.place;
    return Vec3(p[0], p[1], p[2]);
  };
  for (std::size_t i = 0; i < sprites.size(); ++i) {
    if (sprites[i].kind != Particles::Kind::Smoke) continue;
    const Vec3 x = place(i);
    order.emplace_back(-towards_key.dot(x), i);
    const double u = right.dot(x), v = up.dot(x), r = sprites[i].sprite.radius;
    low_u = std::min(low_u, u - r), high_u = std::max(high_u, u + r);
    low_v = std::min(low_v, v - r), high_v = std::max(high_v, v + r);
  }
  if (order.empty()) return;
  std::sort(order.begin(), order.end());  // equals keep the order of depth, which is the picture's alone
  const double cell = std::max({high_u - low_u, high_v - low_v, 1e-6}) / (kShadeCells - 1);
  std::vector<double> through(kShadeCells * kShadeCells, 1.0);
  for (const auto& [depth, i] : order) {
    Sprite& sprite = sprites[i].sprite;
    const Vec3 x = place(i);
    const double u = (right.dot(x) - low_u) / cell, v = (up.dot(x) - low_v) / cell, r = sprite.radius / cell;
    const int i0 = std::max(0, int(std::floor(u - r))), i1 = std::min(kShadeCells - 1, int(std::ceil(u + r)));
    const int j0 = std::max(0, int(std::floor(v - r))), j1 = std::min(kShadeCells - 1, int(std::ceil(v + r)));
    double seen = 0, weights = 0;
    const auto weight = [&](int a, int b) {
      const double d2 = ((a - u) * (a - u) + (b - v) * (b - v)) / (r * r + 0.5);
      return d2 < 1 ? (1 - d2) * (1 - d2) : 0.0;
    };
    for (int b = j0; b <= j1; ++b)
      for (int a = i0; a <= i1; ++a) {
        const double w = weight(a, b);
        seen += w * through[std::size_t(b * kShadeCells + a)];
        weights += w;
      }
    sprite.shade = weights > 0 ? float(seen / weights) : 1.f;
    for (int b = j0; b <= j1; ++b)
      for (int a = i0; a <= i1; ++a)
        through[std::size_t(b * kShadeCells + a)] *= 1 - 0.6 * sprite.opacity * weight(a, b);
  }
}

Vec3 lamp_light(const std::vector<Lamp>& lamps, const Vec3& place, double radius) {
  Vec3 sum(0, 0, 0);
  for (const Lamp& lamp : lamps) sum += lamp.power * lamp.falloff(place, radius);
  return 0.25 * sum;  // from one side, scattered to all
}

std::vector<SortedSprite> sprites_of(std::span<const Particles> particles, const Frame& frame) {
  std::vector<SortedSprite> sprites;
  for (const Particles& p : particles) {
    if (p.kind == Particles::Kind::Sparks) continue;
    for (Index i = 0; i < p.positions->rows(); ++i) {
      Vec3 x = row(*p.positions, i), way(0, 0, 0);
      if (p.velocities && p.kind == Particles::Kind::Drops) {
        way = seconds_seen(p, i) * row(*p.velocities, i);
        x -= 0.5 * way;
      }
      SortedSprite entry{};
      entry.depth = static_cast<float>((x - frame.camera.eye).dot(frame.view.forward));
      entry.kind = p.kind;
      entry.texture = p.kind == Particles::Kind::Smoke ? p.texture : nullptr;
      Sprite& sprite = entry.sprite;
      copy(x, sprite.place);
      sprite.radius = (*p.radii)(i);
      copy(p.colors ? row(*p.colors, i) : Vec3(1, 1, 1), sprite.color);
      sprite.opacity = p.opacities ? (*p.opacities)(i) : 1;
      copy(way, sprite.way);
      sprite.turn = p.turns ? (*p.turns)(i) : 0;
      copy(lamp_light(frame.lamps, x, sprite.radius), sprite.lamp);
      sprite.shade = 1;
      if (sprite.radius > 0 && sprite.opacity > 0 && entry.depth > frame.view.near) sprites.push_back(entry);
    }
  }
  // Everything that tells two sprites apart decides, so the order given does not.
  const auto key = [](const SortedSprite& s) {
    const float *x = s.sprite.place, *c = s.sprite.color;
    return std::tuple(-s.depth, x[0], x[1], x[2], s.kind, s.sprite.radius, s.sprite.opacity, s.sprite.turn, c[0], c[1],
                      c[2]);
  };
  std::sort(sprites.begin(), sprites.end(),
            [&](const SortedSprite& a, const SortedSprite& b) { return key(a) < key(b); });
  shade_smoke(sprites, frame.look.key_direction.normalized());
  return sprites;
}

void describe_stream(std::span<const int> sizes, std::size_t stride, std::size_t first) {
  std::size_t offset = first * stride;
  for (GLuint k = 0; k < sizes.size(); ++k) {
    glEnableVertexAttribArray(k);
    glVertexAttribPointer(k, sizes[k], GL_FLOAT, GL_FALSE, GLsizei(stride), reinterpret_cast<void*>(offset));
    glVertexAttribDivisor(k, 1);
    offset += sizeof(float) * std::size_t(sizes[k]);
  }
}

}  // namespace

Effects::Effects(int width, int height)
    : streaks_("streaks", streak_vertex_shader(), streak_fragment_shader()),
      puffs_("puffs", sprite_vertex_shader(), puff_fragment_shader()),
      drops_("drops", sprite_vertex_shader(), drop_fragment_shader()),
      narrow_("narrow", full_screen_vertex_shader(), narrow_fragment_shader()),
      widen_("widen", full_screen_vertex_shader(), widen_fragment_shader()) {
  glGenVertexArrays(1, &empty_array_);
  glGenVertexArrays(1, &array_);
  glGenBuffers(1, &buffer_);
  veil_ = gl::make_texture(GL_RGBA32F, width, height, GL_NEAREST);
  veil_target_ = gl::make_framebuffer(GL_TEXTURE_2D, veil_, 0);
  glow_ = gl::make_texture(GL_RGBA32F, width, height, GL_LINEAR);
  glow_target_ = gl::make_framebuffer(GL_TEXTURE_2D, glow_, 0);
  // Down to a dozen rows: the widest glow is a fixed share of the picture.
  int w = width, h = height;
  do {
    w = std::max(1, (w + 1) / 2), h = std::max(1, (h + 1) / 2);
    const GLuint map = gl::make_texture(GL_RGBA32F, w, h, GL_LINEAR);
    levels_.push_back({map, gl::make_framebuffer(GL_TEXTURE_2D, map, 0), w, h});
  } while (h > 20 || levels_.size() < 2);
}

bool Effects::draw_veil(const Frame& frame, std::span<const Particles> particles, GLuint scene) {
  const std::vector<SortedSprite> sorted = sprites_of(particles, frame);
  if (sorted.empty()) return false;
  std::vector<Sprite> sprites;
  sprites.reserve(sorted.size());
  for (const SortedSprite& entry : sorted) sprites.push_back(entry.sprite);

  glBindFramebuffer(GL_FRAMEBUFFER, veil_target_);
  glViewport(0, 0, frame.width, frame.height);
  const float clear[4] = {0, 0, 0, 1};
  glClearBufferfv(GL_COLOR, 0, clear);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE_MINUS_SRC_ALPHA);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, buffer_);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(sprites.size() * sizeof sprites[0]), sprites.data(), GL_STREAM_DRAW);
  for (gl::Program* program : {&puffs_, &drops_}) {
    program->use();
    set_pixels(*program, frame);
    set_lights(*program, frame.look);
    program->set("to_clip", frame.view.to_clip);
    program->set("near", frame.view.near);
    program->set("least_radius", 0.7 * frame.supersample);
    program->set("patterns", kPuffPatterns);
    program->set("puffs", program == &puffs_ ? 1 : 0);
    program->set_texture("scene", 1, GL_TEXTURE_2D, scene);
  }
  const auto in_picture = [&](const Vec3& v) {
    return Vec3(v.dot(frame.view.ray_right.normalized()), v.dot(frame.view.ray_up.normalized()),
                -v.dot(frame.view.forward));
  };
  puffs_.use();
  puffs_.set("key_direction", in_picture(frame.look.key_direction.normalized()));
  puffs_.set("rim_direction", in_picture(frame.look.rim_direction.normalized()));
  puffs_.set("above", in_picture(Vec3::UnitY()));
  std::vector<std::pair<const Image*, GLuint>> pictures;
  for (std::size_t first = 0, last; first < sorted.size(); first = last) {
    for (last = first; last < sorted.size() && sorted[last].kind == sorted[first].kind &&
                       sorted[last].texture == sorted[first].texture;)
      ++last;
    const Image* image = sorted[first].texture;
    GLuint map = puff_map_;
    if (sorted[first].kind == Particles::Kind::Drops) {
      drops_.use();
    } else {
      puffs_.use();
      if (image) {
        const auto found = std::find_if(pictures.begin(), pictures.end(), [&](auto& p) { return p.first == image; });
        map = found != pictures.end() ? found->second
                                      : upload_picture(0, image->width, image->height, picture_pixels(*image));
        if (found == pictures.end()) pictures.emplace_back(image, map);
      } else if (!puff_map_) {
        map = puff_map_ = upload_picture(0, kPuffSize * kPuffPatterns, kPuffSize, puff_pixels());
      }
      puffs_.set("pictured", image ? 1 : 0);
      puffs_.set("patterns", image ? 1 : kPuffPatterns);
      puffs_.set_texture("puff_map", kPuffUnit, GL_TEXTURE_2D, map);
    }
    describe_stream(kSpriteSizes, sizeof(Sprite), first);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(last - first));
  }
  for (const auto& [image, map] : pictures) glDeleteTextures(1, &map);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  return true;
}

bool Effects::draw_glow(const Frame& frame, std::span<const Particles> particles) {
  std::vector<Streak> streaks;
  for (const Particles& p : particles) {
    if (p.kind != Particles::Kind::Sparks) continue;
    for (Index i = 0; i < p.positions->rows(); ++i) {
      const double seen = seconds_seen(p, i);
      const double share = p.shutter > 0 ? seen / p.shutter : 1;
      Streak streak{};
      const Vec3 head = row(*p.positions, i);
      copy(head, streak.head);
      copy(head - seen * row(*p.velocities, i), streak.tail);
      copy(share * row(*p.colors, i), streak.radiance);
      streak.radius = (*p.radii)(i);
      if (share > 0 && streak.radius > 0 && p.colors->row(i).maxCoeff() > 0) streaks.push_back(streak);
    }
  }
  if (streaks.empty()) return false;
  glBindFramebuffer(GL_FRAMEBUFFER, glow_target_);
  glViewport(0, 0, frame.width, frame.height);
  const float clear[4] = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, clear);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, buffer_);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(streaks.size() * sizeof streaks[0]), streaks.data(), GL_STREAM_DRAW);
  glDisableVertexAttribArray(3);
  describe_stream(kStreakSizes, sizeof(Streak), 0);
  streaks_.use();
  set_pixels(streaks_, frame);
  streaks_.set("to_clip", frame.view.to_clip);
  streaks_.set("near", frame.view.near);
  streaks_.set("least_thickness", 1.5 * frame.supersample);
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(streaks.size()));
  spread(frame);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  return true;
}

// A lens spreads a share of all light, the more the nearer: as much to each doubling of
// the distance, less to the widest.
void Effects::spread(const Frame& frame) {
  glBindVertexArray(empty_array_);
  glDisable(GL_BLEND);
  narrow_.use();
  GLuint source = glow_;
  for (const Level& level : levels_) {
    glBindFramebuffer(GL_FRAMEBUFFER, level.target);
    glViewport(0, 0, level.width, level.height);
    narrow_.set_texture("source", 1, GL_TEXTURE_2D, source);
    narrow_.set("size", Eigen::Vector2f(float(level.width), float(level.height)));
    glDrawArrays(GL_TRIANGLES, 0, 3);
    source = level.map;
  }
  std::vector<float> shares;
  for (std::size_t k = 0; k < levels_.size(); ++k) shares.push_back(std::pow(0.8f, float(k)));
  const float sum = std::accumulate(shares.begin(), shares.end(), 0.f);
  for (float& share : shares) share *= float(frame.look.bloom) / sum;
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_CONSTANT_COLOR);
  widen_.use();
  for (std::size_t k = levels_.size() - 1; k-- > 0;) {
    const Level& level = levels_[k];
    glBindFramebuffer(GL_FRAMEBUFFER, level.target);
    glViewport(0, 0, level.width, level.height);
    glBlendColor(shares[k], shares[k], shares[k], shares[k]);
    widen_.set_texture("source", 1, GL_TEXTURE_2D, levels_[k + 1].map);
    widen_.set("size", Eigen::Vector2f(float(level.width), float(level.height)));
    widen_.set("share", k + 2 == levels_.size() ? shares[k + 1] : 1.f);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
}

}  // namespace hooke::render
