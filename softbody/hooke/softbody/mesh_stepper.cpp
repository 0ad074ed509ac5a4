// Compiled once for every instruction set, like grid_stepper.cpp.
#include <hooke/softbody/lines.hpp>
#include <hooke/softbody/mesh_stepper.hpp>

#include <algorithm>
#include <array>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hooke/softbody/mesh_stepper.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hooke/softbody/lanes-inl.hpp>

#ifndef HOOKE_MESH_STEPPER_STATE
#define HOOKE_MESH_STEPPER_STATE
namespace hooke::softbody {

// Points are stepped in groups of this many, whatever the vectors' length: the order of summation is fixed.
template <class S>
constexpr int kGroup = int(32 / sizeof(S));

template <class S>
struct MeshState {
  Index groups;
  S *position, *force;  // by point: x, y, z, 0; forces are zero between stages
  S* motion;            // by group: vx | vy | vz | 1/m
  const S* push;        // by group: ax | ay | az; or null
  const int* slots;     // by group: where its springs begin, in slots; one more at the end
  const int* far;       // by slot: the springs' later ends, times 4
  const S* spring;      // by slot: k | L | L²
  S gravity[3];
};

}  // namespace hooke::softbody
#endif

HWY_BEFORE_NAMESPACE();
namespace hooke::softbody::HWY_NAMESPACE {

template <class S>
using GroupTag = hn::CappedTag<S, std::size_t(kGroup<S>)>;

template <class V>
struct Three {
  V x, y, z;
};

#if HWY_TARGET != HWY_SCALAR
// Four records of four floats a block of 128 bits, turned into coordinates.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Three<V> turned(D d, V r0, V r1, V r2, V r3) {
  const hn::Repartition<std::uint64_t, D> pairs;
  const auto wide = [&](V v) HWY_ATTR { return hn::BitCast(pairs, v); };
  const auto xy0 = wide(hn::InterleaveLower(d, r0, r1)), z0 = wide(hn::InterleaveUpper(d, r0, r1));
  const auto xy1 = wide(hn::InterleaveLower(d, r2, r3)), z1 = wide(hn::InterleaveUpper(d, r2, r3));
  return {hn::BitCast(d, hn::InterleaveLower(pairs, xy0, xy1)), hn::BitCast(d, hn::InterleaveUpper(pairs, xy0, xy1)),
          hn::BitCast(d, hn::InterleaveLower(pairs, z0, z1))};
}
#endif

// Records `at` (lane by lane) as coordinates.
template <class S, class At>
HWY_INLINE Three<hn::Vec<GroupTag<S>>> gather(const S* records, At at) {
  const GroupTag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d));
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(S) == 4 && kLanes == 4) {
    return turned(d, hn::Load(d, records + at(0)), hn::Load(d, records + at(1)), hn::Load(d, records + at(2)),
                  hn::Load(d, records + at(3)));
  } else if constexpr (sizeof(S) == 4 && kLanes == 8) {
    const hn::Half<GroupTag<S>> half;
    const auto both = [&](int i) HWY_ATTR {
      return hn::Combine(d, hn::Load(half, records + at(i + 4)), hn::Load(half, records + at(i)));
    };
    return turned(d, both(0), both(1), both(2), both(3));
  } else if constexpr (sizeof(S) == 8 && kLanes == 4) {
    const auto r0 = hn::Load(d, records + at(0)), r1 = hn::Load(d, records + at(1)), r2 = hn::Load(d, records + at(2)),
               r3 = hn::Load(d, records + at(3));
    const auto xz0 = hn::InterleaveLower(d, r0, r1), xz1 = hn::InterleaveLower(d, r2, r3);
    const auto y0 = hn::InterleaveUpper(d, r0, r1), y1 = hn::InterleaveUpper(d, r2, r3);
    return {hn::ConcatLowerLower(d, xz1, xz0), hn::ConcatLowerLower(d, y1, y0), hn::ConcatUpperUpper(d, xz1, xz0)};
  }
#endif
  HWY_ALIGN S x[3][kLanes];
  for (int i = 0; i < kLanes; ++i)
    for (int k = 0; k < 3; ++k) x[k][i] = records[at(i) + k];
  return {hn::Load(d, x[0]), hn::Load(d, x[1]), hn::Load(d, x[2])};
}

// records[at] becomes change(records[at], p), lane by lane in their order.
template <class S, class At, class Change>
HWY_INLINE void scatter(Three<hn::Vec<GroupTag<S>>> p, S* records, At at, Change change) {
  const GroupTag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d));
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(S) == 4 && kLanes >= 4) {
    const hn::Repartition<std::uint64_t, GroupTag<S>> pairs;
    const auto zero = hn::Zero(d);
    const auto xy0 = hn::BitCast(pairs, hn::InterleaveLower(d, p.x, p.y)),
               xy1 = hn::BitCast(pairs, hn::InterleaveUpper(d, p.x, p.y)),
               z0 = hn::BitCast(pairs, hn::InterleaveLower(d, p.z, zero)),
               z1 = hn::BitCast(pairs, hn::InterleaveUpper(d, p.z, zero));
    const auto r0 = hn::BitCast(d, hn::InterleaveLower(pairs, xy0, z0)),
               r1 = hn::BitCast(d, hn::InterleaveUpper(pairs, xy0, z0)),
               r2 = hn::BitCast(d, hn::InterleaveLower(pairs, xy1, z1)),
               r3 = hn::BitCast(d, hn::InterleaveUpper(pairs, xy1, z1));
    const auto put = [&](auto record, auto tag, int i) HWY_ATTR {
      S* place = records + at(i);
      hn::Store(change(hn::Load(tag, place), record), tag, place);
    };
    if constexpr (kLanes == 4) {
      put(r0, d, 0), put(r1, d, 1), put(r2, d, 2), put(r3, d, 3);
    } else {
      const hn::Half<GroupTag<S>> half;
      put(hn::LowerHalf(half, r0), half, 0), put(hn::LowerHalf(half, r1), half, 1);
      put(hn::LowerHalf(half, r2), half, 2), put(hn::LowerHalf(half, r3), half, 3);
      put(hn::UpperHalf(half, r0), half, 4), put(hn::UpperHalf(half, r1), half, 5);
      put(hn::UpperHalf(half, r2), half, 6), put(hn::UpperHalf(half, r3), half, 7);
    }
    return;
  } else if constexpr (sizeof(S) == 8 && kLanes == 4) {
    const auto zero = hn::Zero(d);
    const auto xy0 = hn::InterleaveLower(d, p.x, p.y), xy1 = hn::InterleaveUpper(d, p.x, p.y);
    const auto z0 = hn::InterleaveLower(d, p.z, zero), z1 = hn::InterleaveUpper(d, p.z, zero);
    const auto put = [&](auto record, int i) HWY_ATTR {
      S* place = records + at(i);
      hn::Store(change(hn::Load(d, place), record), d, place);
    };
    put(hn::ConcatLowerLower(d, z0, xy0), 0), put(hn::ConcatLowerLower(d, z1, xy1), 1);
    put(hn::ConcatUpperUpper(d, z0, xy0), 2), put(hn::ConcatUpperUpper(d, z1, xy1), 3);
    return;
  }
#endif
  HWY_ALIGN S x[3][kLanes];
  hn::Store(p.x, d, x[0]), hn::Store(p.y, d, x[1]), hn::Store(p.z, d, x[2]);
  const hn::CappedTag<S, 1> one;
  for (int i = 0; i < kLanes; ++i)
    for (int k = 0; k < 3; ++k) {
      S* place = records + at(i) + k;
      hn::StoreU(change(hn::LoadU(one, place), hn::LoadU(one, x[k] + i)), one, place);
    }
}

template <bool pushed, class S>
void run_stage(const MeshState<S>& mesh, const Stage& stage) {
  const GroupTag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d)), kParts = kGroup<S> / kLanes;
  const auto kick = hn::Set(d, S(stage.kick)), drift = hn::Set(d, S(stage.drift)), zero = hn::Zero(d);
  for (Index g = 0; g < mesh.groups; ++g) {
    Three<hn::Vec<GroupTag<S>>> own[kParts], pull[kParts];
    const auto here = [&](int part) HWY_ATTR {
      return [base = 4 * int(g * kGroup<S> + part * kLanes)](int i) HWY_ATTR { return base + 4 * i; };
    };
    for (int part = 0; part < kParts; ++part) {
      own[part] = gather<S>(mesh.position, here(part));
      pull[part] = {zero, zero, zero};
    }
    for (int slot = mesh.slots[g]; slot < mesh.slots[g + 1]; ++slot)
      for (int part = 0; part < kParts; ++part) {
        const S* spring = mesh.spring + Index(slot) * 3 * kGroup<S> + part * kLanes;
        const int* far = mesh.far + Index(slot) * kGroup<S> + part * kLanes;
        const auto there = [far](int i) HWY_ATTR { return far[i]; };
        const auto b = gather<S>(mesh.position, there);
        const auto& a = own[part];
        const auto dx = hn::Sub(b.x, a.x), dy = hn::Sub(b.y, a.y), dz = hn::Sub(b.z, a.z);
        const auto l2 = squared_length(d, dx, dy, dz);
        const auto k = hn::Mul(hn::Load(d, spring), hn::Sub(l2, hn::Load(d, spring + 2 * kGroup<S>)));
        const auto s = hn::Div(k, hn::MulAdd(hn::Load(d, spring + kGroup<S>), hn::Sqrt(l2), l2));
        const Three<hn::Vec<GroupTag<S>>> p{hn::Mul(s, dx), hn::Mul(s, dy), hn::Mul(s, dz)};
        auto& f = pull[part];
        f = {hn::Add(f.x, p.x), hn::Add(f.y, p.y), hn::Add(f.z, p.z)};
        scatter<S>(p, mesh.force, there, [](auto old, auto pulled) HWY_ATTR { return hn::Sub(old, pulled); });
      }
    for (int part = 0; part < kParts; ++part) {
      S* motion = mesh.motion + g * 4 * kGroup<S> + part * kLanes;
      auto f = gather<S>(mesh.force, here(part));
      const auto w = hn::Load(d, motion + 3 * kGroup<S>);
      const auto free = hn::Ne(w, zero);
      const auto step = [&](int k, auto force, auto more, auto x) HWY_ATTR {
        auto a = hn::IfThenElseZero(free, hn::Set(d, mesh.gravity[k]));
        if constexpr (pushed) a = hn::Add(a, hn::Load(d, mesh.push + (g * 3 + k) * kGroup<S> + part * kLanes));
        const auto v = hn::MulAdd(kick, hn::MulAdd(hn::Add(force, more), w, a), hn::Load(d, motion + k * kGroup<S>));
        hn::Store(v, d, motion + k * kGroup<S>);
        return hn::MulAdd(drift, v, x);
      };
      const Three<hn::Vec<GroupTag<S>>> next{step(0, f.x, pull[part].x, own[part].x),
                                             step(1, f.y, pull[part].y, own[part].y),
                                             step(2, f.z, pull[part].z, own[part].z)};
      const auto replace = [](auto, auto now) HWY_ATTR { return now; };
      scatter<S>(next, mesh.position, here(part), replace);
      scatter<S>({zero, zero, zero}, mesh.force, here(part), replace);
    }
  }
}

template <class S>
void drift_points(const MeshState<S>& mesh, S drift) {
  const GroupTag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d));
  for (Index g = 0; g < mesh.groups; ++g)
    for (int part = 0; part < kGroup<S>; part += kLanes) {
      const auto here = [base = 4 * int(g * kGroup<S> + part)](int i) HWY_ATTR { return base + 4 * i; };
      const S* v = mesh.motion + g * 4 * kGroup<S> + part;
      auto x = gather<S>(mesh.position, here);
      x.x = hn::MulAdd(hn::Set(d, drift), hn::Load(d, v), x.x);
      x.y = hn::MulAdd(hn::Set(d, drift), hn::Load(d, v + kGroup<S>), x.y);
      x.z = hn::MulAdd(hn::Set(d, drift), hn::Load(d, v + 2 * kGroup<S>), x.z);
      scatter<S>(x, mesh.position, here, [](auto, auto now) HWY_ATTR { return now; });
    }
}

template <class S>
void run_mesh(const MeshState<S>& mesh, std::span<const Stage> stages) {
  for (const Stage& stage : stages)
    if (stage.kick == 0)
      drift_points(mesh, S(stage.drift));
    else if (mesh.push)
      run_stage<true>(mesh, stage);
    else
      run_stage<false>(mesh, stage);
}

void run_mesh_float(const MeshState<float>& mesh, std::span<const Stage> stages) { run_mesh(mesh, stages); }
void run_mesh_double(const MeshState<double>& mesh, std::span<const Stage> stages) { run_mesh(mesh, stages); }
void mesh_squares_float(Index n, const float* difference, float* out) { squared_lengths(n, difference, out); }
void mesh_squares_double(Index n, const double* difference, double* out) { squared_lengths(n, difference, out); }

}  // namespace hooke::softbody::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hooke::softbody {

namespace {

HWY_EXPORT(run_mesh_float);
HWY_EXPORT(run_mesh_double);
HWY_EXPORT(mesh_squares_float);
HWY_EXPORT(mesh_squares_double);

// O is the body's scalar, S the kernel's.
template <class O, class S>
class MeshStepper final : public Stepper<O> {
 public:
  MeshStepper(const SpringNetwork& network, const Points<O>& start) : order_(near_order(network, start.rows())) {
    const Index n = start.rows();
    state_.groups = (n + kWidth - 1) / kWidth;
    const std::size_t points = std::size_t(state_.groups) * kWidth;
    position_.resize(4 * points), force_.resize(4 * points), motion_.resize(4 * points);
    state_.position = position_.data(), state_.force = force_.data(), state_.motion = motion_.data();
    make_springs(network, start);
  }

  void load(const PointMasses<O>& points, const LowParts<O>& low, const Vec3& gravity, const Points<O>* push) override {
    const bool low_places = kWide && low.position.rows() > 0, low_motion = kWide && low.velocity.rows() > 0;
    for (int k = 0; k < 3; ++k) state_.gravity[k] = S(gravity[k]);
    if (push && push_.empty()) push_.resize(std::size_t(state_.groups) * 3 * kWidth);
    state_.push = push ? push_.data() : nullptr;
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const Index user = order_[i];
      for (int k = 0; k < 3; ++k) {
        state_.position[4 * i + std::size_t(k)] = S(points.position(user, k));
        state_.motion[at(i, 4, k)] = S(points.velocity(user, k));
        if (low_places) state_.position[4 * i + std::size_t(k)] += S(low.position(user, k));
        if (low_motion) state_.motion[at(i, 4, k)] += S(low.velocity(user, k));
        if (push) push_.data()[at(i, 3, k)] = S((*push)(user, k));
      }
      state_.motion[at(i, 4, 3)] = S(points.inverse_mass[user]);
    }
  }

  void run(std::span<const Stage> stages, Gang*) override {
    if constexpr (std::is_same_v<S, float>)
      HWY_DYNAMIC_DISPATCH(run_mesh_float)(state_, stages);
    else
      HWY_DYNAMIC_DISPATCH(run_mesh_double)(state_, stages);
  }

  void store(PointMasses<O>& points, LowParts<O>& low) const override {
    if constexpr (kWide) low.position.resize(points.size(), 3), low.velocity.resize(points.size(), 3);
    for (std::size_t i = 0; i < order_.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        const S x = state_.position[4 * i + std::size_t(k)], v = state_.motion[at(i, 4, k)];
        points.position(order_[i], k) = O(x);
        points.velocity(order_[i], k) = O(v);
        if constexpr (kWide) low.position(order_[i], k) = O(x - S(O(x))), low.velocity(order_[i], k) = O(v - S(O(v)));
      }
  }

  std::string_view precision() const override { return std::is_same_v<O, float> ? "float" : "double"; }

 private:
  static constexpr bool kWide = sizeof(O) < sizeof(S);
  static constexpr std::size_t kWidth = std::size_t(kGroup<S>);

  // Of a field of a point, in groups of so many fields.
  static std::size_t at(std::size_t i, int fields, int field) {
    return (i / kWidth * std::size_t(fields) + std::size_t(field)) * kWidth + i % kWidth;
  }

  void make_springs(const SpringNetwork& network, const Points<O>& start) {
    std::vector<int> place(order_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) place[std::size_t(order_[i])] = int(i);
    // By earlier end, nearest later end first.
    std::vector<std::vector<std::pair<int, std::size_t>>> forward(order_.size());
    for (std::size_t i = 0; i < network.springs.size(); ++i) {
      const auto [first, last] =
          std::minmax(place[std::size_t(network.springs[i].a)], place[std::size_t(network.springs[i].b)]);
      forward[std::size_t(first)].emplace_back(last, i);
    }
    for (auto& springs : forward) std::sort(springs.begin(), springs.end());
    slots_.assign(std::size_t(state_.groups) + 1, 0);
    for (std::size_t i = 0; i < forward.size(); ++i)
      slots_[i / kWidth + 1] = std::max(slots_[i / kWidth + 1], int(forward[i].size()));
    std::partial_sum(slots_.begin(), slots_.end(), slots_.begin());

    const std::size_t slots = std::size_t(slots_.back()), entries = (slots * kWidth + 15) / 16 * 16;
    far_.resize(slots * kWidth);
    spring_.resize(3 * slots * kWidth);
    std::vector<S> difference(3 * entries, S(1)), square(entries);
    std::vector<S> stiffness(entries, S(0));
    // A slot without a spring joins a point to itself, with no stiffness.
    for (std::size_t g = 0; g < std::size_t(state_.groups); ++g)
      for (std::size_t slot = std::size_t(slots_[g]); slot < std::size_t(slots_[g + 1]); ++slot)
        for (std::size_t lane = 0; lane < kWidth; ++lane) {
          const std::size_t point = g * kWidth + lane, turn = slot - std::size_t(slots_[g]),
                            entry = slot * kWidth + lane;
          far_.data()[entry] = int(4 * point);
          if (point >= forward.size() || turn >= forward[point].size()) continue;
          const Spring& spring = network.springs[forward[point][turn].second];
          far_.data()[entry] = 4 * forward[point][turn].first;
          stiffness[entry] = S(O(spring.stiffness));
          for (int k = 0; k < 3; ++k)
            difference[std::size_t(k) * entries + entry] = spring.rest_length == Spring::kFromStart
                                                               ? S(start(spring.b, k)) - S(start(spring.a, k))
                                                               : S(O(k == 0 ? spring.rest_length : 0));
        }
    if constexpr (std::is_same_v<S, float>)
      HWY_DYNAMIC_DISPATCH(mesh_squares_float)(Index(entries), difference.data(), square.data());
    else
      HWY_DYNAMIC_DISPATCH(mesh_squares_double)(Index(entries), difference.data(), square.data());
    for (std::size_t entry = 0; entry < slots * kWidth; ++entry) {
      S* spring = spring_.data() + entry / kWidth * 3 * kWidth + entry % kWidth;
      spring[0] = stiffness[entry];
      spring[kWidth] = std::sqrt(square[entry]);
      spring[2 * kWidth] = square[entry];
    }
    state_.slots = slots_.data(), state_.far = far_.data(), state_.spring = spring_.data();
  }

  std::vector<int> order_, slots_;
  MeshState<S> state_{};
  Lines<S> position_, force_, motion_, push_, spring_;
  Lines<int> far_;
};

}  // namespace

std::vector<int> near_order(const SpringNetwork& network, Index points) {
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(points));
  for (const Spring& spring : network.springs) {
    neighbours[std::size_t(spring.a)].push_back(spring.b);
    neighbours[std::size_t(spring.b)].push_back(spring.a);
  }
  const auto lonelier = [&](int i, int j) {
    const std::size_t a = neighbours[std::size_t(i)].size(), b = neighbours[std::size_t(j)].size();
    return a != b ? a < b : i < j;
  };
  std::vector<bool> seen(static_cast<std::size_t>(points));
  std::vector<int> order;
  const auto spread = [&](int seed) {
    const std::size_t first = order.size();
    order.push_back(seed);
    seen[std::size_t(seed)] = true;
    for (std::size_t i = first; i < order.size(); ++i) {
      const std::size_t begin = order.size();
      for (const int next : neighbours[std::size_t(order[i])])
        if (!seen[std::size_t(next)]) seen[std::size_t(next)] = true, order.push_back(next);
      std::sort(order.begin() + std::ptrdiff_t(begin), order.end(), lonelier);
    }
    return first;
  };
  std::vector<int> seeds(static_cast<std::size_t>(points));
  std::iota(seeds.begin(), seeds.end(), 0);
  std::sort(seeds.begin(), seeds.end(), lonelier);
  for (const int seed : seeds) {
    if (seen[std::size_t(seed)]) continue;
    // Once from anywhere; then from the point that this found to be farthest.
    const std::size_t first = spread(seed);
    const int farthest = order.back();
    for (std::size_t i = first; i < order.size(); ++i) seen[std::size_t(order[i])] = false;
    order.resize(first);
    spread(farthest);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

template <class S>
std::unique_ptr<Stepper<S>> make_mesh_stepper(const SpringNetwork& network, const Points<S>& start) {
  return std::make_unique<MeshStepper<S, S>>(network, start);
}

std::unique_ptr<Stepper<float>> make_fine_mesh_stepper(const SpringNetwork& network, const Points<float>& start) {
  return std::make_unique<MeshStepper<float, double>>(network, start);
}

template std::unique_ptr<Stepper<float>> make_mesh_stepper(const SpringNetwork&, const Points<float>&);
template std::unique_ptr<Stepper<double>> make_mesh_stepper(const SpringNetwork&, const Points<double>&);

}  // namespace hooke::softbody
#endif  // HWY_ONCE
