#include "pool.hpp"

#include <algorithm>
#include <cmath>

namespace hooke::command {

namespace {

constexpr double kCell = 0.0125;       // [m]
constexpr double kWaveSpeed = 0.40;    // [m/s], of ripples some centimetres long
constexpr double kCalmTime = 0.55;     // [s] in which waves fade
constexpr double kFoamTime = 0.4;      // [s] in which foam fades
constexpr double kFoamDrift = 1.5e-3;  // [m²/s]
constexpr double kReach = 0.02;        // [m] around a drop that it pushes
constexpr double kPush = 9.0;          // [m/s] of the surface for each [N s]
constexpr double kFoam = 55;           // for each [N s]
constexpr double kMostFoam = 2.5, kSteepest = 0.25;
constexpr double kDensity = 1000;  // [kg/m³]

}  // namespace

Pool::Pool(const LevelSet& body) : body_(body) {
  const Vec3 low = body.offset + body.grid->lower(), high = body.offset + body.grid->upper();
  low_x_ = low.x(), low_z_ = low.z();
  across_ = std::max(2, int((high.x() - low.x()) / kCell) + 1),
  along_ = std::max(2, int((high.z() - low.z()) / kCell) + 1);
  // The highest place of the solid over its middle.
  const Vec3 middle = 0.5 * (low + high);
  const double step = 0.02 * body.grid->voxel();
  level_ = high.y();
  while (level_ > low.y() && body.grid->distance(Vec3(middle.x(), level_, middle.z()) - body.offset) > 0)
    level_ -= step;

  const std::size_t cells = std::size_t(across_) * std::size_t(along_);
  wet_.resize(cells), height_.assign(cells, 0), speed_ = lather_ = height_;
  mesh_.vertices.resize(Index(cells), 3);
  foam_.setZero(Index(cells));
  for (int j = 0; j < along_; ++j)
    for (int i = 0; i < across_; ++i) {
      const Vec3 x(low_x_ + kCell * i, level_, low_z_ + kCell * j);
      const auto k = std::size_t(j * across_ + i);
      wet_[k] = body.grid->distance(x - Vec3(0, 2 * step, 0) - body.offset) < 0;
      mesh_.vertices.row(Index(k)) = x.transpose().array();
    }
  for (int j = 0; j + 1 < along_; ++j)
    for (int i = 0; i + 1 < across_; ++i) {
      const int a = j * across_ + i, b = a + 1, c = a + across_, d = c + 1;
      if (!wet_[std::size_t(a)] || !wet_[std::size_t(b)] || !wet_[std::size_t(c)] || !wet_[std::size_t(d)]) continue;
      mesh_.triangles.push_back({a, c, b});
      mesh_.triangles.push_back({b, c, d});
    }
}

void Pool::calm() {
  for (auto* field : {&height_, &speed_, &lather_}) std::fill(field->begin(), field->end(), 0.0);
}

void Pool::fall_in(const Vec3& place, double momentum) {
  const double x = (place.x() - low_x_) / kCell, z = (place.z() - low_z_) / kCell, reach = kReach / kCell;
  if (!(x >= 0 && z >= 0 && x < across_ && z < along_)) return;
  for (int j = std::max(0, int(z - 3 * reach)); j <= std::min(along_ - 1, int(z + 3 * reach)); ++j)
    for (int i = std::max(0, int(x - 3 * reach)); i <= std::min(across_ - 1, int(x + 3 * reach)); ++i) {
      const double r2 = ((i - x) * (i - x) + (j - z) * (j - z)) / (reach * reach);
      // Pushed down in the middle and up around it: no water is lost.
      at(speed_, i, j) -= kPush * momentum * (1 - r2) * std::exp(-r2);
      at(lather_, i, j) += kFoam * momentum * std::exp(-r2);
    }
}

void Pool::ripple(double seconds) {
  const int steps = std::max(1, int(std::ceil(seconds * kWaveSpeed / (0.6 * kCell))));
  const double dt = seconds / steps, wave = kWaveSpeed * kWaveSpeed / (kCell * kCell),
               drift = kFoamDrift / (kCell * kCell);
  std::vector<double> spread;
  for (int step = 0; step < steps; ++step) {
    const auto bend = [&](std::vector<double>& field, int i, int j) {
      const double here = at(field, i, j);
      double sum = 0;  // nothing passes the shore
      if (i > 0 && wet_[std::size_t(j * across_ + i - 1)]) sum += at(field, i - 1, j) - here;
      if (j > 0 && wet_[std::size_t((j - 1) * across_ + i)]) sum += at(field, i, j - 1) - here;
      if (i + 1 < across_ && wet_[std::size_t(j * across_ + i + 1)]) sum += at(field, i + 1, j) - here;
      if (j + 1 < along_ && wet_[std::size_t((j + 1) * across_ + i)]) sum += at(field, i, j + 1) - here;
      return sum;
    };
    spread = lather_;
    for (int j = 0; j < along_; ++j)
      for (int i = 0; i < across_; ++i) {
        if (!wet_[std::size_t(j * across_ + i)]) continue;
        at(speed_, i, j) += dt * wave * bend(height_, i, j);
        at(spread, i, j) += dt * drift * bend(lather_, i, j);
      }
    lather_.swap(spread);
    const double calm = std::exp(-dt / kCalmTime), fade = std::exp(-dt / kFoamTime);
    for (std::size_t k = 0; k < height_.size(); ++k) {
      speed_[k] *= calm, lather_[k] = std::min(kMostFoam, lather_[k] * fade);
      height_[k] = std::clamp(height_[k] + dt * speed_[k], -kSteepest * 4 * kCell, kSteepest * 4 * kCell);
    }
  }
}

void Pool::advance(std::span<const scene::ParticleView> drops, std::span<const std::vector<scene::ParticleKind>> kinds,
                   double seconds) {
  for (std::size_t s = 0; s < drops.size(); ++s) {
    const scene::ParticleView& view = drops[s];
    for (Index i = 0; i < view.positions.rows(); ++i) {
      const scene::Look look = kinds[s][std::size_t(view.kinds[std::size_t(i)])].look;
      if (look != scene::Look::Drop && look != scene::Look::Water) continue;
      const Vec3 x = view.positions.row(i).matrix().transpose().cast<double>();
      const Vec3 v = view.velocities.row(i).matrix().transpose().cast<double>();
      const double gap = x.y() - level_;
      if (!(v.y() < 0 && gap > -kCell && gap <= -v.y() * seconds)) continue;
      // A ball of a stream is as large as the gaps between them.
      const double radius = view.radii[i] * (look == scene::Look::Water ? 0.6 : 1.0),
                   mass = kDensity * 4.19 * radius * radius * radius;
      fall_in(x - v * (gap / v.y()), mass * -v.y());
    }
  }
  ripple(seconds);
  for (std::size_t k = 0; k < height_.size(); ++k) {
    mesh_.vertices(Index(k), 1) = level_ + height_[k];
    foam_[Index(k)] = float(std::min(1.0, lather_[k]));
  }
}

}  // namespace hooke::command
