// What the fused kernels share, once for every instruction set. Included inside Highway's loop over them.
#if defined(HOOKE_SOFTBODY_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HOOKE_SOFTBODY_LANES_INL
#undef HOOKE_SOFTBODY_LANES_INL
#else
#define HOOKE_SOFTBODY_LANES_INL
#endif

#include <hwy/highway.h>

#include <hooke/types.hpp>

HWY_BEFORE_NAMESPACE();
namespace hooke::softbody::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Below this length [m], squared, a spring has no direction.
constexpr double kTiny = 1e-24;

template <class D, class V = hn::Vec<D>>
HWY_INLINE V squared_length(D d, V x, V y, V z) {
  return hn::MulAdd(z, z, hn::MulAdd(y, y, hn::MulAdd(x, x, hn::Set(d, hn::TFromD<D>(kTiny)))));
}

// Springs whose squared length is off by at most this share of its square at rest take a series.
template <class S>
constexpr S kNear = S(sizeof(S) == 4 ? 0.125 : 0.085);

// Force over length, k (1 - 1/sqrt(1 + e)), of n springs with |e| <= kNear, e = l²/L² - 1, to a unit of the last place.
// A series, no root and no quotient: a processor does many multiplications at once. Exactly zero where e is. The
// springs take each step together, or it would wait for the one before. Stiffnesses are `apart` from each other.
//
// In float e g(e) with g by Chebyshev's interpolation, which keeps what is small as exact as what is not. In double a
// cubic, y = 1/sqrt(1 + e) to 4e-6, exact at and around e = 0, and one step of third order from there:
// y (1 + r + 3/2 r²), r = (1 - (1 + e) y²)/2. A series of that precision would have eleven terms.
template <std::size_t n, class D, class V = hn::Vec<D>>
HWY_INLINE void near_rest(D d, const V (&e)[n], const hn::TFromD<D>* stiffness, int apart, V (&out)[n]) {
  using S = hn::TFromD<D>;
  const auto each = [&](const auto& action) HWY_ATTR {
    for (std::size_t j = 0; j < n; ++j) action(j);
  };
  const auto k = [&](std::size_t j) HWY_ATTR { return hn::Load(d, stiffness + int(j) * apart); };
  if constexpr (sizeof(S) == 4) {
    static constexpr S c[] = {0.500000025f, -0.375000024f, 0.312470649f, -0.273409976f, 0.251080795f, -0.230262271f};
    each([&](auto j) HWY_ATTR { out[j] = hn::MulAdd(e[j], hn::Set(d, c[5]), hn::Set(d, c[4])); });
    for (int i = 3; i >= 0; --i) each([&](auto j) HWY_ATTR { out[j] = hn::MulAdd(out[j], e[j], hn::Set(d, c[i])); });
    each([&](auto j) HWY_ATTR { out[j] = hn::Mul(hn::Mul(k(j), e[j]), out[j]); });
  } else {
    static constexpr S c[] = {1, -0.5, 0.3769874362125975, -0.314289032358835};
    const auto half = hn::Set(d, S(0.5)), one = hn::Set(d, c[0]);
    V y[n], r[n];
    each([&](auto j) HWY_ATTR { y[j] = hn::MulAdd(e[j], hn::Set(d, c[3]), hn::Set(d, c[2])); });
    for (int i = 1; i >= 0; --i) each([&](auto j) HWY_ATTR { y[j] = hn::MulAdd(y[j], e[j], hn::Set(d, c[i])); });
    each([&](auto j) HWY_ATTR { out[j] = hn::Mul(y[j], y[j]); });
    each([&](auto j) HWY_ATTR { r[j] = hn::NegMulAdd(hn::MulAdd(e[j], half, half), out[j], half); });
    each([&](auto j) HWY_ATTR { out[j] = hn::MulAdd(r[j], hn::Set(d, S(1.5)), one); });
    each([&](auto j) HWY_ATTR { y[j] = hn::MulAdd(hn::Mul(y[j], r[j]), out[j], y[j]); });
    each([&](auto j) HWY_ATTR { out[j] = hn::NegMulAdd(k(j), y[j], k(j)); });
  }
}

// Force over length of a spring of stiffness k whose squared length is `more` above that at rest.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V far_from_rest(D, V k, V more, V l2, V rest) {
  return hn::Div(hn::Mul(k, more), hn::Add(l2, hn::Sqrt(hn::Mul(l2, rest))));
}

// The larger of |a| and |b|.
template <class S, class V = hn::Vec<hn::CappedTag<S, 64 / sizeof(S)>>>
HWY_INLINE V larger_size(V a, V b) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  constexpr int kLargerOfSizes = 0b1011;
  if constexpr (sizeof(S) == 4)
    return V{_mm512_range_ps(a.raw, b.raw, kLargerOfSizes)};
  else
    return V{_mm512_range_pd(a.raw, b.raw, kLargerOfSizes)};
#else
  return hn::Max(hn::Abs(a), hn::Abs(b));
#endif
}

// Lanes of `now` moved up by n, the last ones of `before` in front of them.
template <int n, class S, class V = hn::Vec<hn::CappedTag<S, 64 / sizeof(S)>>>
HWY_INLINE V lanes_up(V before, V now) {
  [[maybe_unused]] const hn::CappedTag<S, 64 / sizeof(S)> d;
  constexpr int lanes = int(hn::MaxLanes(d));
  static_assert(n < lanes);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  const auto bits = [](V v) HWY_ATTR { return hn::BitCast(hn::CappedTag<int32_t, 16>(), v).raw; };
  if constexpr (sizeof(S) == 4)
    return V{_mm512_castsi512_ps(_mm512_alignr_epi32(bits(now), bits(before), 16 - n))};
  else
    return V{_mm512_castsi512_pd(_mm512_alignr_epi64(bits(now), bits(before), 8 - n))};
#elif HWY_TARGET == HWY_AVX2
  const hn::Repartition<int32_t, decltype(d)> di;
  const hn::Vec<decltype(di)> low = hn::BitCast(di, before), high = hn::BitCast(di, now),
                              middle{_mm256_permute2x128_si256(low.raw, high.raw, 0x21)};
  if constexpr (n * sizeof(S) == 16)
    return hn::BitCast(d, middle);
  else
    return hn::BitCast(d, hn::Vec<decltype(di)>{_mm256_alignr_epi8(high.raw, middle.raw, 16 - n * int(sizeof(S)))});
#elif HWY_TARGET != HWY_SCALAR
  static_assert(lanes * sizeof(S) == 16);
  return hn::CombineShiftRightLanes<lanes - n>(d, now, before);
#endif
}

// The same of n differences x|y|z, n a multiple of a cache line's.
template <class S>
void squared_lengths(Index n, const S* difference, S* out) {
  const hn::CappedTag<S, 64 / sizeof(S)> d;
  for (Index i = 0; i < n; i += Index(hn::MaxLanes(d)))
    hn::StoreU(squared_length(d, hn::LoadU(d, difference + i), hn::LoadU(d, difference + n + i),
                              hn::LoadU(d, difference + 2 * n + i)),
               d, out + i);
}

}  // namespace hooke::softbody::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
