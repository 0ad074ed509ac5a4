// Plain loops that the compiler turns into vector code, one clone an instruction set. Only
// IEEE operations on one lane and no contraction: every clone gives the same bits.
#include <hooke/softbody/filtered_kernels.hpp>

#include <cmath>
#include <cstring>
#include <initializer_list>

// Sanitizers run before the dispatcher is resolved and crash in it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define HOOKE_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define HOOKE_CLONES
#endif
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

template <class S>
struct Parameters {
  const S *k, *rest, *rest2, *c;
};

template <class S>
HOOKE_INLINE Parameters<S> parameters(const SheetRow<S>& row, int direction) {
  const S* first = row.spring[direction];
  return {first, first + row.stride, first + 2 * row.stride, first + 3 * row.stride};
}

// Force along d over d: k (l² - L²) / (l (l + L)), which is zero at rest, and c u·d / l².
template <class S, bool damped>
HOOKE_INLINE S pull(const Parameters<S>& p, int i, S dx, S dy, S dz, S ux, S uy, S uz) {
  const S l2 = dx * dx + dy * dy + dz * dz;
  const S root = std::sqrt(l2);
  const S l = root > kTiny<S> ? root : kTiny<S>;
  const S sum = l + p.rest[i];
  if constexpr (damped) {
    const S closing = ux * dx + uy * dy + uz * dz;
    return (p.k[i] * (l2 - p.rest2[i]) * l + p.c[i] * closing * sum) / (l * l * sum);
  } else {
    return p.k[i] * (l2 - p.rest2[i]) / (l * sum);
  }
}

// Springs within the row. Their far ends lie one and two columns on, so they wait in scratch.
template <class S, bool damped>
HOOKE_INLINE void right_springs(SheetRow<S>& row) {
  const int n = row.columns;
  const std::ptrdiff_t m = n + 2;
  const S *x = row.x[0][0], *y = row.x[0][1], *z = row.x[0][2];
  const S *u = row.v[0][0], *v = row.v[0][1], *w = row.v[0][2];
  const Parameters<S> one = parameters(row, 0), two = parameters(row, 1);
  S *fx = row.f[0][0], *fy = row.f[0][1], *fz = row.f[0][2];
  S *sx = row.scratch, *sy = sx + m, *sz = sy + m;
  for (S* s : {sx, sy, sz}) s[0] = 0;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S dx = x[i + 1] - x[i], dy = y[i + 1] - y[i], dz = z[i + 1] - z[i];
    const S p = damped ? pull<S, damped>(one, i, dx, dy, dz, u[i + 1] - u[i], v[i + 1] - v[i], w[i + 1] - w[i])
                       : pull<S, damped>(one, i, dx, dy, dz, 0, 0, 0);
    sx[i + 1] = p * dx, sy[i + 1] = p * dy, sz[i + 1] = p * dz;
  }
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) fx[i] += sx[i + 1] - sx[i], fy[i] += sy[i + 1] - sy[i], fz[i] += sz[i + 1] - sz[i];
  for (S* s : {sx, sy, sz}) s[0] = s[1] = 0;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S dx = x[i + 2] - x[i], dy = y[i + 2] - y[i], dz = z[i + 2] - z[i];
    const S p = damped ? pull<S, damped>(two, i, dx, dy, dz, u[i + 2] - u[i], v[i + 2] - v[i], w[i + 2] - w[i])
                       : pull<S, damped>(two, i, dx, dy, dz, 0, 0, 0);
    sx[i + 2] = p * dx, sy[i + 2] = p * dy, sz[i + 2] = p * dz;
  }
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) fx[i] += sx[i + 2] - sx[i], fy[i] += sy[i + 2] - sy[i], fz[i] += sz[i + 2] - sz[i];
}

// Springs to the same column `rows` below.
template <class S, bool damped, bool set>
HOOKE_INLINE void down_springs(SheetRow<S>& row, int direction, int rows) {
  const S *ax = row.x[0][0], *ay = row.x[0][1], *az = row.x[0][2];
  const S *bx = row.x[rows][0], *by = row.x[rows][1], *bz = row.x[rows][2];
  const S *au = row.v[0][0], *av = row.v[0][1], *aw = row.v[0][2];
  const S *bu = row.v[rows][0], *bv = row.v[rows][1], *bw = row.v[rows][2];
  const Parameters<S> spring = parameters(row, direction);
  S *fx = row.f[0][0], *fy = row.f[0][1], *fz = row.f[0][2];
  S *gx = row.f[rows][0], *gy = row.f[rows][1], *gz = row.f[rows][2];
  const int n = row.columns;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S dx = bx[i] - ax[i], dy = by[i] - ay[i], dz = bz[i] - az[i];
    const S p = damped ? pull<S, damped>(spring, i, dx, dy, dz, bu[i] - au[i], bv[i] - av[i], bw[i] - aw[i])
                       : pull<S, damped>(spring, i, dx, dy, dz, 0, 0, 0);
    fx[i] += p * dx, fy[i] += p * dy, fz[i] += p * dz;
    if constexpr (set)
      gx[i] = -p * dx, gy[i] = -p * dy, gz[i] = -p * dz;
    else
      gx[i] -= p * dx, gy[i] -= p * dy, gz[i] -= p * dz;
  }
}

// Both diagonals of each cell. What they do to the column on the right waits in scratch.
template <class S, bool damped>
HOOKE_INLINE void diagonal_springs(SheetRow<S>& row) {
  const int n = row.columns;
  const std::ptrdiff_t m = n + 2;
  const S *ax = row.x[0][0], *ay = row.x[0][1], *az = row.x[0][2];
  const S *bx = row.x[1][0], *by = row.x[1][1], *bz = row.x[1][2];
  const S *au = row.v[0][0], *av = row.v[0][1], *aw = row.v[0][2];
  const S *bu = row.v[1][0], *bv = row.v[1][1], *bw = row.v[1][2];
  const Parameters<S> fall = parameters(row, 3), rise = parameters(row, 4);
  S *fx = row.f[0][0], *fy = row.f[0][1], *fz = row.f[0][2];
  S *gx = row.f[1][0], *gy = row.f[1][1], *gz = row.f[1][2];
  S *sx = row.scratch, *sy = sx + m, *sz = sy + m;
  for (S* s : {sx, sy, sz}) s[0] = 0;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S dx = bx[i + 1] - ax[i], dy = by[i + 1] - ay[i], dz = bz[i + 1] - az[i];
    const S p = damped ? pull<S, damped>(fall, i, dx, dy, dz, bu[i + 1] - au[i], bv[i + 1] - av[i], bw[i + 1] - aw[i])
                       : pull<S, damped>(fall, i, dx, dy, dz, 0, 0, 0);
    fx[i] += p * dx, fy[i] += p * dy, fz[i] += p * dz;
    sx[i + 1] = p * dx, sy[i + 1] = p * dy, sz[i + 1] = p * dz;
  }
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) gx[i] -= sx[i], gy[i] -= sy[i], gz[i] -= sz[i];
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S dx = bx[i] - ax[i + 1], dy = by[i] - ay[i + 1], dz = bz[i] - az[i + 1];
    const S p = damped ? pull<S, damped>(rise, i, dx, dy, dz, bu[i] - au[i + 1], bv[i] - av[i + 1], bw[i] - aw[i + 1])
                       : pull<S, damped>(rise, i, dx, dy, dz, 0, 0, 0);
    gx[i] -= p * dx, gy[i] -= p * dy, gz[i] -= p * dz;
    sx[i + 1] = p * dx, sy[i + 1] = p * dy, sz[i + 1] = p * dz;
  }
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) fx[i] += sx[i], fy[i] += sy[i], fz[i] += sz[i];
}

template <class S, bool damped>
HOOKE_INLINE void springs(SheetRow<S>& row) {
  right_springs<S, damped>(row);
  if (row.rows_below > 0) {
    down_springs<S, damped, false>(row, 2, 1);
    diagonal_springs<S, damped>(row);
  }
  if (row.rows_below > 1) down_springs<S, damped, true>(row, 5, 2);
}

template <class S>
HOOKE_INLINE void all_springs(SheetRow<S>& row) {
  if (row.v[0][0])
    springs<S, true>(row);
  else
    springs<S, false>(row);
}

template <class S>
HOOKE_INLINE void right_side(SheetRight<S>& row) {
  const int n = row.columns;
  const S* mass = row.mass;
  for (int k = 0; k < 3; ++k) {
    S* f = row.f[k];
    const S* extra = row.extra[k];
    const S scale = row.scale, gravity = row.gravity[k];
    if (extra) {
      HOOKE_INDEPENDENT
      for (int i = 0; i < n; ++i) f[i] = scale * f[i] + mass[i] * extra[i];
    } else {
      HOOKE_INDEPENDENT
      for (int i = 0; i < n; ++i) f[i] = scale * f[i] + mass[i] * gravity;
    }
  }
}

template <class S>
HOOKE_INLINE void sweep(SheetSweep<S>& row) {
  const int n = row.columns;
  const S pivot = row.pivot, w1 = row.w1, w2 = row.w2;
  for (int k = 0; k < 3; ++k) {
    S* y = row.y + k * row.plane;
    const S *y1 = row.y1 + k * row.plane, *y2 = row.y2 + k * row.plane;
    HOOKE_INDEPENDENT
    for (int i = 0; i < n; ++i) y[i] = pivot * y[i] - w1 * y1[i] - w2 * y2[i];
  }
}

template <class S>
HOOKE_INLINE void move(SheetMove<S>& row) {
  const int n = row.columns;
  S *x = row.x, *v = row.v, *predicted = row.predicted;
  const S* z = row.z;
  const S kick = row.kick, h = row.h;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) {
    const S speed = v[i] + kick * z[i];
    v[i] = speed;
    x[i] += h * speed;
  }
  if (!predicted) return;
  HOOKE_INDEPENDENT
  for (int i = 0; i < n; ++i) predicted[i] = v[i] + S(0.5) * z[i];
}

template <class S>
HOOKE_INLINE void sum_up(SheetSum<S>& row) {
  const int n = row.columns;
  const S weight = row.weight;
  for (int k = 0; k < 3; ++k) {
    S* sum = row.sum + k * row.sum_plane;
    const S* y = row.y + k * row.plane;
    HOOKE_INDEPENDENT
    for (int i = 0; i < n; ++i) sum[i] += weight * y[i];
  }
}

template <class S>
struct Pack;
template <>
struct Pack<float> {
  typedef float Type __attribute__((vector_size(32)));
};
template <>
struct Pack<double> {
  typedef double Type __attribute__((vector_size(32)));
};

template <class V, class S>
HOOKE_INLINE void load(V& v, const S* from) {
  std::memcpy(&v, from, sizeof v);
}
template <class V, class S>
HOOKE_INLINE void store(const V& v, S* to) {
  std::memcpy(to, &v, sizeof v);
}

HOOKE_INLINE void transpose(Pack<float>::Type (&r)[8]) {
  Pack<float>::Type t[8];
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < 8; i += 4)
    for (int j = 0; j < 2; ++j) {
      r[i + 2 * j] = __builtin_shufflevector(t[i + j], t[i + 2 + j], 0, 1, 8, 9, 4, 5, 12, 13);
      r[i + 2 * j + 1] = __builtin_shufflevector(t[i + j], t[i + 2 + j], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int i = 0; i < 4; ++i) {
    t[i] = __builtin_shufflevector(r[i], r[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    t[i + 4] = __builtin_shufflevector(r[i], r[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
  for (int i = 0; i < 8; ++i) r[i] = t[i];
}

HOOKE_INLINE void transpose(Pack<double>::Type (&r)[4]) {
  const auto a = __builtin_shufflevector(r[0], r[1], 0, 4, 2, 6), b = __builtin_shufflevector(r[0], r[1], 1, 5, 3, 7);
  const auto c = __builtin_shufflevector(r[2], r[3], 0, 4, 2, 6), d = __builtin_shufflevector(r[2], r[3], 1, 5, 3, 7);
  r[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5), r[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  r[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7), r[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

// A lane a row: tiles are turned on the way in and out, so that the recurrences run over vectors.
template <class S>
HOOKE_INLINE void row_solve(SheetRowSolve<S>& block) {
  using V = typename Pack<S>::Type;
  constexpr int n = kLanes<S>;
  const S *below = block.below, *below2 = block.below2, *above = block.above, *above2 = block.above2,
          *inverse_pivot = block.inverse_pivot;
  S* y = block.scratch;
  V near[3] = {}, far[3] = {};
  for (int first = 0; first < block.columns; first += n) {
    V tile[3][n];
    for (int k = 0; k < 3; ++k) {
      const S* z = block.z + k * block.plane + first;
      for (int i = 0; i < n; ++i) load(tile[k][i], z + i * block.stride);
      transpose(tile[k]);
    }
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 3; ++k) {
        const V now = tile[k][i] - below2[first + i] * far[k] - below[first + i] * near[k];
        far[k] = near[k], near[k] = now;
        store(now, y + n * (3 * (first + i) + k));
      }
  }
  for (int k = 0; k < 3; ++k) near[k] = far[k] = V{};
  for (int first = block.columns - n; first >= 0; first -= n) {
    V tile[3][n];
    for (int i = n - 1; i >= 0; --i)
      for (int k = 0; k < 3; ++k) {
        V now;
        load(now, y + n * (3 * (first + i) + k));
        now = now * inverse_pivot[first + i] - above2[first + i] * far[k] - above[first + i] * near[k];
        far[k] = near[k], near[k] = now;
        tile[k][i] = now;
      }
    for (int k = 0; k < 3; ++k) {
      S* z = block.z + k * block.plane + first;
      transpose(tile[k]);
      for (int i = 0; i < n; ++i) store(tile[k][i], z + i * block.stride);
    }
  }
}

}  // namespace

HOOKE_CLONES void sheet_springs(SheetRow<float>& row) { all_springs(row); }
HOOKE_CLONES void sheet_springs(SheetRow<double>& row) { all_springs(row); }
HOOKE_CLONES void sheet_right(SheetRight<float>& row) { right_side(row); }
HOOKE_CLONES void sheet_right(SheetRight<double>& row) { right_side(row); }
HOOKE_CLONES void sheet_sweep(SheetSweep<float>& row) { sweep(row); }
HOOKE_CLONES void sheet_sweep(SheetSweep<double>& row) { sweep(row); }
HOOKE_CLONES void sheet_row_solve(SheetRowSolve<float>& block) { row_solve(block); }
HOOKE_CLONES void sheet_row_solve(SheetRowSolve<double>& block) { row_solve(block); }
HOOKE_CLONES void sheet_move(SheetMove<float>& row) { move(row); }
HOOKE_CLONES void sheet_move(SheetMove<double>& row) { move(row); }
HOOKE_CLONES void sheet_sum(SheetSum<float>& row) { sum_up(row); }
HOOKE_CLONES void sheet_sum(SheetSum<double>& row) { sum_up(row); }

}  // namespace hooke::softbody
