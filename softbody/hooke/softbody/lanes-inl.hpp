// What the fused kernels share, once for every instruction set. Included inside Highway's loop over them.
#if defined(HOOKE_SOFTBODY_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HOOKE_SOFTBODY_LANES_INL
#undef HOOKE_SOFTBODY_LANES_INL
#else
#define HOOKE_SOFTBODY_LANES_INL
#endif

#include <hwy/highway.h>

#include <hooke/softbody/near_rest.hpp>
#include <hooke/types.hpp>

HWY_BEFORE_NAMESPACE();
namespace hooke::softbody::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D, class V = hn::Vec<D>>
HWY_INLINE V squared_length(D d, V x, V y, V z) {
  return hn::MulAdd(z, z, hn::MulAdd(y, y, hn::MulAdd(x, x, hn::Set(d, hn::TFromD<D>(kTiny)))));
}

// Force over length, k (1 - 1/sqrt(1 + e)), of n springs near their rest lengths, see NearRest. They take each step
// together, or a processor would wait for the one before. Stiffnesses are `apart` from each other.
template <std::size_t n, class D, class V = hn::Vec<D>>
HWY_INLINE void near_rest(D d, const V (&e)[n], const hn::TFromD<D>* stiffness, int apart, V (&out)[n]) {
  using S = hn::TFromD<D>;
  constexpr auto& c = NearRest<S>::c;
  const auto each = [&](const auto& action) HWY_ATTR {
    for (std::size_t j = 0; j < n; ++j) action(j);
  };
  const auto k = [&](std::size_t j) HWY_ATTR { return hn::Load(d, stiffness + int(j) * apart); };
  if constexpr (sizeof(S) == 4) {
    each([&](auto j) HWY_ATTR { out[j] = hn::MulAdd(e[j], hn::Set(d, c[5]), hn::Set(d, c[4])); });
    for (int i = 3; i >= 0; --i) each([&](auto j) HWY_ATTR { out[j] = hn::MulAdd(out[j], e[j], hn::Set(d, c[i])); });
    each([&](auto j) HWY_ATTR { out[j] = hn::Mul(hn::Mul(k(j), e[j]), out[j]); });
  } else {
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
