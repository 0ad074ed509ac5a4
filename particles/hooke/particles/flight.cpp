// Compiled once for every instruction set by Highway and chosen at run time. Products and sums are fused where the
// processor can: the same bits on all processors that can, and on all that cannot.
#include <hooke/particles/flight.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hooke/particles/flight.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace hooke::particles::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr Index kAhead = 128;  // particles that are asked for before they are needed

template <class S>
using Lanes = hn::CappedTag<S, std::size_t(Tile<S>::kLanes / 2)>;

template <class D, class V = hn::Vec<D>>
HWY_INLINE V dot(V a0, V a1, V a2, V b0, V b1, V b2) {
  return hn::MulAdd(a2, b2, hn::MulAdd(a1, b1, hn::Mul(a0, b0)));
}

template <class S, class D, class M, class V>
HWY_NOINLINE void tell(D d, const Flight<S>& flight, const Plane<S>& plane, int leg, Index first, M who, V speed, V x0,
                       V x1, V x2) {
  constexpr std::size_t n = hn::MaxLanes(D());
  alignas(64) S told[4][n];
  hn::Store(speed, d, told[0]);
  hn::Store(x0, d, told[1]), hn::Store(x1, d, told[2]), hn::Store(x2, d, told[3]);
  alignas(64) S mark[n];
  hn::Store(hn::IfThenElse(who, hn::Set(d, S(1)), hn::Zero(d)), d, mark);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i)
    if (mark[i] != 0)
      flight.hits->push_back({first + Index(i),
                              flight.first_leg + leg,
                              told[0][i],
                              {told[1][i], told[2][i], told[3][i]},
                              {plane.normal[0], plane.normal[1], plane.normal[2]}});
}

// Reflects what is below the plane: position as if it had met it in the middle of the drift, velocity with restitution
// and Coulomb's friction. What comes slowly stays on it.
template <class S, class D, class M, class V>
HWY_INLINE void reflect(D d, const Flight<S>& flight, const Plane<S>& p, int leg, Index first, M below, V gap, V& x0,
                        V& x1, V& x2, V& v0, V& v1, V& v2) {
  const V zero = hn::Zero(d), one = hn::Set(d, S(1));
  const V n0 = hn::Set(d, p.normal[0]), n1 = hn::Set(d, p.normal[1]), n2 = hn::Set(d, p.normal[2]);
  const V r0 = hn::Sub(v0, hn::Set(d, p.wall[0])), r1 = hn::Sub(v1, hn::Set(d, p.wall[1])),
          r2 = hn::Sub(v2, hn::Set(d, p.wall[2]));
  const V along = dot<D>(r0, r1, r2, n0, n1, n2);
  const auto comes = hn::And(below, hn::Lt(along, zero));
  const V bounce = hn::IfThenElse(hn::Lt(hn::Neg(along), hn::Set(d, p.slow)), zero, hn::Set(d, p.bounce));
  const V gain = hn::Add(one, bounce);
  const V impulse = hn::IfThenElseZero(comes, hn::Neg(hn::Mul(gain, along)));
  const V push = hn::IfThenElseZero(below, hn::Neg(hn::Mul(hn::IfThenElse(comes, gain, one), gap)));
  const V t0 = hn::Sub(r0, hn::Mul(along, n0)), t1 = hn::Sub(r1, hn::Mul(along, n1)),
          t2 = hn::Sub(r2, hn::Mul(along, n2));
  const V slip = hn::Sqrt(dot<D>(t0, t1, t2, t0, t1, t2));
  const V tiny = hn::Set(d, std::numeric_limits<S>::min());
  const V rub = hn::Min(one, hn::Div(hn::Mul(hn::Set(d, p.friction), impulse), hn::Max(slip, tiny)));
  if (HWY_UNLIKELY(flight.hits != nullptr)) {
    const auto told = hn::And(comes, hn::Ge(hn::Neg(along), hn::Set(d, p.slow)));
    if (!hn::AllFalse(d, told))
      tell<S>(d, flight, p, leg, first, told, hn::Neg(along), hn::Sub(x0, hn::Mul(gap, n0)),
              hn::Sub(x1, hn::Mul(gap, n1)), hn::Sub(x2, hn::Mul(gap, n2)));
  }
  // What rests does not creep: friction takes back the slip of the drift as well.
  const auto slow = hn::And(comes, hn::Lt(hn::Neg(along), hn::Set(d, p.slow)));
  const V back = hn::IfThenElseZero(slow, hn::Mul(rub, hn::Set(d, flight.legs[std::size_t(leg)].drift)));
  x0 = hn::IfThenElse(slow, hn::Sub(x0, hn::Mul(back, t0)), x0);
  x1 = hn::IfThenElse(slow, hn::Sub(x1, hn::Mul(back, t1)), x1);
  x2 = hn::IfThenElse(slow, hn::Sub(x2, hn::Mul(back, t2)), x2);
  x0 = hn::IfThenElse(below, hn::Add(x0, hn::Mul(push, n0)), x0);
  x1 = hn::IfThenElse(below, hn::Add(x1, hn::Mul(push, n1)), x1);
  x2 = hn::IfThenElse(below, hn::Add(x2, hn::Mul(push, n2)), x2);
  v0 = hn::IfThenElse(comes, hn::Add(v0, hn::Sub(hn::Mul(impulse, n0), hn::Mul(rub, t0))), v0);
  v1 = hn::IfThenElse(comes, hn::Add(v1, hn::Sub(hn::Mul(impulse, n1), hn::Mul(rub, t1))), v1);
  v2 = hn::IfThenElse(comes, hn::Add(v2, hn::Sub(hn::Mul(impulse, n2), hn::Mul(rub, t2))), v2);
}

// What touches the plane and presses into it slowly stops doing so.
template <class S, class D, class M, class V>
HWY_INLINE void rest(D d, const Plane<S>& p, M touching, V& v0, V& v1, V& v2) {
  const V n0 = hn::Set(d, p.normal[0]), n1 = hn::Set(d, p.normal[1]), n2 = hn::Set(d, p.normal[2]);
  const V r0 = hn::Sub(v0, hn::Set(d, p.wall[0])), r1 = hn::Sub(v1, hn::Set(d, p.wall[1])),
          r2 = hn::Sub(v2, hn::Set(d, p.wall[2]));
  const V along = dot<D>(r0, r1, r2, n0, n1, n2);
  const auto zero = hn::Zero(d), one = hn::Set(d, S(1));
  const auto stops = hn::And(touching, hn::And(hn::Lt(along, zero), hn::Lt(hn::Neg(along), hn::Set(d, p.slow))));
  const V t0 = hn::Sub(r0, hn::Mul(along, n0)), t1 = hn::Sub(r1, hn::Mul(along, n1)),
          t2 = hn::Sub(r2, hn::Mul(along, n2));
  const V slip = hn::Max(hn::Sqrt(dot<D>(t0, t1, t2, t0, t1, t2)), hn::Set(d, std::numeric_limits<S>::min()));
  const V rub = hn::Min(one, hn::Div(hn::Mul(hn::Set(d, p.friction), hn::Neg(along)), slip));
  v0 = hn::IfThenElse(stops, hn::Sub(hn::Sub(v0, hn::Mul(along, n0)), hn::Mul(rub, t0)), v0);
  v1 = hn::IfThenElse(stops, hn::Sub(hn::Sub(v1, hn::Mul(along, n1)), hn::Mul(rub, t1)), v1);
  v2 = hn::IfThenElse(stops, hn::Sub(hn::Sub(v2, hn::Mul(along, n2)), hn::Mul(rub, t2)), v2);
}

// A group's lanes: two vectors at a time, so that one computes while the other waits for its results.
template <class D, class V = hn::Vec<D>>
struct Group {
  V x0, x1, x2, v0, v1, v2;
};

template <class S>
HWY_INLINE hn::Vec<Lanes<S>> gap_to(const Plane<S>& p, const Group<Lanes<S>>& g) {
  const Lanes<S> d;
  const auto n0 = hn::Set(d, p.normal[0]), n1 = hn::Set(d, p.normal[1]), n2 = hn::Set(d, p.normal[2]);
  return hn::Sub(dot<Lanes<S>>(g.x0, g.x1, g.x2, n0, n1, n2), hn::Set(d, p.offset));
}

// The rare case. Not inlined, and through memory: the loop's registers stay its own.
template <class S>
HWY_NOINLINE void meet(const Tile<S>& tile, const Flight<S>& flight, int leg, Index i, const Plane<S>& p, S* lanes) {
  const Lanes<S> d;
  const std::size_t n = hn::Lanes(d);
  Group<Lanes<S>> g{hn::LoadU(d, lanes),         hn::LoadU(d, lanes + n),     hn::LoadU(d, lanes + 2 * n),
                    hn::LoadU(d, lanes + 3 * n), hn::LoadU(d, lanes + 4 * n), hn::LoadU(d, lanes + 5 * n)};
  const auto gap = gap_to(p, g);
  auto met = hn::Lt(gap, hn::Set(d, leg < 0 ? p.near : S(0)));
  met = hn::And(met, hn::FirstN(d, std::size_t(std::max<Index>(tile.count - i, 0))));
  if (flight.skip) met = hn::And(met, hn::Gt(hn::LoadU(d, flight.skip + i), hn::Zero(d)));
  if (leg < 0)
    rest<S>(d, p, met, g.v0, g.v1, g.v2);
  else
    reflect<S>(d, flight, p, leg, i, met, gap, g.x0, g.x1, g.x2, g.v0, g.v1, g.v2);
  hn::StoreU(g.x0, d, lanes), hn::StoreU(g.x1, d, lanes + n), hn::StoreU(g.x2, d, lanes + 2 * n);
  hn::StoreU(g.v0, d, lanes + 3 * n), hn::StoreU(g.v1, d, lanes + 4 * n), hn::StoreU(g.v2, d, lanes + 5 * n);
}

template <class S>
HWY_INLINE void meet(const Tile<S>& tile, const Flight<S>& flight, int leg, Index i, const Plane<S>& p,
                     Group<Lanes<S>>& g) {
  const Lanes<S> d;
  const std::size_t n = hn::Lanes(d);
  alignas(64) S lanes[6 * hn::MaxLanes(Lanes<S>())];
  hn::StoreU(g.x0, d, lanes), hn::StoreU(g.x1, d, lanes + n), hn::StoreU(g.x2, d, lanes + 2 * n);
  hn::StoreU(g.v0, d, lanes + 3 * n), hn::StoreU(g.v1, d, lanes + 4 * n), hn::StoreU(g.v2, d, lanes + 5 * n);
  meet<S>(tile, flight, leg, i, p, lanes);
  g = {hn::LoadU(d, lanes),         hn::LoadU(d, lanes + n),     hn::LoadU(d, lanes + 2 * n),
       hn::LoadU(d, lanes + 3 * n), hn::LoadU(d, lanes + 4 * n), hn::LoadU(d, lanes + 5 * n)};
}

// What a group does at the planes of a leg; leg -1: at rest on those of the last leg.
enum class Planes { None, Floor, Many };  // Floor: one, its normal is (0, 1, 0)

template <Planes kPlanes, class S>
HWY_INLINE void meet_planes(const Tile<S>& tile, const Flight<S>& flight, int leg, Index i, const Plane<S>* planes,
                            Group<Lanes<S>>& a, Group<Lanes<S>>& b) {
  if constexpr (kPlanes != Planes::None) {
    const Lanes<S> d;
    const Index n = kPlanes == Planes::Floor ? 1 : flight.plane_count;
    for (const Plane<S>* p = planes; p < planes + n; ++p) {
      const auto offset = hn::Set(d, p->offset);
      const auto gap =
          kPlanes == Planes::Floor ? hn::Sub(hn::Min(a.x1, b.x1), offset) : hn::Min(gap_to(*p, a), gap_to(*p, b));
      if (HWY_LIKELY(hn::AllFalse(d, hn::Lt(gap, hn::Set(d, leg < 0 ? p->near : S(0)))))) continue;
      const auto reach = hn::Set(d, leg < 0 ? p->near : S(0));
      if (!hn::AllFalse(d, hn::Lt(gap_to(*p, a), reach))) meet<S>(tile, flight, leg, i, *p, a);
      if (!hn::AllFalse(d, hn::Lt(gap_to(*p, b), reach))) meet<S>(tile, flight, leg, i + Index(hn::Lanes(d)), *p, b);
    }
  }
}

template <class S>
HWY_INLINE void kick(const Kick<S>& kick, Group<Lanes<S>>& a, Group<Lanes<S>>& b) {
  const Lanes<S> d;
  const auto gain = hn::Set(d, kick.gain);
  const auto add0 = hn::Set(d, kick.add[0]), add1 = hn::Set(d, kick.add[1]), add2 = hn::Set(d, kick.add[2]);
  a.v0 = hn::Add(a.v0, hn::MulAdd(a.v0, gain, add0)), b.v0 = hn::Add(b.v0, hn::MulAdd(b.v0, gain, add0));
  a.v1 = hn::Add(a.v1, hn::MulAdd(a.v1, gain, add1)), b.v1 = hn::Add(b.v1, hn::MulAdd(b.v1, gain, add1));
  a.v2 = hn::Add(a.v2, hn::MulAdd(a.v2, gain, add2)), b.v2 = hn::Add(b.v2, hn::MulAdd(b.v2, gain, add2));
}

template <Planes kPlanes, class S>
bool fly_lanes(const Tile<S>& tile, const Flight<S>& flight) {
  const Lanes<S> d;
  const Index lanes = Index(hn::Lanes(d));
  const int legs = int(flight.legs.size());
  const Leg<S>* const first = flight.legs.data();
  const Plane<S>* const last_planes = flight.planes + std::max(legs - 1, 0) * flight.plane_count;
  auto sum = hn::Zero(d);
  S *const px = tile.x[0], *const py = tile.x[1], *const pz = tile.x[2];
  S *const qx = tile.v[0], *const qy = tile.v[1], *const qz = tile.v[2];
  const auto load = [&](Index i) HWY_ATTR {
    return Group<Lanes<S>>{hn::LoadU(d, px + i), hn::LoadU(d, py + i), hn::LoadU(d, pz + i),
                           hn::LoadU(d, qx + i), hn::LoadU(d, qy + i), hn::LoadU(d, qz + i)};
  };
  const auto store = [&](Index i, const Group<Lanes<S>>& g) HWY_ATTR {
    hn::StoreU(g.x0, d, px + i), hn::StoreU(g.x1, d, py + i), hn::StoreU(g.x2, d, pz + i);
    hn::StoreU(g.v0, d, qx + i), hn::StoreU(g.v1, d, qy + i), hn::StoreU(g.v2, d, qz + i);
    // What is not finite makes NaN of its product with zero.
    auto part = hn::Add(hn::Add(hn::Add(g.x0, g.x1), hn::Add(g.x2, g.v0)), hn::Add(g.v1, g.v2));
    if (HWY_UNLIKELY(tile.count - i < lanes))
      part = hn::IfThenElseZero(hn::FirstN(d, std::size_t(std::max<Index>(tile.count - i, 0))), part);
    sum = hn::MulAdd(part, hn::Zero(d), sum);
  };
  for (Index i = 0; i < tile.count; i += 2 * lanes) {
    Group<Lanes<S>> a = load(i), b = load(i + lanes);
    // Six streams are more than the processor's own prefetchers follow well.
    for (int k = 0; k < 3; ++k)
      __builtin_prefetch(tile.x[k] + i + kAhead, 1), __builtin_prefetch(tile.v[k] + i + kAhead, 1);
    const Plane<S>* planes = flight.planes;
    for (int l = 0; l < legs; ++l, planes += flight.plane_count) {
      kick<S>(first[l].kick, a, b);
      const auto drift = hn::Set(d, first[l].drift);
      a.x0 = hn::MulAdd(drift, a.v0, a.x0), a.x1 = hn::MulAdd(drift, a.v1, a.x1), a.x2 = hn::MulAdd(drift, a.v2, a.x2);
      b.x0 = hn::MulAdd(drift, b.v0, b.x0), b.x1 = hn::MulAdd(drift, b.v1, b.x1), b.x2 = hn::MulAdd(drift, b.v2, b.x2);
      meet_planes<kPlanes, S>(tile, flight, l, i, planes, a, b);
    }
    if (flight.last) kick<S>(*flight.last, a, b);
    if (flight.settles) meet_planes<kPlanes, S>(tile, flight, -1, i, last_planes, a, b);
    store(i, a), store(i + lanes, b);
  }
  return hn::GetLane(hn::SumOfLanes(d, sum)) == 0;
}

// One step a tick is bound by memory: here all constants stay in registers, and one vector at a time is enough.
template <Planes kPlanes, class S>
bool fly_once(const Tile<S>& tile, const Flight<S>& flight) {
  const Lanes<S> d;
  const Index lanes = Index(hn::Lanes(d));
  const Kick<S>&k = flight.legs[0].kick, &e = *flight.last;
  const auto gain = hn::Set(d, k.gain), end_gain = hn::Set(d, e.gain), drift = hn::Set(d, flight.legs[0].drift);
  const auto add0 = hn::Set(d, k.add[0]), add1 = hn::Set(d, k.add[1]), add2 = hn::Set(d, k.add[2]);
  const auto end0 = hn::Set(d, e.add[0]), end1 = hn::Set(d, e.add[1]), end2 = hn::Set(d, e.add[2]);
  const S offset = kPlanes == Planes::Floor ? flight.planes->offset : S(0);
  const S near = kPlanes == Planes::Floor ? flight.planes->near : S(0);
  const auto touch = hn::Set(d, offset + near);
  S *const px = tile.x[0], *const py = tile.x[1], *const pz = tile.x[2];
  S *const qx = tile.v[0], *const qy = tile.v[1], *const qz = tile.v[2];
  auto sum = hn::Zero(d);
  for (Index i = 0; i < tile.count; i += lanes) {
    Group<Lanes<S>> g{hn::LoadU(d, px + i), hn::LoadU(d, py + i), hn::LoadU(d, pz + i),
                      hn::LoadU(d, qx + i), hn::LoadU(d, qy + i), hn::LoadU(d, qz + i)};
    if ((std::size_t(i) * sizeof(S)) % 64 == 0) {
      __builtin_prefetch(px + i + kAhead, 1), __builtin_prefetch(py + i + kAhead, 1),
          __builtin_prefetch(pz + i + kAhead, 1);
      __builtin_prefetch(qx + i + kAhead, 1), __builtin_prefetch(qy + i + kAhead, 1),
          __builtin_prefetch(qz + i + kAhead, 1);
    }
    g.v0 = hn::Add(g.v0, hn::MulAdd(g.v0, gain, add0));
    g.v1 = hn::Add(g.v1, hn::MulAdd(g.v1, gain, add1));
    g.v2 = hn::Add(g.v2, hn::MulAdd(g.v2, gain, add2));
    g.x0 = hn::MulAdd(drift, g.v0, g.x0), g.x1 = hn::MulAdd(drift, g.v1, g.x1), g.x2 = hn::MulAdd(drift, g.v2, g.x2);
    bool met = false;
    if constexpr (kPlanes == Planes::Floor) {
      met = !hn::AllFalse(d, hn::Lt(g.x1, touch));
      if (HWY_UNLIKELY(met)) meet<S>(tile, flight, 0, i, *flight.planes, g);
    }
    g.v0 = hn::Add(g.v0, hn::MulAdd(g.v0, end_gain, end0));
    g.v1 = hn::Add(g.v1, hn::MulAdd(g.v1, end_gain, end1));
    g.v2 = hn::Add(g.v2, hn::MulAdd(g.v2, end_gain, end2));
    if (HWY_UNLIKELY(met) && flight.settles) meet<S>(tile, flight, -1, i, *flight.planes, g);
    hn::StoreU(g.x0, d, px + i), hn::StoreU(g.x1, d, py + i), hn::StoreU(g.x2, d, pz + i);
    hn::StoreU(g.v0, d, qx + i), hn::StoreU(g.v1, d, qy + i), hn::StoreU(g.v2, d, qz + i);
    auto part = hn::Add(hn::Add(hn::Add(g.x0, g.x1), hn::Add(g.x2, g.v0)), hn::Add(g.v1, g.v2));
    if (HWY_UNLIKELY(tile.count - i < lanes))
      part = hn::IfThenElseZero(hn::FirstN(d, std::size_t(tile.count - i)), part);
    sum = hn::MulAdd(part, hn::Zero(d), sum);
  }
  return hn::GetLane(hn::SumOfLanes(d, sum)) == 0;
}

template <class S>
bool fly_any(const Tile<S>& tile, const Flight<S>& flight) {
  const bool once = flight.legs.size() == 1 && flight.last,
             floor = flight.plane_count == 1 && flight.planes->normal[1] == 1 && flight.planes->normal[0] == 0 &&
                     flight.planes->normal[2] == 0;
  if (once && flight.plane_count == 0) return fly_once<Planes::None>(tile, flight);
  if (once && floor) return fly_once<Planes::Floor>(tile, flight);
  if (flight.plane_count == 0) return fly_lanes<Planes::None>(tile, flight);
  if (floor) return fly_lanes<Planes::Floor>(tile, flight);
  return fly_lanes<Planes::Many>(tile, flight);
}

// Planes alone, after a drift without them.
template <class S>
void reflect_lanes(const Tile<S>& tile, const Flight<S>& flight) {
  const Lanes<S> d;
  for (Index i = 0; i < tile.count; i += Index(hn::Lanes(d))) {
    Group<Lanes<S>> g{hn::LoadU(d, tile.x[0] + i), hn::LoadU(d, tile.x[1] + i), hn::LoadU(d, tile.x[2] + i),
                      hn::LoadU(d, tile.v[0] + i), hn::LoadU(d, tile.v[1] + i), hn::LoadU(d, tile.v[2] + i)};
    bool met = false;
    for (const Plane<S>* p = flight.planes; p < flight.planes + flight.plane_count; ++p) {
      if (hn::AllFalse(d, hn::Lt(gap_to(*p, g), hn::Zero(d)))) continue;
      meet<S>(tile, flight, 0, i, *p, g);
      met = true;
    }
    if (!met) continue;
    hn::StoreU(g.x0, d, tile.x[0] + i), hn::StoreU(g.x1, d, tile.x[1] + i), hn::StoreU(g.x2, d, tile.x[2] + i);
    hn::StoreU(g.v0, d, tile.v[0] + i), hn::StoreU(g.v1, d, tile.v[1] + i), hn::StoreU(g.v2, d, tile.v[2] + i);
  }
}

template <class S>
void kick_lanes(const Tile<S>& tile, const Kick<S>& kick, const S* const a[3], S share) {
  const Lanes<S> d;
  const auto gain = hn::Set(d, kick.gain), part = hn::Set(d, share);
  for (int k = 0; k < 3; ++k) {
    const auto add = hn::Set(d, kick.add[k]);
    for (Index i = 0; i < tile.count; i += Index(hn::Lanes(d))) {
      const auto v = hn::LoadU(d, tile.v[k] + i);
      const auto change = hn::MulAdd(part, hn::LoadU(d, a[k] + i), hn::MulAdd(v, gain, add));
      hn::StoreU(hn::Add(v, change), d, tile.v[k] + i);
    }
  }
}

bool fly_float(const Tile<float>& t, const Flight<float>& f) { return fly_any(t, f); }
bool fly_double(const Tile<double>& t, const Flight<double>& f) { return fly_any(t, f); }
void reflect_float(const Tile<float>& t, const Flight<float>& f) { reflect_lanes(t, f); }
void reflect_double(const Tile<double>& t, const Flight<double>& f) { reflect_lanes(t, f); }
void kick_float(const Tile<float>& t, const Kick<float>& k, const float* const a[3], float s) {
  kick_lanes(t, k, a, s);
}
void kick_double(const Tile<double>& t, const Kick<double>& k, const double* const a[3], double s) {
  kick_lanes(t, k, a, s);
}

}  // namespace hooke::particles::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hooke::particles {

HWY_EXPORT(fly_float);
HWY_EXPORT(fly_double);
HWY_EXPORT(reflect_float);
HWY_EXPORT(reflect_double);
HWY_EXPORT(kick_float);
HWY_EXPORT(kick_double);

bool fly(const Tile<float>& tile, const Flight<float>& flight) { return HWY_DYNAMIC_DISPATCH(fly_float)(tile, flight); }
bool fly(const Tile<double>& tile, const Flight<double>& flight) {
  return HWY_DYNAMIC_DISPATCH(fly_double)(tile, flight);
}
void reflect(const Tile<float>& tile, const Flight<float>& flight) {
  HWY_DYNAMIC_DISPATCH(reflect_float)(tile, flight);
}
void reflect(const Tile<double>& tile, const Flight<double>& flight) {
  HWY_DYNAMIC_DISPATCH(reflect_double)(tile, flight);
}
void kick(const Tile<float>& tile, const Kick<float>& kick, const float* const a[3], float share) {
  HWY_DYNAMIC_DISPATCH(kick_float)(tile, kick, a, share);
}
void kick(const Tile<double>& tile, const Kick<double>& kick, const double* const a[3], double share) {
  HWY_DYNAMIC_DISPATCH(kick_double)(tile, kick, a, share);
}

}  // namespace hooke::particles
#endif
