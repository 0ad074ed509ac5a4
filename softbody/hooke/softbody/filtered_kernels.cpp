// Loops that the compiler turns into vector code, one clone an instruction set, and loops over vectors of 32 bytes,
// or of 64 where there are such. Only IEEE operations on one lane, contracted where there is multiply-add: all
// instruction sets that have it give the same bits, and so do those that have not.
#include <hooke/clones.hpp>
#include <hooke/softbody/filtered_kernels.hpp>
#include <hooke/softbody/near_rest.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#if defined(__clang__)
#define HOOKE_UNROLL _Pragma("clang loop unroll(full)")
#else
#define HOOKE_UNROLL _Pragma("GCC unroll 16")
#endif

namespace hooke::softbody {

namespace {

// One multiply-add after the other, wherever it is inlined.
template <class S, class V>
HOOKE_INLINE void square(V& out, const V& x, const V& y, const V& z) {
  out = z * z + (y * y + (x * x + S(kTiny)));
}

template <class S>
HOOKE_INLINE void squares(int n, const S* d, S* out) {
  for (int i = 0; i < n; ++i) square<S>(out[i], d[i], d[n + i], d[2 * n + i]);
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

template <class S, int bytes>
struct Pack;
template <int bytes>
struct Pack<float, bytes> {
  typedef float Type __attribute__((vector_size(bytes)));
  typedef std::int32_t Bits __attribute__((vector_size(bytes)));
};
template <int bytes>
struct Pack<double, bytes> {
  typedef double Type __attribute__((vector_size(bytes)));
  typedef std::int64_t Bits __attribute__((vector_size(bytes)));
};
template <class V>
using Scalar = std::remove_cvref_t<decltype(std::declval<V&>()[0])>;
template <class V>
constexpr int kSize = int(sizeof(V) / sizeof(Scalar<V>));

template <class V, class S>
HOOKE_INLINE void load(V& v, const S* from) {
  std::memcpy(&v, from, sizeof v);
}
template <class V, class S>
HOOKE_INLINE void store(const V& v, S* to) {
  std::memcpy(to, &v, sizeof v);
}

// Lane i becomes element Element::at(i) of a and b one after the other.
template <class Element, class V, int... i>
HOOKE_INLINE void pick(V& out, const V& a, const V& b, std::integer_sequence<int, i...>) {
  out = __builtin_shufflevector(a, b, Element::at(i)...);
}
template <class Element, class V>
HOOKE_INLINE void pick(V& out, const V& a, const V& b) {
  pick<Element>(out, a, b, std::make_integer_sequence<int, kSize<V>>{});
}

// Of V, 16 bytes are a part.
template <class V>
constexpr int kPart = 16 / int(sizeof(Scalar<V>));

// Elements, `group` in a row, from the lower or upper halves of the parts of a and b in turn.
template <class V, int group, int upper>
struct Zip {
  static constexpr int at(int i) {
    const int in = i % kPart<V>, start = i - in + upper * kPart<V> / 2 + in / (2 * group) * group + in % group;
    return start + in / group % 2 * kSize<V>;
  }
};

// Even or odd parts of a, then of b.
template <class V, int odd>
struct EveryOther {
  static constexpr int at(int i) {
    const int from = i / kPart<V> * 2 + odd;  // part, of both
    return from * kPart<V> + i % kPart<V>;
  }
};

// Rows become columns. Pairs of elements and pairs of pairs within parts, then parts: once for two, twice for four.
template <class V>
HOOKE_INLINE void transpose(V (&r)[kSize<V>]) {
  constexpr int n = kSize<V>, part = kPart<V>;
  V t[n];
  HOOKE_UNROLL
  for (int i = 0; i < n; i += 2) pick<Zip<V, 1, 0>>(t[i], r[i], r[i + 1]), pick<Zip<V, 1, 1>>(t[i + 1], r[i], r[i + 1]);
  if constexpr (part == 4) {
    HOOKE_UNROLL
    for (int i = 0; i < n; i += 4) HOOKE_UNROLL
    for (int j = 0; j < 2; ++j) {
      pick<Zip<V, 2, 0>>(r[i + 2 * j], t[i + j], t[i + j + 2]);
      pick<Zip<V, 2, 1>>(r[i + 2 * j + 1], t[i + j], t[i + j + 2]);
    }
  } else {
    HOOKE_UNROLL
    for (int i = 0; i < n; ++i) r[i] = t[i];
  }
  HOOKE_UNROLL
  for (int g = 0; g < n; g += 2 * part) HOOKE_UNROLL
  for (int i = g; i < g + part; ++i) {
    pick<EveryOther<V, 0>>(t[i], r[i], r[i + part]);
    pick<EveryOther<V, 1>>(t[i + part], r[i], r[i + part]);
  }
  if constexpr (n / part == 2) {
    HOOKE_UNROLL
    for (int i = 0; i < n; ++i) r[i] = t[i];
  } else {
    static_assert(n / part == 4);
    HOOKE_UNROLL
    for (int i = 0; i < 2 * part; ++i) {
      pick<EveryOther<V, 0>>(r[i], t[i], t[i + 2 * part]);
      pick<EveryOther<V, 1>>(r[i + 2 * part], t[i], t[i + 2 * part]);
    }
  }
}

template <class V>
HOOKE_INLINE void take_roots(V& v) {
  alignas(V) Scalar<V> lanes[kSize<V>];
  std::memcpy(lanes, &v, sizeof v);
  for (int i = 0; i < kSize<V>; ++i) lanes[i] = std::sqrt(lanes[i]);
  std::memcpy(&v, lanes, sizeof v);
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
template <class V, class S>
HOOKE_INLINE void store(const Triple<V>& t, S* to, std::ptrdiff_t apart) {
  store(t.x, to), store(t.y, to + apart), store(t.z, to + 2 * apart);
}
template <class V>
HOOKE_INLINE void subtract(Triple<V>& out, const Triple<V>& a, const Triple<V>& b) {
  out.x = a.x - b.x, out.y = a.y - b.y, out.z = a.z - b.z;
}
template <class V>
HOOKE_INLINE void scaled(Triple<V>& out, const V& s, const Triple<V>& d) {
  out.x = s * d.x, out.y = s * d.y, out.z = s * d.z;
}
template <class V>
HOOKE_INLINE void add(Triple<V>& out, const V& s, const Triple<V>& d) {
  out.x += s * d.x, out.y += s * d.y, out.z += s * d.z;
}
template <class V>
HOOKE_INLINE void take(Triple<V>& out, const V& s, const Triple<V>& d) {
  out.x -= s * d.x, out.y -= s * d.y, out.z -= s * d.z;
}

template <class V>
HOOKE_INLINE void add(Triple<V>& out, const Triple<V>& more) {
  out.x += more.x, out.y += more.y, out.z += more.z;
}

template <class V, int by>
struct Before {
  static constexpr int at(int i) { return kSize<V> - by + i; }
};

// `before` becomes what is `by` elements before `now` in the sequence of both.
template <int by, class V>
HOOKE_INLINE void shift(Triple<V>& before, const Triple<V>& now) {
  using Place = Before<V, by>;
  pick<Place>(before.x, before.x, now.x), pick<Place>(before.y, before.y, now.y);
  pick<Place>(before.z, before.z, now.z);
}

// k (1 - 1/sqrt(1 + e)), see NearRest.
template <class S, class V>
HOOKE_INLINE void near_rest(V& s, const V& k, const V& e, const V& e2) {
  constexpr auto& c = NearRest<S>::c;
  if constexpr (sizeof(S) == 4) {
    const V c01 = e * c[1] + c[0], c23 = e * c[3] + c[2], c45 = e * c[5] + c[4];
    const V upper = c45 * e2 + c23, g = upper * e2 + c01;
    s = k * e * g;
  } else {
    const V upper = e * c[3] + c[2], middle = upper * e + c[1], y = middle * e + c[0];
    const V half = e * S(0.5) + S(0.5), r = S(0.5) - half * (y * y);
    const V more = r * S(1.5) + S(1), better = (y * r) * more + y;
    s = k - k * better;
  }
}

// Force over length: k (l² - L²) / (l² + l L), zero at rest, as a series or exactly.
template <bool exact, class S, class V>
HOOKE_INLINE void force_over_length(V& s, const V& more, const V& e, const V& e2, const V& l2, const V& rest,
                                    const S* stiffness) {
  V k;
  load(k, stiffness);
  if constexpr (exact) {
    V root = l2 * rest;
    take_roots(root);
    s = k * more / (l2 + root);
  } else {
    near_rest<S>(s, k, e, e2);
  }
}

// Each spring is worked on once, with the row it starts in: its force on the other end waits in a register for the
// columns to the right, in rows of memory for the rows below. All six at once, stage by stage: processors do not look
// far enough ahead to do that by themselves. False where springs were too far from rest for the series.
template <int bytes, bool damped, bool extra, bool exact, class S>
HOOKE_INLINE bool forward(const SheetForward<S>& given) {
  const SheetForward<S> row = given;  // a copy that no store can change
  using V = typename Pack<S, bytes>::Type;
  using Bits = typename Pack<S, bytes>::Bits;
  constexpr int n = kSize<V>, lanes = kLanes<S>;
  const std::ptrdiff_t pad = row.pad, plane = row.plane, apart0 = row.apart[0], apart1 = row.apart[1],
                       apart2 = row.apart[2];
  const V nothing = {};
  Triple<V> one = {nothing, nothing, nothing}, two = one, below = one;  // on their way one or two columns to the right
  Bits worst = {};
  for (int c = 0; c < row.columns; c += n) {
    const SheetSprings<S>& springs = row.springs[c / lanes];
    const int lane = c % lanes;
    const S *stiffness = springs.stiffness + lane, *rest = springs.rest + lane, *inverse = springs.inverse + lane;
    const S *x0 = row.x[0] + c, *x1 = row.x[1] + c, *x2 = row.x[2] + c;
    Triple<V> d[6];
    {
      Triple<V> a, right, down, other;
      load(a, x0, apart0), load(right, x0 + 1, apart0), load(down, x1, apart1);
      subtract(d[kRight], right, a), subtract(d[kDown], down, a), subtract(d[kAntidiagonal], down, right);
      load(other, x0 + 2, apart0), subtract(d[kRight2], other, a);
      load(other, x1 + 1, apart1), subtract(d[kDiagonal], other, a);
      load(other, x2, apart2), subtract(d[kDown2], other, a);
    }
    V l2[6], rest2[6], more[6], e[6], s[6];
    HOOKE_UNROLL
    for (int i = 0; i < 6; ++i) {
      V inverse2;
      square<S>(l2[i], d[i].x, d[i].y, d[i].z);
      load(rest2[i], rest + i * lanes), load(inverse2, inverse + i * lanes);
      more[i] = l2[i] - rest2[i], e[i] = more[i] * inverse2;
    }
    HOOKE_UNROLL
    for (int i = 0; i < 6; ++i) {
      const V e2 = e[i] * e[i];
      force_over_length<exact>(s[i], more[i], e[i], e2, l2[i], rest2[i], stiffness + i * lanes);
      Bits bits;  // in the order of values that are not negative
      std::memcpy(&bits, &e2, sizeof bits);
      worst = bits > worst ? bits : worst;
    }
    if constexpr (damped) {
      const auto damp = [&](Direction i, const S* from, std::ptrdiff_t from_apart, const S* to, std::ptrdiff_t to_apart)
          __attribute__((always_inline)) {
        Triple<V> u, w;
        V k;
        load(u, from + c, from_apart), load(w, to + c, to_apart), load(k, springs.damping + lane + i * lanes);
        s[i] += k * ((w.x - u.x) * d[i].x + (w.y - u.y) * d[i].y + (w.z - u.z) * d[i].z) / l2[i];
      };
      const S *v0 = row.v[0], *v1 = row.v[1], *v2 = row.v[2];
      damp(kRight, v0, apart0, v0 + 1, apart0), damp(kRight2, v0, apart0, v0 + 2, apart0);
      damp(kDown, v0, apart0, v1, apart1), damp(kDown2, v0, apart0, v2, apart2);
      damp(kDiagonal, v0, apart0, v1 + 1, apart1), damp(kAntidiagonal, v0 + 1, apart0, v1, apart1);
    }
    Triple<V> force, next, now;
    load(now, row.near + c, pad), load(next, row.far + c, pad);
    force.x = s[kDown] * d[kDown].x - now.x, force.y = s[kDown] * d[kDown].y - now.y;
    force.z = s[kDown] * d[kDown].z - now.z, add(next, s[kDown], d[kDown]);
    add(force, s[kRight], d[kRight]), scaled(now, s[kAntidiagonal], d[kAntidiagonal]);
    add(next, now), take(now, s[kRight], d[kRight]);
    shift<1>(one, now), add(force, one), one = now;
    scaled(now, s[kDiagonal], d[kDiagonal]), add(force, now);
    shift<1>(below, now), add(next, below), below = now;
    store(next, row.next_near + c, pad);
    scaled(now, s[kDown2], d[kDown2]), add(force, now);
    store(now, row.next_far + c, pad);
    scaled(now, s[kRight2], d[kRight2]), add(force, now);
    shift<2>(two, now), subtract(force, force, two), two = now;
    V scale, mass;
    load(scale, row.scale + c), load(mass, row.mass + c);
    HOOKE_UNROLL
    for (int k = 0; k < 3; ++k) {
      V y = scale * (k == 0 ? force.x : k == 1 ? force.y : force.z), y1, y2;
      if constexpr (extra) {
        V own;
        load(own, row.extra + k * pad + c);
        y += mass * own;
      } else {
        y += mass * row.gravity[k];
      }
      if (row.right) store(y, row.right + k * pad + c);
      load(y1, row.z1 + k * plane + c), load(y2, row.z2 + k * plane + c);
      y = y - row.w1 * y1 - row.w2 * y2;
      store(y, row.z + k * plane + c);
    }
  }
  S squares_of_e[n], most = 0;
  std::memcpy(squares_of_e, &worst, sizeof worst);
  HOOKE_UNROLL
  for (int i = 0; i < n; ++i) most = squares_of_e[i] > most ? squares_of_e[i] : most;
  return most <= kNear<S> * kNear<S>;
}

// A row in which any spring is out of the reach of the series takes none.
template <int bytes, bool damped, bool extra, class S>
HOOKE_INLINE void forward_near_or_far(SheetForward<S>& row) {
  bool far = row.far_from_rest;
  if (far)
    far = !forward<bytes, damped, extra, true>(row);
  else if (forward<bytes, damped, extra, false>(row))
    return;
  else {
    far = true;
    forward<bytes, damped, extra, true>(row);
  }
  if (!far) forward<bytes, damped, extra, false>(row);
  row.far_from_rest = far;
}

template <int bytes, class S>
HOOKE_INLINE void any_forward(SheetForward<S>& row) {
  if (row.springs->damping)
    row.extra ? forward_near_or_far<bytes, true, true>(row) : forward_near_or_far<bytes, true, false>(row);
  else
    row.extra ? forward_near_or_far<bytes, false, true>(row) : forward_near_or_far<bytes, false, false>(row);
}

// Columns first, on the way in. Then a lane a row: tiles are turned on the way in and out, so that the
// recurrences along rows run over vectors, too.
template <int bytes, class S>
HOOKE_INLINE void back(const SheetBack<S>& given) {
  const SheetBack<S> block = given;  // a copy that no store can change
  using V = typename Pack<S, bytes>::Type;
  constexpr int n = kSize<V>;
  const S *below = block.below, *below2 = block.below2, *above = block.above, *above2 = block.above2,
          *inverse_pivot = block.inverse_pivot;
  const std::ptrdiff_t stride = block.stride;
  S* y = block.scratch;
  for (int part = kLanes<S> - n; part >= 0; part -= n) {
    S* rows = block.z + part * stride;
    const S *pivot = block.pivot + part, *next = block.next + part, *next2 = block.next2 + part;
    V near[3] = {}, far[3] = {};
    for (int first = 0; first < block.columns; first += n)
      for (int k = 0; k < 3; ++k) {
        V tile[n], under, under2;
        S* wait = block.wait + k * stride + first;
        load(under, wait), load(under2, wait + 3 * stride);
        HOOKE_UNROLL
        for (int i = n - 1; i >= 0; --i) {
          load(tile[i], rows + k * block.plane + i * stride + first);
          tile[i] = tile[i] * pivot[i] - under2 * next2[i] - under * next[i];
          under2 = under, under = tile[i];
        }
        store(under, wait), store(under2, wait + 3 * stride);
        if (block.add) HOOKE_UNROLL
        for (int i = 0; i < n; ++i) {
          V more;
          load(more, block.add + (k * kLanes<S> + part + i) * stride + first);
          tile[i] += more;
        }
        transpose(tile);
        HOOKE_UNROLL
        for (int i = 0; i < n; ++i) {
          tile[i] = tile[i] - far[k] * below2[first + i] - near[k] * below[first + i];
          far[k] = near[k], near[k] = tile[i];
          store(tile[i], y + n * (3 * first + k * n + i));
        }
      }
    for (int k = 0; k < 3; ++k) near[k] = far[k] = V{};
    for (int first = block.columns - n; first >= 0; first -= n)
      for (int k = 0; k < 3; ++k) {
        V tile[n];
        HOOKE_UNROLL
        for (int i = n - 1; i >= 0; --i) {
          load(tile[i], y + n * (3 * first + k * n + i));
          tile[i] = tile[i] * inverse_pivot[first + i] - far[k] * above2[first + i] - near[k] * above[first + i];
          far[k] = near[k], near[k] = tile[i];
        }
        transpose(tile);
        HOOKE_UNROLL
        for (int i = 0; i < n; ++i) store(tile[i], rows + k * block.plane + i * stride + first);
      }
  }
}

}  // namespace

// Vectors of 64 bytes where they are one register.
#if defined(HOOKE_WIDE)
HOOKE_WIDE void wide_forward(SheetForward<float>& row) { any_forward<64>(row); }
HOOKE_WIDE void wide_forward(SheetForward<double>& row) { any_forward<64>(row); }
HOOKE_WIDE void wide_back(const SheetBack<float>& block) { back<64>(block); }
HOOKE_WIDE void wide_back(const SheetBack<double>& block) { back<64>(block); }
#else
template <class S>
void wide_forward(SheetForward<S>&) {}
template <class S>
void wide_back(const SheetBack<S>&) {}
#endif
HOOKE_NARROW_CLONES void narrow_forward(SheetForward<float>& row) { any_forward<32>(row); }
HOOKE_NARROW_CLONES void narrow_forward(SheetForward<double>& row) { any_forward<32>(row); }
HOOKE_NARROW_CLONES void narrow_back(const SheetBack<float>& block) { back<32>(block); }
HOOKE_NARROW_CLONES void narrow_back(const SheetBack<double>& block) { back<32>(block); }

void sheet_forward(SheetForward<float>& row) { has_wide_vectors() ? wide_forward(row) : narrow_forward(row); }
void sheet_forward(SheetForward<double>& row) { has_wide_vectors() ? wide_forward(row) : narrow_forward(row); }
void sheet_back(const SheetBack<float>& block) { has_wide_vectors() ? wide_back(block) : narrow_back(block); }
void sheet_back(const SheetBack<double>& block) { has_wide_vectors() ? wide_back(block) : narrow_back(block); }
HOOKE_CLONES void sheet_squares(int n, const float* difference, float* out) { squares(n, difference, out); }
HOOKE_CLONES void sheet_squares(int n, const double* difference, double* out) { squares(n, difference, out); }
HOOKE_CLONES void sheet_move(const SheetMove<float>& row) { move(row); }
HOOKE_CLONES void sheet_move(const SheetMove<double>& row) { move(row); }
HOOKE_CLONES void sheet_sum(SheetSum<float>& row) { sum_up(row); }
HOOKE_CLONES void sheet_sum(SheetSum<double>& row) { sum_up(row); }

}  // namespace hooke::softbody
