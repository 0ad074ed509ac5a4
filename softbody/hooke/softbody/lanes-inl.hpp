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
constexpr S kNear = S(sizeof(S) == 4 ? 0.125 : 0.1);

// (1 - 1/sqrt(1 + e)) / e to a unit of the last place for |e| <= kNear: interpolated at the zeros of Chebyshev's
// polynomials. Taken this way, not from a root and a quotient, a spring's force costs multiplications alone, which
// processors do many of at once, and it is exactly zero where e is.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V near_rest(D d, V e) {
  using S = hn::TFromD<D>;
  const auto e2 = hn::Mul(e, e);
  if constexpr (sizeof(S) == 4) {
    static constexpr S c[] = {0.500000025f, -0.375000024f, 0.312470649f, -0.273409976f, 0.251080795f, -0.230262271f};
    const auto c01 = hn::MulAdd(e, hn::Set(d, c[1]), hn::Set(d, c[0]));
    const auto c23 = hn::MulAdd(e, hn::Set(d, c[3]), hn::Set(d, c[2]));
    const auto c45 = hn::MulAdd(e, hn::Set(d, c[5]), hn::Set(d, c[4]));
    return hn::MulAdd(hn::MulAdd(c45, e2, c23), e2, c01);
  } else {
    static constexpr S c[] = {0.49999999999999994, -0.37499999999999994, 0.31250000000056027, -0.27343750000054035,
                              0.24609374934676426, -0.22558593687001458, 0.20947293457775856, -0.19638088365402018,
                              0.18541704559776184, -0.17614542296905183, 0.17291995622024864, -0.16574349597998742};
    auto even = hn::Set(d, c[10]), odd = hn::Set(d, c[11]);
    for (int i = 8; i >= 0; i -= 2) {
      even = hn::MulAdd(even, e2, hn::Set(d, c[i]));
      odd = hn::MulAdd(odd, e2, hn::Set(d, c[i + 1]));
    }
    return hn::MulAdd(odd, e, even);
  }
}

// Force over length of a spring of stiffness k whose squared length is `more` above that at rest.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V far_from_rest(D, V k, V more, V l2, V rest) {
  return hn::Div(hn::Mul(k, more), hn::Add(l2, hn::Sqrt(hn::Mul(l2, rest))));
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
