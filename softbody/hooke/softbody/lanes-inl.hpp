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

// The series of NearRest at e.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V near_rest(D d, V e) {
  using S = hn::TFromD<D>;
  constexpr auto& c = NearRest<S>::c;
  const auto e2 = hn::Mul(e, e);
  if constexpr (sizeof(S) == 4) {
    const auto c01 = hn::MulAdd(e, hn::Set(d, c[1]), hn::Set(d, c[0]));
    const auto c23 = hn::MulAdd(e, hn::Set(d, c[3]), hn::Set(d, c[2]));
    const auto c45 = hn::MulAdd(e, hn::Set(d, c[5]), hn::Set(d, c[4]));
    return hn::MulAdd(hn::MulAdd(c45, e2, c23), e2, c01);
  } else {
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
