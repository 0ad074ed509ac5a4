// Loops that the compiler turns into vector code, and vectors of 32 bytes, one clone an instruction set. Only
// IEEE operations on one lane, contracted where there is multiply-add: all instruction sets that have it give
// the same bits, and so do those that have not.
#include <hooke/clones.hpp>
#include <hooke/softbody/filtered_kernels.hpp>

#include <cmath>
#include <cstring>
#include <initializer_list>
#include <type_traits>

#if defined(__clang__)
#define HOOKE_UNROLL _Pragma("clang loop unroll(full)")
#else
#define HOOKE_UNROLL _Pragma("GCC unroll 8")
#endif
// One multiply-add after the other, wherever it is written.
#define HOOKE_SQUARE(x, y, z) ((z) * (z) + ((y) * (y) + ((x) * (x) + kTiny<S>)))

namespace hooke::softbody {

namespace {

template <class S>
HOOKE_INLINE void square(int n, const S* d, S* out) {
  for (int i = 0; i < n; ++i) {
    const S x = d[i], y = d[n + i], z = d[2 * n + i];
    out[i] = HOOKE_SQUARE(x, y, z);
  }
}

template <class S>
HOOKE_INLINE void move(const SheetMove<S>& row) {
  const int n = row.columns;
  const S kick = row.kick, h = row.h;
  for (int k = 0; k < 3; ++k) {
    S *x = row.x[k], *v = row.v[k], *predicted = row.predicted[k];
    const S* z = row.z[k];
    if (h != 0) {
      HOOKE_INDEPENDENT
      for (int i = 0; i < n; ++i) {
        const S speed = v[i] + kick * z[i];
        v[i] = speed;
        x[i] += h * speed;
      }
    } else {
      HOOKE_INDEPENDENT
      for (int i = 0; i < n; ++i) v[i] += kick * z[i];
    }
    if (!predicted) continue;
    HOOKE_INDEPENDENT
    for (int i = 0; i < n; ++i) predicted[i] = v[i] + S(0.5) * z[i];
  }
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
  HOOKE_UNROLL
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  HOOKE_UNROLL
  for (int i = 0; i < 8; i += 4) HOOKE_UNROLL
  for (int j = 0; j < 2; ++j) {
    r[i + 2 * j] = __builtin_shufflevector(t[i + j], t[i + 2 + j], 0, 1, 8, 9, 4, 5, 12, 13);
    r[i + 2 * j + 1] = __builtin_shufflevector(t[i + j], t[i + 2 + j], 2, 3, 10, 11, 6, 7, 14, 15);
  }
  HOOKE_UNROLL
  for (int i = 0; i < 4; ++i) {
    t[i] = __builtin_shufflevector(r[i], r[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    t[i + 4] = __builtin_shufflevector(r[i], r[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
  HOOKE_UNROLL
  for (int i = 0; i < 8; ++i) r[i] = t[i];
}

HOOKE_INLINE void transpose(Pack<double>::Type (&r)[4]) {
  const auto a = __builtin_shufflevector(r[0], r[1], 0, 4, 2, 6), b = __builtin_shufflevector(r[0], r[1], 1, 5, 3, 7);
  const auto c = __builtin_shufflevector(r[2], r[3], 0, 4, 2, 6), d = __builtin_shufflevector(r[2], r[3], 1, 5, 3, 7);
  r[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5), r[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  r[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7), r[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

template <class V>
HOOKE_INLINE void take_roots(V& v) {
  constexpr int n = int(sizeof v / sizeof v[0]);
  alignas(V) std::remove_reference_t<decltype(v[0])> lanes[n];
  std::memcpy(lanes, &v, sizeof v);
  for (int i = 0; i < n; ++i) lanes[i] = std::sqrt(lanes[i]);
  std::memcpy(&v, lanes, sizeof v);
}

// Lane i becomes element i - 1, or i - 2, of the sequence before, now.
HOOKE_INLINE void shift(Pack<float>::Type& out, const Pack<float>::Type& before, const Pack<float>::Type& now, int by) {
  if (by == 1)
    out = __builtin_shufflevector(before, now, 7, 8, 9, 10, 11, 12, 13, 14);
  else
    out = __builtin_shufflevector(before, now, 6, 7, 8, 9, 10, 11, 12, 13);
}
HOOKE_INLINE void shift(Pack<double>::Type& out, const Pack<double>::Type& before, const Pack<double>::Type& now,
                        int by) {
  if (by == 1)
    out = __builtin_shufflevector(before, now, 3, 4, 5, 6);
  else
    out = __builtin_shufflevector(before, now, 2, 3, 4, 5);
}

template <class V>
struct Triple {
  V x, y, z;
};

// Three coordinates that lie `apart` values from each other.
template <class V, class S>
HOOKE_INLINE void load(Triple<V>& t, const S* from, std::ptrdiff_t apart) {
  load(t.x, from), load(t.y, from + apart), load(t.z, from + 2 * apart);
}

template <class V>
HOOKE_INLINE void add_shifted(V& sum, const V& now, V& before, int by) {
  V from;
  shift(from, before, now, by);
  sum += now - from;
  before = now;
}

// A spring is worked on with the row it starts in; its force over its length waits for the rows it
// ends in. Force over length: k (l² - L²) / (l² + l L), which is zero at rest, and c u·d / l².
// Square roots and quotients take long: other work goes between them.
template <class S, bool damped, bool extra>
HOOKE_INLINE void forward(const SheetForward<S>& given) {
  const SheetForward<S> row = given;  // a copy that no store can change
  using V = typename Pack<S>::Type;
  constexpr int n = kLanes<S>;
  const std::ptrdiff_t pad = row.pad, plane = row.plane;
  const S *x0 = row.x[0], *x1 = row.x[1], *x2 = row.x[2], *o1 = row.above, *o2 = row.above2;
  const S *v0 = row.v[0], *v1 = row.v[1], *v2 = row.v[2];
  S* p0 = row.pull;
  const S *p1 = row.pull1, *p2 = row.pull2;
  const S *stiffness = row.stiffness, *rest = row.rest, *damping = row.damping;
  const V nothing = {};
  Triple<V> right = {nothing, nothing, nothing}, right2 = right;
  for (int first = 0; first < row.columns; first += n) {
    Triple<V> a, d[6], force = {nothing, nothing, nothing};
    [[maybe_unused]] Triple<V> u;
    V over[6], under[6];
    load(a, x0, pad);
    if constexpr (damped) load(u, v0, pad);
#define HOOKE_ROOT(i, to, to_v)                                                                \
  {                                                                                            \
    load(d[i], to, pad);                                                                       \
    d[i].x -= a.x, d[i].y -= a.y, d[i].z -= a.z;                                               \
    const V l2 = HOOKE_SQUARE(d[i].x, d[i].y, d[i].z);                                         \
    V k, length, length2, l = l2;                                                              \
    take_roots(l);                                                                             \
    load(k, stiffness + i * n), load(length, rest + i * n), load(length2, rest + (6 + i) * n); \
    over[i] = k * (l2 - length2);                                                              \
    under[i] = l2 + l * length;                                                                \
    if constexpr (damped) {                                                                    \
      Triple<V> w;                                                                             \
      V c;                                                                                     \
      load(w, to_v, pad), load(c, damping + i * n);                                            \
      const V closing = (w.x - u.x) * d[i].x + (w.y - u.y) * d[i].y + (w.z - u.z) * d[i].z;    \
      over[i] = over[i] * l + c * closing * (l + length), under[i] *= l;                       \
    }                                                                                          \
  }
#define HOOKE_PULL(from, scale)                                                            \
  {                                                                                        \
    Triple<V> to;                                                                          \
    V s;                                                                                   \
    load(to, from, pad), load(s, scale);                                                   \
    force.x += s * (to.x - a.x), force.y += s * (to.y - a.y), force.z += s * (to.z - a.z); \
  }
#define HOOKE_OWN(i, keep) \
  store(over[i], keep);    \
  force.x += over[i] * d[i].x, force.y += over[i] * d[i].y, force.z += over[i] * d[i].z;
    HOOKE_ROOT(kRight, x0 + 1, v0 + 1)
    HOOKE_ROOT(kRight2, x0 + 2, v0 + 2)
    HOOKE_ROOT(kDown, x1, v1)
    HOOKE_PULL(o1, p1)
    for (const int i : {kRight, kRight2, kDown}) over[i] /= under[i];
    HOOKE_PULL(o1 - 1, p1 + pad - 1)
    add_shifted(force.x, over[kRight] * d[kRight].x, right.x, 1);
    add_shifted(force.y, over[kRight] * d[kRight].y, right.y, 1);
    add_shifted(force.z, over[kRight] * d[kRight].z, right.z, 1);
    add_shifted(force.x, over[kRight2] * d[kRight2].x, right2.x, 2);
    add_shifted(force.y, over[kRight2] * d[kRight2].y, right2.y, 2);
    add_shifted(force.z, over[kRight2] * d[kRight2].z, right2.z, 2);
    HOOKE_OWN(kDown, p0)
    HOOKE_ROOT(kDiagonal, x1 + 1, v1 + 1)
    HOOKE_ROOT(kAntidiagonal, x1 - 1, v1 - 1)
    HOOKE_ROOT(kDown2, x2, v2)
    HOOKE_PULL(o1 + 1, p1 + 2 * pad + 1)
    for (const int i : {kDiagonal, kAntidiagonal, kDown2}) over[i] /= under[i];
    HOOKE_PULL(o2, p2 + 3 * pad)
    HOOKE_OWN(kDiagonal, p0 + pad)
    HOOKE_OWN(kAntidiagonal, p0 + 2 * pad)
    HOOKE_OWN(kDown2, p0 + 3 * pad)
#undef HOOKE_ROOT
#undef HOOKE_PULL
#undef HOOKE_OWN
    V scale, mass;
    load(scale, row.scale + first), load(mass, row.mass + first);
    for (int k = 0; k < 3; ++k) {
      V y = scale * (k == 0 ? force.x : k == 1 ? force.y : force.z), y1, y2;
      if constexpr (extra) {
        V more;
        load(more, row.extra + k * pad + first);
        y += mass * more;
      } else {
        y += mass * row.gravity[k];
      }
      if (row.right) store(y, row.right + k * pad + first);
      load(y1, row.z1 + k * plane + first), load(y2, row.z2 + k * plane + first);
      y = y - row.w1 * y1 - row.w2 * y2;
      store(y, row.z + k * plane + first);
    }
    x0 += n, x1 += n, x2 += n, o1 += n, o2 += n, p0 += n, p1 += n, p2 += n;
    stiffness += 6 * n, rest += 12 * n;
    if constexpr (damped) v0 += n, v1 += n, v2 += n, damping += 6 * n;
  }
}

template <class S>
HOOKE_INLINE void any_forward(const SheetForward<S>& row) {
  if (row.damping)
    row.extra ? forward<S, true, true>(row) : forward<S, true, false>(row);
  else
    row.extra ? forward<S, false, true>(row) : forward<S, false, false>(row);
}

// Columns first, on the way in. Then a lane a row: tiles are turned on the way in and out, so that the
// recurrences along rows run over vectors, too.
template <class S>
HOOKE_INLINE void back(const SheetBack<S>& given) {
  const SheetBack<S> block = given;  // a copy that no store can change
  using V = typename Pack<S>::Type;
  constexpr int n = kLanes<S>;
  const S *below = block.below, *below2 = block.below2, *above = block.above, *above2 = block.above2,
          *inverse_pivot = block.inverse_pivot;
  const std::ptrdiff_t stride = block.stride;
  S* y = block.scratch;
  V near[3] = {}, far[3] = {};
  for (int first = 0; first < block.columns; first += n) {
    V tile[3][n], under[3], under2[3];
    for (int k = 0; k < 3; ++k) {
      const S* wait = block.wait + k * stride + first;
      load(under[k], wait), load(under2[k], wait + 3 * stride);
    }
    HOOKE_UNROLL
    for (int i = n - 1; i >= 0; --i) HOOKE_UNROLL
    for (int k = 0; k < 3; ++k) {
      load(tile[k][i], block.z + k * block.plane + i * stride + first);
      tile[k][i] = tile[k][i] * block.pivot[i] - under2[k] * block.next2[i] - under[k] * block.next[i];
      under2[k] = under[k], under[k] = tile[k][i];
    }
    HOOKE_UNROLL
    for (int k = 0; k < 3; ++k) {
      S* wait = block.wait + k * stride + first;
      store(under[k], wait), store(under2[k], wait + 3 * stride);
      if (block.add) HOOKE_UNROLL
      for (int i = 0; i < n; ++i) {
        V more;
        load(more, block.add + (k * n + i) * stride + first);
        tile[k][i] += more;
      }
      transpose(tile[k]);
    }
    HOOKE_UNROLL
    for (int i = 0; i < n; ++i) HOOKE_UNROLL
    for (int k = 0; k < 3; ++k) {
      tile[k][i] = tile[k][i] - far[k] * below2[first + i] - near[k] * below[first + i];
      far[k] = near[k], near[k] = tile[k][i];
      store(tile[k][i], y + n * (3 * first + k * n + i));
    }
  }
  for (int k = 0; k < 3; ++k) near[k] = far[k] = V{};
  for (int first = block.columns - n; first >= 0; first -= n) {
    V tile[3][n];
    HOOKE_UNROLL
    for (int i = n - 1; i >= 0; --i) HOOKE_UNROLL
    for (int k = 0; k < 3; ++k) {
      load(tile[k][i], y + n * (3 * first + k * n + i));
      tile[k][i] = tile[k][i] * inverse_pivot[first + i] - far[k] * above2[first + i] - near[k] * above[first + i];
      far[k] = near[k], near[k] = tile[k][i];
    }
    HOOKE_UNROLL
    for (int k = 0; k < 3; ++k) {
      transpose(tile[k]);
      HOOKE_UNROLL
      for (int i = 0; i < n; ++i) store(tile[k][i], block.z + k * block.plane + i * stride + first);
    }
  }
}

}  // namespace

HOOKE_CLONES void sheet_forward(const SheetForward<float>& row) { any_forward(row); }
HOOKE_CLONES void sheet_forward(const SheetForward<double>& row) { any_forward(row); }
HOOKE_CLONES void sheet_back(const SheetBack<float>& block) { back(block); }
HOOKE_CLONES void sheet_back(const SheetBack<double>& block) { back(block); }
HOOKE_CLONES void sheet_squares(int n, const float* difference, float* out) { square(n, difference, out); }
HOOKE_CLONES void sheet_squares(int n, const double* difference, double* out) { square(n, difference, out); }
HOOKE_CLONES void sheet_move(const SheetMove<float>& row) { move(row); }
HOOKE_CLONES void sheet_move(const SheetMove<double>& row) { move(row); }
HOOKE_CLONES void sheet_sum(SheetSum<float>& row) { sum_up(row); }
HOOKE_CLONES void sheet_sum(SheetSum<double>& row) { sum_up(row); }

}  // namespace hooke::softbody
