// Plain loops that the compiler turns into vector code, one clone an instruction set. Only
// IEEE operations on one lane and no contraction: every clone gives the same bits.
#include <hooke/softbody/kernels.hpp>

#include <algorithm>
#include <cmath>

// Sanitizers run before the dispatcher is resolved and crash in it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define HOOKE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define HOOKE_CLONES
#endif
// Outputs never overlap inputs; compilers forget __restrict once a function is inlined.
#if defined(__clang__)
#define HOOKE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define HOOKE_INDEPENDENT _Pragma("GCC ivdep")
#endif
#define HOOKE_INLINE static inline __attribute__((always_inline))

namespace hooke::softbody {

namespace {

// Below this length a spring has no direction.
template <class S>
constexpr S kTiny = S(1e-12);

template <class S, bool damped>
HOOKE_INLINE void spring_loop(const SpringBlock<S>& s) {
  const S *__restrict ax = s.a[0], *__restrict ay = s.a[1], *__restrict az = s.a[2];
  const S *__restrict bx = s.b[0], *__restrict by = s.b[1], *__restrict bz = s.b[2];
  const S *__restrict k = s.stiffness, *__restrict rest = s.rest, *__restrict rest2 = s.rest_squared;
  S *__restrict fx = s.f[0], *__restrict fy = s.f[1], *__restrict fz = s.f[2];
  HOOKE_INDEPENDENT
  for (int i = 0; i < s.n; ++i) {
    const S dx = bx[i] - ax[i], dy = by[i] - ay[i], dz = bz[i] - az[i];
    const S l2 = dx * dx + dy * dy + dz * dz;
    const S root = std::sqrt(l2);
    const S l = root > kTiny<S> ? root : kTiny<S>;
    S scale = k[i] * (l2 - rest2[i]) / (l * (l + rest[i]));
    if constexpr (damped) {
      const S approach = (s.vb[0][i] - s.va[0][i]) * dx + (s.vb[1][i] - s.va[1][i]) * dy + (s.vb[2][i] - s.va[2][i]) * dz;
      scale += s.damping[i] * approach / (l * l);
    }
    fx[i] = scale * dx;
    fy[i] = scale * dy;
    fz[i] = scale * dz;
  }
}

template <class S>
HOOKE_INLINE void springs(const SpringBlock<S>& s) {
  if (s.damping)
    spring_loop<S, true>(s);
  else
    spring_loop<S, false>(s);
}

template <class S>
HOOKE_INLINE void wind(const WindBlock<S>& s) {
  const S third = S(1) / S(3);
  S *__restrict fx = s.f[0], *__restrict fy = s.f[1], *__restrict fz = s.f[2];
  HOOKE_INDEPENDENT
  for (int i = 0; i < s.n; ++i) {
    const S ux = s.x[1][0][i] - s.x[0][0][i], uy = s.x[1][1][i] - s.x[0][1][i], uz = s.x[1][2][i] - s.x[0][2][i];
    const S wx = s.x[2][0][i] - s.x[0][0][i], wy = s.x[2][1][i] - s.x[0][1][i], wz = s.x[2][2][i] - s.x[0][2][i];
    // Twice the area times the normal, and the air's velocity relative to the triangle.
    const S nx = uy * wz - uz * wy, ny = uz * wx - ux * wz, nz = ux * wy - uy * wx;
    const S vx = s.wind[0] - third * (s.v[0][0][i] + s.v[1][0][i] + s.v[2][0][i]);
    const S vy = s.wind[1] - third * (s.v[0][1][i] + s.v[1][1][i] + s.v[2][1][i]);
    const S vz = s.wind[2] - third * (s.v[0][2][i] + s.v[1][2][i] + s.v[2][2][i]);
    const S flow = S(0.5) * (vx * nx + vy * ny + vz * nz);  // area times normal speed, signed
    const S size = std::sqrt(nx * nx + ny * ny + nz * nz), speed = std::sqrt(vx * vx + vy * vy + vz * vz);
    const S through = std::abs(flow);
    const S safe_size = size > kTiny<S> ? size : kTiny<S>, safe_speed = speed > kTiny<S> ? speed : kTiny<S>;
    // Drag: area seen by the air × |v| v. Lift: across v, ∝ |v|² cos α sin α.
    const S along_normal = s.lift * flow * speed / safe_size;
    const S along_flow = s.drag * through - s.lift * through * (S(2) * through / safe_size) / safe_speed;
    fx[i] = along_flow * vx + along_normal * nx;
    fy[i] = along_flow * vy + along_normal * ny;
    fz[i] = along_flow * vz + along_normal * nz;
  }
}

template <class S>
HOOKE_INLINE void add(S* __restrict target, const S* __restrict source, S sign, int n) {
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) target[i] += sign * source[i];
}

}  // namespace

HOOKE_CLONES void spring_forces(const SpringBlock<float>& block) { springs(block); }
HOOKE_CLONES void spring_forces(const SpringBlock<double>& block) { springs(block); }
HOOKE_CLONES void wind_forces(const WindBlock<float>& block) { wind(block); }
HOOKE_CLONES void wind_forces(const WindBlock<double>& block) { wind(block); }
HOOKE_CLONES void add_to(float* target, const float* source, float sign, int n) { add(target, source, sign, n); }
HOOKE_CLONES void add_to(double* target, const double* source, double sign, int n) { add(target, source, sign, n); }

}  // namespace hooke::softbody
