// Plain loops that the compiler turns into vector code, one clone an instruction set. Only
// IEEE operations on one lane and no contraction: every clone gives the same bits.
#include <hooke/clones.hpp>
#include <hooke/softbody/kernels.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace hooke::softbody {

namespace {

// Below this length a spring has no direction.
template <class S>
constexpr S kTiny = S(1e-12);

template <class S>
HOOKE_INLINE void add(S* target, const S* source, S sign, int n) {
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) target[i] += sign * source[i];
}

// Where what the rounding of places has dropped is known, lengths are double: in float the rounding of l² - L² alone
// would shake what rests.
template <class S, bool damped, bool fine>
HOOKE_INLINE void spring_loop(SpringBlock<S>& s) {
  using T = std::conditional_t<fine, double, S>;
  const S *ax = s.a[0], *ay = s.a[1], *az = s.a[2], *bx = s.b[0], *by = s.b[1], *bz = s.b[2];
  const S *k = s.stiffness, *rest = s.rest;
  const T* rest2;
  if constexpr (fine)
    rest2 = s.fine_rest_squared;
  else
    rest2 = s.rest_squared;
  const S *c = s.damping, *vax = s.va[0], *vay = s.va[1], *vaz = s.va[2], *vbx = s.vb[0], *vby = s.vb[1],
          *vbz = s.vb[2];
  const S *lax = s.low_a[0], *lay = s.low_a[1], *laz = s.low_a[2], *lbx = s.low_b[0], *lby = s.low_b[1],
          *lbz = s.low_b[2];
  S *fx = s.f[0], *fy = s.f[1], *fz = s.f[2];
  const int n = s.n;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    T dx = T(bx[i]) - T(ax[i]), dy = T(by[i]) - T(ay[i]), dz = T(bz[i]) - T(az[i]);
    if constexpr (fine) dx += T(lbx[i]) - T(lax[i]), dy += T(lby[i]) - T(lay[i]), dz += T(lbz[i]) - T(laz[i]);
    const T l2 = dx * dx + dy * dy + dz * dz;
    const T root = std::sqrt(l2);
    const T l = root > kTiny<T> ? root : kTiny<T>;
    const T sum = l + T(rest[i]);
    T scale;
    if constexpr (damped) {
      // k (l² - L²) / (l (l + L)) + c v·d / l², over one denominator: one division instead of two.
      const T closing = (T(vbx[i]) - T(vax[i])) * dx + (T(vby[i]) - T(vay[i])) * dy + (T(vbz[i]) - T(vaz[i])) * dz;
      scale = (T(k[i]) * (l2 - rest2[i]) * l + T(c[i]) * closing * sum) / (l * l * sum);
    } else {
      scale = T(k[i]) * (l2 - rest2[i]) / (l * sum);
    }
    fx[i] = S(scale * dx);
    fy[i] = S(scale * dy);
    fz[i] = S(scale * dz);
  }
}

template <class S>
HOOKE_INLINE void springs(SpringBlock<S>& s) {
  if (s.low_a[0])
    s.damping ? spring_loop<S, true, true>(s) : spring_loop<S, false, true>(s);
  else
    s.damping ? spring_loop<S, true, false>(s) : spring_loop<S, false, false>(s);
  if (!s.sum_a[0]) return;
  // Points a and b overlap, so their sums must not share a loop.
  for (int k = 0; k < 3; ++k) add(s.sum_a[k], s.f[k], S(1), s.n);
  for (int k = 0; k < 3; ++k) add(s.sum_b[k], s.f[k], S(-1), s.n);
}

// Eight sums, whatever the vectors' length: the same bits everywhere.
template <class S>
HOOKE_INLINE double energy(const SpringBlock<S>& s) {
  constexpr int kSums = 8;
  double stored[kBlock], sums[kSums] = {};
  const S *ax = s.a[0], *ay = s.a[1], *az = s.a[2], *bx = s.b[0], *by = s.b[1], *bz = s.b[2];
  const S *k = s.stiffness, *rest = s.rest;
  const int n = s.n;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const double dx = double(bx[i]) - double(ax[i]), dy = double(by[i]) - double(ay[i]),
                 dz = double(bz[i]) - double(az[i]);
    const double stretch = std::sqrt(dx * dx + dy * dy + dz * dz) - double(rest[i]);
    stored[i] = 0.5 * double(k[i]) * stretch * stretch;
  }
  for (int i = n; i < (n + kSums - 1) / kSums * kSums; ++i) stored[i] = 0;
  for (int i = 0; i < n; i += kSums)
    for (int j = 0; j < kSums; ++j) sums[j] += stored[i + j];
  return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

template <class S>
HOOKE_INLINE void bounds(BoundBlock<S>& s) {
  const S *ax = s.a[0], *ay = s.a[1], *az = s.a[2], *bx = s.b[0], *by = s.b[1], *bz = s.b[2];
  const S *wa = s.wa, *wb = s.wb, *k = s.stiffness, *rest = s.rest, *damping = s.damping;
  S *kxx = s.k[0], *kxy = s.k[1], *kxz = s.k[2], *kyy = s.k[3], *kyz = s.k[4], *kzz = s.k[5];
  S *cxx = s.c[0], *cxy = s.c[1], *cxz = s.c[2], *cyy = s.c[3], *cyz = s.c[4], *czz = s.c[5];
  const int n = s.n;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S dx = bx[i] - ax[i], dy = by[i] - ay[i], dz = bz[i] - az[i];
    const S root = std::sqrt(dx * dx + dy * dy + dz * dz);
    const S l = root > kTiny<S> ? root : kTiny<S>;
    // The share of the stiffness that acts across the spring; without direction, all of it.
    const S stretched = S(1) - rest[i] / l;
    const S side = root > kTiny<S> ? (stretched > S(0) ? stretched : S(0)) : S(1);
    const S nx = dx / l, ny = dy / l, nz = dz / l;
    const S weight = wa[i] + wb[i], all = weight * k[i] * side, along = weight * k[i] - all;
    kxx[i] = along * nx * nx + all, kxy[i] = along * nx * ny, kxz[i] = along * nx * nz;
    kyy[i] = along * ny * ny + all, kyz[i] = along * ny * nz, kzz[i] = along * nz * nz + all;
    const S c = damping ? weight * damping[i] : S(0);
    cxx[i] = c * nx * nx, cxy[i] = c * nx * ny, cxz[i] = c * nx * nz;
    cyy[i] = c * ny * ny, cyz[i] = c * ny * nz, czz[i] = c * nz * nz;
  }
}

// Newton's method on the characteristic polynomial, from a bound above all roots: it comes down on the
// largest and never passes it.
template <class S>
HOOKE_INLINE void eigenvalues(int n, const S* const m[6], S* out) {
  const S *xx = m[0], *xy = m[1], *xz = m[2], *yy = m[3], *yz = m[4], *zz = m[5];
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    // Scaled to trace 3, so that nothing overflows.
    const S trace = xx[i] + yy[i] + zz[i], scale = trace > S(0) ? S(3) / trace : S(0);
    const S a = xx[i] * scale - S(1), b = yy[i] * scale - S(1), c = zz[i] * scale - S(1);
    const S d = xy[i] * scale, e = xz[i] * scale, f = yz[i] * scale;
    // Of the deviator: λ³ - 3 p λ - q, largest root at most 2 √p.
    const S p = (a * a + b * b + c * c + S(2) * (d * d + e * e + f * f)) / S(6);
    const S q = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
    S root = S(2) * std::sqrt(p) * S(1.00001) + S(1e-6);
    for (int turn = 0; turn < 8; ++turn) {
      const S value = (root * root - S(3) * p) * root - q, slope = S(3) * (root * root - p);
      root -= slope > S(1e-6) ? (value > S(0) ? value : S(0)) / slope : S(0);
    }
    out[i] = trace > S(0) ? (S(1) + root) / scale * S(1.00001) : S(0);
  }
}

template <class S>
HOOKE_INLINE void wind(WindBlock<S>& s) {
  const S third = S(1) / S(3);
  S *fx = s.f[0], *fy = s.f[1], *fz = s.f[2];
  const S *x0 = s.x[0][0], *y0 = s.x[0][1], *z0 = s.x[0][2], *x1 = s.x[1][0], *y1 = s.x[1][1], *z1 = s.x[1][2],
          *x2 = s.x[2][0], *y2 = s.x[2][1], *z2 = s.x[2][2];
  const S *vx0 = s.v[0][0], *vy0 = s.v[0][1], *vz0 = s.v[0][2], *vx1 = s.v[1][0], *vy1 = s.v[1][1], *vz1 = s.v[1][2],
          *vx2 = s.v[2][0], *vy2 = s.v[2][1], *vz2 = s.v[2][2];
  const S wind_x = s.wind[0], wind_y = s.wind[1], wind_z = s.wind[2], drag = s.drag, lift = s.lift;
  const int n = s.n;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S ux = x1[i] - x0[i], uy = y1[i] - y0[i], uz = z1[i] - z0[i];
    const S wx = x2[i] - x0[i], wy = y2[i] - y0[i], wz = z2[i] - z0[i];
    // Twice the area times the normal, and the air's velocity relative to the triangle.
    const S nx = uy * wz - uz * wy, ny = uz * wx - ux * wz, nz = ux * wy - uy * wx;
    const S vx = wind_x - third * (vx0[i] + vx1[i] + vx2[i]);
    const S vy = wind_y - third * (vy0[i] + vy1[i] + vy2[i]);
    const S vz = wind_z - third * (vz0[i] + vz1[i] + vz2[i]);
    const S flow = S(0.5) * (vx * nx + vy * ny + vz * nz);  // area times normal speed, signed
    // Twice the area times the speed; both factors of the lift need no more than its inverse.
    const S v2 = vx * vx + vy * vy + vz * vz;
    const S root = std::sqrt((nx * nx + ny * ny + nz * nz) * v2);
    const S inverse = S(1) / (root > kTiny<S> * kTiny<S> ? root : kTiny<S> * kTiny<S>);
    // Drag: area seen by the air × |v| v. Lift: across v, ∝ |v|² cos α sin α.
    const S along_normal = lift * flow * v2 * inverse;
    const S along_flow = drag * std::abs(flow) - S(2) * lift * flow * flow * inverse;
    fx[i] = along_flow * vx + along_normal * nx;
    fy[i] = along_flow * vy + along_normal * ny;
    fz[i] = along_flow * vz + along_normal * nz;
  }
  if (!s.sum[0][0]) return;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) add(s.sum[c][k], s.f[k], S(1), n);
}

}  // namespace

HOOKE_CLONES void spring_forces(SpringBlock<float>& block) { springs(block); }
HOOKE_CLONES void spring_forces(SpringBlock<double>& block) { springs(block); }
HOOKE_CLONES double spring_energy(const SpringBlock<float>& block) { return energy(block); }
HOOKE_CLONES double spring_energy(const SpringBlock<double>& block) { return energy(block); }
HOOKE_CLONES void spring_bounds(BoundBlock<float>& block) { bounds(block); }
HOOKE_CLONES void spring_bounds(BoundBlock<double>& block) { bounds(block); }
HOOKE_CLONES void eigenvalue_bounds(int n, const float* const m[6], float* out) { eigenvalues(n, m, out); }
HOOKE_CLONES void eigenvalue_bounds(int n, const double* const m[6], double* out) { eigenvalues(n, m, out); }
HOOKE_CLONES void wind_forces(WindBlock<float>& block) { wind(block); }
HOOKE_CLONES void wind_forces(WindBlock<double>& block) { wind(block); }

}  // namespace hooke::softbody
