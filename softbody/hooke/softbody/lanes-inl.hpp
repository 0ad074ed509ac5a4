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
