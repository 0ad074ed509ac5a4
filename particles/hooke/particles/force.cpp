#include <hooke/particles/force.hpp>

#include <hooke/clones.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace hooke::particles {

namespace {

void check(bool good, const char* who, const char* rule, double value) {
  if (!good) throw std::invalid_argument(std::string(who) + " must be " + rule + ", got " + std::to_string(value));
}

void check(const Vec3& value, const char* who) {
  if (!value.allFinite()) throw std::invalid_argument(std::string(who) + " must be finite");
}

// ---- The loops. x, v: n numbers a coordinate; a: what is added to.

template <class S>
HOOKE_INLINE void drag_loop(Index n, const S* const v[3], const S* w, S coefficient, S same_w, bool quadratic,
                            const S wind[3], S* const a[3]) {
  const S *vx = v[0], *vy = v[1], *vz = v[2];
  S *ax = a[0], *ay = a[1], *az = a[2];
  const S wx = wind[0], wy = wind[1], wz = wind[2];
  HOOKE_INDEPENDENT
  for (Index i = 0; i < n; ++i) {
    const S rx = vx[i] - wx, ry = vy[i] - wy, rz = vz[i] - wz;
    S rate = coefficient * (w ? w[i] : same_w);
    if (quadratic) rate *= std::sqrt(rx * rx + ry * ry + rz * rz);
    ax[i] -= rate * rx;
    ay[i] -= rate * ry;
    az[i] -= rate * rz;
  }
}
HOOKE_CLONES void drag(Index n, const float* const v[3], const float* w, float c, float same_w, bool quadratic,
                       const float wind[3], float* const a[3]) {
  drag_loop(n, v, w, c, same_w, quadratic, wind, a);
}
HOOKE_CLONES void drag(Index n, const double* const v[3], const double* w, double c, double same_w, bool quadratic,
                       const double wind[3], double* const a[3]) {
  drag_loop(n, v, w, c, same_w, quadratic, wind, a);
}

template <class S>
HOOKE_INLINE void attract_loop(Index n, const S* const x[3], const S place[3], S strength, S radius, S* const a[3]) {
  const S *px = x[0], *py = x[1], *pz = x[2];
  S *ax = a[0], *ay = a[1], *az = a[2];
  const S cx = place[0], cy = place[1], cz = place[2];
  HOOKE_INDEPENDENT
  for (Index i = 0; i < n; ++i) {
    const S dx = cx - px[i], dy = cy - py[i], dz = cz - pz[i];
    const S square = dx * dx + dy * dy + dz * dz + radius * radius;
    const S pull = strength / (square * std::sqrt(square));
    ax[i] += pull * dx;
    ay[i] += pull * dy;
    az[i] += pull * dz;
  }
}
HOOKE_CLONES void attract(Index n, const float* const x[3], const float place[3], float s, float r, float* const a[3]) {
  attract_loop(n, x, place, s, r, a);
}
HOOKE_CLONES void attract(Index n, const double* const x[3], const double place[3], double s, double r,
                          double* const a[3]) {
  attract_loop(n, x, place, s, r, a);
}

// The lattice repeats after so many cells: what drifts can be wrapped, and float keeps its digits.
constexpr std::uint32_t kLattice = 1024;

// A pseudo-random vector of a lattice point, components in [-1, 1].
template <class S>
HOOKE_INLINE void lattice_vector(std::uint32_t i, std::uint32_t j, std::uint32_t k, std::uint32_t seed, S& gx, S& gy,
                                 S& gz) {
  i &= kLattice - 1, j &= kLattice - 1, k &= kLattice - 1;
  std::uint32_t h = i * 0x8da6b343u + j * 0xd8163841u + k * 0xcb1ab31fu + seed;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  h ^= h >> 16;
  constexpr S unit = S(2.0 / 1023);
  gx = S(std::int32_t(h & 1023)) * unit - 1;
  gy = S(std::int32_t((h >> 10) & 1023)) * unit - 1;
  gz = S(std::int32_t((h >> 20) & 1023)) * unit - 1;
}

// A place in its cell of the lattice: weights along each axis (Perlin 2002's), their slopes, and what is left of it.
template <class S>
struct InCell {
  std::uint32_t i, j, k;
  S u, v, w;     // from the lower corner, in [0, 1)
  S su, sv, sw;  // weight of the upper corner
  S du, dv, dw;  // its slope
};

// What one corner of the cell adds to the curl of three noises.
template <std::uint32_t kCorner, class S>
HOOKE_INLINE void add_corner(const InCell<S>& at, std::uint32_t seed, S& ux, S& uy, S& uz) {
  constexpr std::uint32_t a = kCorner & 1, b = (kCorner >> 1) & 1, e = kCorner >> 2;
  const S u = at.u - S(int(a)), v = at.v - S(int(b)), w = at.w - S(int(e));
  const S wx = a ? at.su : 1 - at.su, wy = b ? at.sv : 1 - at.sv, wz = e ? at.sw : 1 - at.sw;
  const S all = wx * wy * wz;
  const S dx = (a ? at.du : -at.du) * wy * wz, dy = (b ? at.dv : -at.dv) * wx * wz, dz = (e ? at.dw : -at.dw) * wx * wy;
  S px, py, pz, qx, qy, qz, rx, ry, rz;
  lattice_vector(at.i + a, at.j + b, at.k + e, seed, px, py, pz);
  lattice_vector(at.i + a, at.j + b, at.k + e, seed + 0x9e3779b9u, qx, qy, qz);
  lattice_vector(at.i + a, at.j + b, at.k + e, seed + 0x3c6ef372u, rx, ry, rz);
  const S p = px * u + py * v + pz * w, q = qx * u + qy * v + qz * w, r = rx * u + ry * v + rz * w;
  ux += dy * r + all * ry - dz * q - all * qz;
  uy += dz * p + all * pz - dx * r - all * rx;
  uz += dx * q + all * qx - dy * p - all * py;
}

template <class S>
HOOKE_INLINE void curl_loop(Index n, const S* const x[3], const S shift[3], S scale, S speed, std::uint32_t seed,
                            S* const u[3]) {
  const S *px = x[0], *py = x[1], *pz = x[2];
  S *ux = u[0], *uy = u[1], *uz = u[2];
  const S sx = shift[0], sy = shift[1], sz = shift[2];
  HOOKE_INDEPENDENT
  for (Index i = 0; i < n; ++i) {
    const S a = px[i] * scale + sx, b = py[i] * scale + sy, c = pz[i] * scale + sz;
    // Rounding down without a call.
    std::int32_t cx = std::int32_t(a), cy = std::int32_t(b), cz = std::int32_t(c);
    cx -= a < S(cx) ? 1 : 0, cy -= b < S(cy) ? 1 : 0, cz -= c < S(cz) ? 1 : 0;
    InCell<S> at;
    at.i = std::uint32_t(cx), at.j = std::uint32_t(cy), at.k = std::uint32_t(cz);
    at.u = a - S(cx), at.v = b - S(cy), at.w = c - S(cz);
    at.su = at.u * at.u * at.u * (at.u * (at.u * 6 - 15) + 10), at.du = 30 * at.u * at.u * (at.u - 1) * (at.u - 1);
    at.sv = at.v * at.v * at.v * (at.v * (at.v * 6 - 15) + 10), at.dv = 30 * at.v * at.v * (at.v - 1) * (at.v - 1);
    at.sw = at.w * at.w * at.w * (at.w * (at.w * 6 - 15) + 10), at.dw = 30 * at.w * at.w * (at.w - 1) * (at.w - 1);
    S vx = 0, vy = 0, vz = 0;
    add_corner<0>(at, seed, vx, vy, vz), add_corner<1>(at, seed, vx, vy, vz);
    add_corner<2>(at, seed, vx, vy, vz), add_corner<3>(at, seed, vx, vy, vz);
    add_corner<4>(at, seed, vx, vy, vz), add_corner<5>(at, seed, vx, vy, vz);
    add_corner<6>(at, seed, vx, vy, vz), add_corner<7>(at, seed, vx, vy, vz);
    ux[i] += speed * vx;
    uy[i] += speed * vy;
    uz[i] += speed * vz;
  }
}
HOOKE_CLONES void curl(Index n, const float* const x[3], const float shift[3], float scale, float speed,
                       std::uint32_t seed, float* const u[3]) {
  curl_loop(n, x, shift, scale, speed, seed, u);
}
HOOKE_CLONES void curl(Index n, const double* const x[3], const double shift[3], double scale, double speed,
                       std::uint32_t seed, double* const u[3]) {
  curl_loop(n, x, shift, scale, speed, seed, u);
}

template <class S>
HOOKE_INLINE void swirl_loop(Index n, const S* const x[3], const S place[3], const S axis[3], S circulation, S core,
                             S updraught, S* const u[3]) {
  const S *px = x[0], *py = x[1], *pz = x[2];
  S *ux = u[0], *uy = u[1], *uz = u[2];
  const S cx = place[0], cy = place[1], cz = place[2], kx = axis[0], ky = axis[1], kz = axis[2];
  HOOKE_INDEPENDENT
  for (Index i = 0; i < n; ++i) {
    S dx = px[i] - cx, dy = py[i] - cy, dz = pz[i] - cz;
    const S along = dx * kx + dy * ky + dz * kz;
    dx -= along * kx, dy -= along * ky, dz -= along * kz;
    const S inverse = 1 / (dx * dx + dy * dy + dz * dz + core * core);
    const S turn = circulation * inverse, rise = updraught * core * core * inverse;
    ux[i] += turn * (ky * dz - kz * dy) + rise * kx;
    uy[i] += turn * (kz * dx - kx * dz) + rise * ky;
    uz[i] += turn * (kx * dy - ky * dx) + rise * kz;
  }
}
HOOKE_CLONES void swirl(Index n, const float* const x[3], const float p[3], const float k[3], float c, float r, float w,
                        float* const u[3]) {
  swirl_loop(n, x, p, k, c, r, w, u);
}
HOOKE_CLONES void swirl(Index n, const double* const x[3], const double p[3], const double k[3], double c, double r,
                        double w, double* const u[3]) {
  swirl_loop(n, x, p, k, c, r, w, u);
}

template <class S>
std::array<S, 3> three(const Vec3& v) {
  return {S(v.x()), S(v.y()), S(v.z())};
}

// RMS of one component of the curl above is about this, by sampling.
constexpr double kCurlRms = 0.712;

}  // namespace

template <class S>
typename Force<S>::Uniform Force<S>::uniform(double, double) const {
  return {};
}
template <class S>
void Force<S>::prepare(const Tile<S>&, double) {}
template <class S>
void Force<S>::add_acceleration(const Tile<S>&, Index, const Vec3&, double, S* const*) const {}

template <class S>
LinearDrag<S>::LinearDrag(double coefficient, const Vec3& wind) : coefficient_(coefficient), wind_(wind) {
  check(coefficient >= 0 && std::isfinite(coefficient), "LinearDrag: coefficient", "0 or more", coefficient);
  check(wind, "LinearDrag: wind");
}

template <class S>
typename Force<S>::Uniform LinearDrag<S>::uniform(double, double inverse_mass) const {
  if (std::isnan(inverse_mass)) return {};
  const double rate = coefficient_ * inverse_mass;
  return {rate * wind_, rate};
}

template <class S>
void LinearDrag<S>::add_acceleration(const Tile<S>& tile, Index, const Vec3&, double, S* const a[3]) const {
  const auto wind = three<S>(wind_);
  drag(tile.count, tile.v, tile.inverse_mass, S(coefficient_), S(0), false, wind.data(), a);
}

template <class S>
QuadraticDrag<S>::QuadraticDrag(double coefficient, const Vec3& wind) : coefficient_(coefficient), wind_(wind) {
  check(coefficient >= 0 && std::isfinite(coefficient), "QuadraticDrag: coefficient", "0 or more", coefficient);
  check(wind, "QuadraticDrag: wind");
}

template <class S>
void QuadraticDrag<S>::add_acceleration(const Tile<S>& tile, Index, const Vec3&, double, S* const a[3]) const {
  const auto wind = three<S>(wind_);
  drag(tile.count, tile.v, tile.inverse_mass, S(coefficient_), tile.same_inverse_mass, true, wind.data(), a);
}

template <class S>
Attractor<S>::Attractor(const Vec3& place, double strength, double radius)
    : place_(place), strength_(strength), radius_(radius) {
  check(place, "Attractor: place");
  check(std::isfinite(strength), "Attractor: strength", "finite", strength);
  check(radius > 0 && std::isfinite(radius), "Attractor: radius", "positive", radius);
}

template <class S>
void Attractor<S>::add_acceleration(const Tile<S>& tile, Index, const Vec3& origin, double, S* const a[3]) const {
  const auto place = three<S>(place_ - origin);
  attract(tile.count, tile.x, place.data(), S(strength_), S(radius_), a);
}

template <class S>
FlowDrag<S>::FlowDrag(std::unique_ptr<const Flow<S>> flow, double rate) : flow_(std::move(flow)), rate_(rate) {
  if (!flow_) throw std::invalid_argument("FlowDrag: needs a flow");
  check(rate >= 0 && std::isfinite(rate), "FlowDrag: rate", "0 or more", rate);
}

template <class S>
typename Force<S>::Uniform FlowDrag<S>::uniform(double, double) const {
  return {Vec3::Zero(), rate_};
}

template <class S>
void FlowDrag<S>::add_acceleration(const Tile<S>& tile, Index, const Vec3& origin, double t, S* const a[3]) const {
  // Velocities of at most so many particles at a time, on the stack.
  constexpr Index kRun = 256;
  S u[3][kRun];
  for (Index first = 0; first < tile.count; first += kRun) {
    const Index n = std::min(kRun, tile.count - first);
    Tile<S> part = tile;
    part.count = n;
    for (int k = 0; k < 3; ++k) part.x[k] += first, part.v[k] += first, std::fill_n(u[k], n, S(0));
    if (part.serial) part.serial += first;
    if (part.inverse_mass) part.inverse_mass += first;
    S* const out[3] = {u[0], u[1], u[2]};
    flow_->add_velocity(part, origin, t, out);
    for (int k = 0; k < 3; ++k)
      for (Index i = 0; i < n; ++i) a[k][first + i] += S(rate_) * u[k][i];
  }
}

template <class S>
CurlNoise<S>::CurlNoise(const Settings& s) : settings_(s) {
  check(s.speed >= 0 && std::isfinite(s.speed), "CurlNoise: speed", "0 or more", s.speed);
  check(s.size > 0 && std::isfinite(s.size), "CurlNoise: size", "positive", s.size);
  check(s.turnover > 0 && std::isfinite(s.turnover), "CurlNoise: turnover", "positive", s.turnover);
}

template <class S>
void CurlNoise<S>::add_velocity(const Tile<S>& tile, const Vec3& origin, double t, S* const u[3]) const {
  // Octaves move on in different directions, so that the pattern changes and does not only travel.
  static constexpr double kWays[2][3] = {{0.31, 0.87, 0.38}, {-0.72, 0.41, -0.56}};
  double size = settings_.size, speed = settings_.speed / (kCurlRms * std::sqrt(1 + 0.25) * std::sqrt(3.0));
  for (int octave = 0; octave < 2; ++octave) {
    std::array<S, 3> shift;
    for (int k = 0; k < 3; ++k) {
      // Whole stretches of the lattice are left out, so that float keeps its digits after hours and far away.
      const double place = (origin[k] / size) - kWays[octave][k] * t / settings_.turnover * (1 + octave);
      shift[std::size_t(k)] = S(place - kLattice * std::floor(place / kLattice));
    }
    curl(tile.count, tile.x, shift.data(), S(1 / size), S(speed), settings_.seed + std::uint32_t(octave) * 77773u, u);
    size /= 2;
    speed /= 2;
  }
}

template <class S>
Vortex<S>::Vortex(const Vec3& place, const Vec3& axis, double circulation, double core, double updraught)
    : place_(place), axis_(axis), circulation_(circulation), core_(core), updraught_(updraught) {
  check(place, "Vortex: place");
  check(axis.norm() > 1e-12 && axis.allFinite(), "Vortex: axis", "a direction, not of length 0; length", axis.norm());
  check(std::isfinite(circulation), "Vortex: circulation", "finite", circulation);
  check(core > 0 && std::isfinite(core), "Vortex: core", "positive", core);
  check(std::isfinite(updraught), "Vortex: updraught", "finite", updraught);
  axis_.normalize();
}

template <class S>
void Vortex<S>::add_velocity(const Tile<S>& tile, const Vec3& origin, double, S* const u[3]) const {
  const auto place = three<S>(place_ - origin), axis = three<S>(axis_);
  swirl(tile.count, tile.x, place.data(), axis.data(), S(circulation_ / (2 * std::numbers::pi)), S(core_),
        S(updraught_), u);
}

template <class S>
GridFlow<S>::GridFlow(std::shared_ptr<const VelocityGrid> grid, const Vec3& offset, double scale)
    : grid_(std::move(grid)), offset_(offset), scale_(scale) {
  if (!grid_) throw std::invalid_argument("GridFlow: needs a grid");
  check(offset, "GridFlow: offset");
  check(std::isfinite(scale), "GridFlow: scale", "finite", scale);
}

template <class S>
void GridFlow<S>::add_velocity(const Tile<S>& tile, const Vec3& origin, double, S* const u[3]) const {
  for (Index i = 0; i < tile.count; ++i) {
    const Vec3 x(double(tile.x[0][i]), double(tile.x[1][i]), double(tile.x[2][i]));
    const Vec3 velocity = scale_ * grid_->velocity(origin + x - offset_);
    for (int k = 0; k < 3; ++k) u[k][i] += S(velocity[k]);
  }
}

template <class S>
Repulsion<S>::Repulsion(double stiffness, double distance) : stiffness_(stiffness), distance_(distance) {
  check(stiffness >= 0 && std::isfinite(stiffness), "Repulsion: stiffness", "0 or more", stiffness);
  check(distance > 0 && std::isfinite(distance), "Repulsion: distance", "positive", distance);
}

// The cell that is `step` cells from a place.
template <class S>
std::uint32_t Repulsion<S>::cell_of(const S place[3], const int step[3]) const {
  const auto at = [&](int k) {
    return std::uint32_t(std::int64_t(std::floor(double(place[k]) / distance_)) + step[k]);
  };
  return (at(0) * 0x8da6b343u ^ at(1) * 0xd8163841u ^ at(2) * 0xcb1ab31fu) & mask_;
}

template <class S>
void Repulsion<S>::prepare(const Tile<S>& all, double) {
  const Index n = all.count;
  std::uint32_t cells = 64;
  while (cells < std::uint32_t(2 * n)) cells *= 2;
  mask_ = cells - 1;
  if (places_.rows() < n) places_.resize(n + n / 2, 3), acceleration_.resize(n + n / 2, 3);
  cell_.resize(std::size_t(n));
  sorted_.resize(std::size_t(n));
  start_.assign(std::size_t(cells) + 1, 0);
  for (Index i = 0; i < n; ++i) {
    const S place[3] = {all.x[0][i], all.x[1][i], all.x[2][i]};
    const int here[3] = {0, 0, 0};
    cell_[std::size_t(i)] = cell_of(place, here);
    ++start_[cell_[std::size_t(i)] + 1];
  }
  for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
  // A counting sort keeps the order within a cell: sums have the same bits always.
  for (Index i = n; i-- > 0;) sorted_[--start_[cell_[std::size_t(i)] + 1]] = i;
  for (std::size_t c = 0; c + 1 < start_.size(); ++c) start_[c] = start_[c + 1];
  start_.back() = std::uint32_t(n);
  for (int k = 0; k < 3; ++k) std::copy_n(all.x[k], n, places_.col(k).data());

  const S reach2 = S(distance_ * distance_);
  for (Index i = 0; i < n; ++i) {
    const S x = places_(i, 0), y = places_(i, 1), z = places_(i, 2);
    S sum[3] = {0, 0, 0};
    std::uint32_t seen[27];
    int cells_seen = 0;
    for (int c = 0; c < 27; ++c) {
      const S place[3] = {x, y, z};
      const int step[3] = {c % 3 - 1, c / 3 % 3 - 1, c / 9 - 1};
      const std::uint32_t cell = cell_of(place, step);
      // Two neighbours may share a bucket of the hash.
      if (std::find(seen, seen + cells_seen, cell) != seen + cells_seen) continue;
      seen[cells_seen++] = cell;
      for (std::uint32_t s = start_[cell]; s < start_[cell + 1]; ++s) {
        const Index j = sorted_[s];
        if (j == i) continue;
        const S dx = x - places_(j, 0), dy = y - places_(j, 1), dz = z - places_(j, 2);
        const S square = dx * dx + dy * dy + dz * dz;
        if (square >= reach2 || square == 0) continue;
        const S length = std::sqrt(square), push = S(stiffness_) * (S(distance_) - length) / length;
        sum[0] += push * dx, sum[1] += push * dy, sum[2] += push * dz;
      }
    }
    for (int k = 0; k < 3; ++k) acceleration_(i, k) = sum[k];
  }
}

template <class S>
void Repulsion<S>::add_acceleration(const Tile<S>& tile, Index first, const Vec3&, double, S* const a[3]) const {
  if (first < 0) return;
  for (int k = 0; k < 3; ++k)
    for (Index i = 0; i < tile.count; ++i) a[k][i] += acceleration_(first + i, k);
}

#define HOOKE_FORCES(S)            \
  template class Force<S>;         \
  template class LinearDrag<S>;    \
  template class QuadraticDrag<S>; \
  template class Attractor<S>;     \
  template class FlowDrag<S>;      \
  template class CurlNoise<S>;     \
  template class Vortex<S>;        \
  template class GridFlow<S>;      \
  template class Repulsion<S>;
HOOKE_FORCES(float)
HOOKE_FORCES(double)
#undef HOOKE_FORCES

}  // namespace hooke::particles
