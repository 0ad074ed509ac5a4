#include "particle_shot.hpp"

#include <hooke/vdb/surface.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <unordered_map>

namespace hooke::command {

namespace {

constexpr int kGlowSteps = 64;  // of a life

// Water: whoever has this many others within some radii is part of a stream, the rest are drops.
constexpr int kTogether = 6;
constexpr double kNear = 2.6;           // [radii]
constexpr double kVoxelsARadius = 1.9;  // of the surface
constexpr int kSmoothing = 3;
constexpr float kDropShare = 0.5f;  // a drop's radius, as a share of a stream's

// An angle that stays with a particle, by its number of birth.
float turn_of(std::uint64_t serial) {
  const std::uint64_t mixed = (serial + 1) * 0x9e3779b97f4a7c15;
  return float(double(mixed >> 11) * 0x1p-53 * 2 * std::numbers::pi);
}

// How many others are within `reach` of each.
std::vector<int> neighbours(const Points<float>& x, double reach) {
  const auto cell = [&](Index i, int k) { return std::int64_t(std::floor(double(x(i, k)) / reach)); };
  const auto key = [](std::int64_t i, std::int64_t j, std::int64_t k) {
    return std::uint64_t((i & 0x1fffff) << 42 | (j & 0x1fffff) << 21 | (k & 0x1fffff));
  };
  std::unordered_map<std::uint64_t, std::vector<Index>> cells;
  for (Index i = 0; i < x.rows(); ++i) cells[key(cell(i, 0), cell(i, 1), cell(i, 2))].push_back(i);
  std::vector<int> counts(std::size_t(x.rows()), 0);
  for (Index i = 0; i < x.rows(); ++i)
    for (int n = 0; n < 27; ++n) {
      const auto found = cells.find(key(cell(i, 0) + n % 3 - 1, cell(i, 1) + n / 3 % 3 - 1, cell(i, 2) + n / 9 - 1));
      if (found == cells.end()) continue;
      for (const Index j : found->second)
        counts[std::size_t(i)] += j != i && (x.row(i) - x.row(j)).matrix().squaredNorm() < reach * reach;
    }
  return counts;
}

}  // namespace

ParticleShot::ParticleShot(const std::vector<scene::ParticleKind>& kinds, double shutter)
    : kinds_(kinds), glow_(kinds.size()), shutter_(shutter), groups_(kinds.size()) {
  for (std::size_t k = 0; k < kinds.size(); ++k)
    for (int i = 0; kinds[k].temperature && i <= kGlowSteps; ++i)
      glow_[k].push_back(render::black_body((*kinds[k].temperature)(double(i) / kGlowSteps)));
}

Vec3 ParticleShot::color(std::size_t kind, float life, const Vec3& ramp) const {
  if (kinds_[kind].look != scene::Look::Spark) return ramp;
  if (glow_[kind].empty()) return kinds_[kind].intensity * ramp;
  const double at = std::clamp(double(life), 0.0, 1.0) * kGlowSteps;
  const std::size_t i = std::min(std::size_t(at), std::size_t(kGlowSteps - 1));
  const double share = at - double(i);
  return kinds_[kind].intensity * ((1 - share) * glow_[kind][i] + share * glow_[kind][i + 1]);
}

void ParticleShot::place(const scene::ParticleView& view, double lift) {
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    std::vector<Index> rows;
    for (Index i = 0; i < view.positions.rows(); ++i)
      if (view.kinds[std::size_t(i)] == int(k)) rows.push_back(i);
    Group& group = groups_[k];
    group.positions = view.positions(rows, Eigen::all);
    group.positions.col(1) += float(lift);
    group.velocities = view.velocities(rows, Eigen::all);
    group.radii = view.radii(rows);
    // Who never dies has no age: as old as any streak is long.
    group.ages = view.ages(rows);
    group.ages = (group.ages > 0).select(group.ages, 1e6f);
    const Index n = Index(rows.size());
    group.colors.resize(n, 3), group.opacities.resize(n), group.turns.resize(n);
    for (Index i = 0; i < n; ++i) {
      const Index row = rows[std::size_t(i)];
      const Vec3 ramp = view.colors.row(row).matrix().transpose().cast<double>();
      group.colors.row(i) = color(k, view.lives[row], ramp).transpose().array().cast<float>();
      group.opacities[i] = float(kinds_[k].opacity(view.lives[row]));
      group.turns[i] = turn_of(view.serials[std::size_t(row)]);
    }
    if (kinds_[k].look == scene::Look::Water) make_surface(group);
  }
}

// What flows together becomes a surface; what is left of the group are drops.
void ParticleShot::make_surface(Group& group) {
  group.surface = {};
  if (group.positions.rows() == 0) return;
  const auto begin = std::chrono::steady_clock::now();
  const double radius = group.radii.cast<double>().mean();
  const std::vector<int> counts = neighbours(group.positions, kNear * radius);
  std::vector<Index> stream, drops;
  for (Index i = 0; i < group.positions.rows(); ++i)
    (counts[std::size_t(i)] >= kTogether ? stream : drops).push_back(i);
  group.surface = vdb::surface_from_particles(group.positions(stream, Eigen::all).cast<double>(),
                                              group.radii(stream).cast<double>(), radius / kVoxelsARadius, kSmoothing);
  const auto keep = [&](auto& array) { array = array(drops, Eigen::all).eval(); };
  keep(group.positions), keep(group.velocities), keep(group.colors);
  keep(group.radii), keep(group.ages), keep(group.opacities), keep(group.turns);
  for (Index i = 0; i < group.radii.rows(); ++i)  // of different sizes, each its own
    group.radii[i] *= kDropShare * (0.5f + 0.16f * group.turns[i]);
  meshing_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void ParticleShot::append(std::vector<render::Model>& out) const {
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    if (groups_[k].surface.triangles.empty()) continue;
    render::Model model;
    model.mesh = &groups_[k].surface;
    model.material = render::water();
    model.material.stream = true;
    model.material.color = kinds_[k].color(0);
    out.push_back(model);
  }
}

void ParticleShot::append(std::vector<render::Particles>& out) const {
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const Group& group = groups_[k];
    if (group.positions.rows() == 0) continue;
    render::Particles particles;
    particles.positions = &group.positions;
    particles.velocities = &group.velocities;
    particles.colors = &group.colors;
    particles.radii = &group.radii;
    particles.shutter = shutter_;
    if (kinds_[k].look == scene::Look::Spark) {
      particles.kind = render::Particles::Kind::Sparks;
      particles.ages = &group.ages;
    } else if (kinds_[k].look == scene::Look::Smoke) {
      particles.kind = render::Particles::Kind::Smoke;
      particles.opacities = &group.opacities;
      particles.turns = &group.turns;
    } else {
      particles.kind = render::Particles::Kind::Drops;
      particles.opacities = &group.opacities;
    }
    out.push_back(particles);
  }
}

}  // namespace hooke::command
