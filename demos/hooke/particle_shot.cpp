#include "particle_shot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hooke::command {

namespace {

constexpr int kGlowSteps = 64;  // of a life

// An angle that stays with a particle, by its number of birth.
float turn_of(std::uint64_t serial) {
  const std::uint64_t mixed = (serial + 1) * 0x9e3779b97f4a7c15;
  return float(double(mixed >> 11) * 0x1p-53 * 2 * std::numbers::pi);
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
