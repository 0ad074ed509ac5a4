// This file is compiled once for every instruction set: Highway includes it again and again, up to
// HWY_ONCE, and chooses at run time.
#include <hooke/softbody/grid_stepper.hpp>
#include <hooke/softbody/lines.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hooke/softbody/grid_stepper.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <hooke/softbody/lanes-inl.hpp>

#ifndef HOOKE_GRID_STEPPER_STATE
#define HOOKE_GRID_STEPPER_STATE
namespace hooke::softbody {

// Columns are dealt with in blocks of a cache line, whatever the vectors' length.
template <class S>
constexpr int kColumns = int(64 / sizeof(S));

// Stages that a band's first two rows have taken, and those it has finished.
struct alignas(64) GridBand {
  std::atomic<int> ready{0};
  alignas(64) std::atomic<int> done{0};
};

// What the springs that a stage has seen pull at, summed up: the row after the last one, and the one behind that.
// Rows of x|y|z, with the sign of the springs' upper ends.
template <class S>
struct GridWake {
  S *next, *next2;
};

template <class S>
struct GridState {
  Index rows, blocks;
  std::ptrdiff_t stride;  // from coordinate to coordinate in a row, a block's margin on both sides
  // Positions and velocities are x, y, z; in two floats also what they are more than that.
  bool low;
  S *x, *motion;              // rows of x|y|z(|low x|y|z); rows of blocks of vx|vy|vz|1/m(|low vx|vy|vz)
  const S* push;              // null, or rows of blocks of ax|ay|az
  const S* const* stiffness;  // by row: blocks of six directions
  const S* const* rest;       // by row: blocks of the exact squares of their rest lengths
  const S* const* inverse;    // by row: blocks of one over these, to a few units of their last place
  S gravity[3];
  std::span<const GridWake<S>> wakes;

  // Bands of rows, one a thread; with one band, `together` stages run down the rows at once.
  int bands;
  std::size_t together;
  GridBand* band;

  Index first(int b) const { return rows * b / bands; }
  int planes() const { return low ? 6 : 3; }
  int fields() const { return low ? 7 : 4; }
  S* position(Index row) const { return x + row * planes() * stride + kColumns<S>; }
};

}  // namespace hooke::softbody
#endif

HWY_BEFORE_NAMESPACE();
namespace hooke::softbody::HWY_NAMESPACE {

template <class S>
using Tag = hn::CappedTag<S, std::size_t(kColumns<S>)>;
template <class S>
using V = hn::Vec<Tag<S>>;

// (high, low) += more, where low stays below half a unit of high's last place (Knuth's two-sum).
template <class S>
HWY_INLINE void add_exactly(V<S>& high, V<S>& low, V<S> more) {
  const auto y = hn::Add(low, more), sum = hn::Add(high, y), part = hn::Sub(sum, high);
  low = hn::Add(hn::Sub(high, hn::Sub(sum, part)), hn::Sub(y, part));
  high = sum;
}

template <bool low, class S>
struct Place {
  V<S> x, y, z, low_x, low_y, low_z;
};

template <bool low, class S>
HWY_INLINE Place<low, S> place(const S* x, std::ptrdiff_t st) {
  const Tag<S> d;
  Place<low, S> a;
  a.x = hn::LoadU(d, x), a.y = hn::LoadU(d, x + st), a.z = hn::LoadU(d, x + 2 * st);
  if constexpr (low)
    a.low_x = hn::LoadU(d, x + 3 * st), a.low_y = hn::LoadU(d, x + 4 * st), a.low_z = hn::LoadU(d, x + 5 * st);
  return a;
}

template <class S>
struct Way {
  V<S> x, y, z;
};

template <bool low, class S>
HWY_INLINE Way<S> way(const Place<low, S>& from, const Place<low, S>& to) {
  Way<S> w{hn::Sub(to.x, from.x), hn::Sub(to.y, from.y), hn::Sub(to.z, from.z)};
  if constexpr (low) {
    w.x = hn::Add(w.x, hn::Sub(to.low_x, from.low_x)), w.y = hn::Add(w.y, hn::Sub(to.low_y, from.low_y));
    w.z = hn::Add(w.z, hn::Sub(to.low_z, from.low_z));
  }
  return w;
}

// The ways of the springs that begin at the columns of a vector, by direction. An antidiagonal one begins a column
// further.
template <bool low, class S>
HWY_INLINE void ways(const Place<low, S>& a, const S* x0, const S* x1, const S* x2, std::ptrdiff_t st, Way<S>* out) {
  const auto right = place<low, S>(x0 + 1, st), down = place<low, S>(x1, st);
  out[kRight] = way(a, right);
  out[kRight2] = way(a, place<low, S>(x0 + 2, st));
  out[kDown] = way(a, down);
  out[kDiagonal] = way(a, place<low, S>(x1 + 1, st));
  out[kAntidiagonal] = way(right, down);
  out[kDown2] = way(a, place<low, S>(x2, st));
}

// Parameters of the springs that begin at the columns of a vector; those of a direction are a block apart.
template <class S>
struct Springs {
  const S *stiffness, *rest, *inverse;

  HWY_INLINE void go_on(int by) { stiffness += by, rest += by, inverse += by; }
};

// Forces over length by root and quotient where the series does not hold. From memory: ways that somebody else may look
// at would not stay in registers.
template <bool low, class S>
HWY_NOINLINE void scale_far(const S* x0, const S* x1, const S* x2, std::ptrdiff_t st, Springs<S> springs, S* scale) {
  const Tag<S> d;
  Way<S> w[kDirections];
  ways<low, S>(place<low, S>(x0, st), x0, x1, x2, st, w);
  for (int i = 0; i < kDirections; ++i) {
    const int at = i * kColumns<S>;
    const auto rest = hn::Load(d, springs.rest + at), l2 = squared_length(d, w[i].x, w[i].y, w[i].z);
    const auto more = hn::Sub(l2, rest), e = hn::Mul(more, hn::Load(d, springs.inverse + at));
    const auto exact = far_from_rest(d, hn::Load(d, springs.stiffness + at), more, l2, rest);
    S* to = scale + i * int(hn::MaxLanes(d));
    hn::Store(hn::IfThenElse(hn::Le(hn::Abs(e), hn::Set(d, kNear<S>)), hn::Load(d, to), exact), d, to);
  }
}

// Forces over length of the springs with these ways. All directions take the same step at once: a processor looks some
// hundred operations ahead, and would find too little to do if one spring came after the other.
template <bool low, class S>
HWY_INLINE void scale_springs(const S* x0, const S* x1, const S* x2, std::ptrdiff_t st, const Springs<S>& springs,
                              const Way<S> (&w)[kDirections], V<S> (&scale)[kDirections]) {
  const Tag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d)), kBlock = kColumns<S>;
  V<S> e[kDirections];
  for (int i = 0; i < kDirections; ++i) e[i] = hn::MulAdd(w[i].x, w[i].x, hn::Set(d, S(kTiny)));
  for (int i = 0; i < kDirections; ++i) e[i] = hn::MulAdd(w[i].y, w[i].y, e[i]);
  for (int i = 0; i < kDirections; ++i) e[i] = hn::MulAdd(w[i].z, w[i].z, e[i]);
  for (int i = 0; i < kDirections; ++i) e[i] = hn::Sub(e[i], hn::Load(d, springs.rest + i * kBlock));
  for (int i = 0; i < kDirections; ++i) e[i] = hn::Mul(e[i], hn::Load(d, springs.inverse + i * kBlock));
  near_rest(d, e, springs.stiffness, kBlock, scale);
  auto worst = hn::Zero(d);
  for (int i = 0; i < kDirections; ++i) worst = larger_size<S>(worst, e[i]);
  if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Le(worst, hn::Set(d, kNear<S>))))) {
    alignas(64) S some[kDirections * kLanes];
    for (int i = 0; i < kDirections; ++i) hn::Store(scale[i], d, some + i * kLanes);
    scale_far<low, S>(x0, x1, x2, st, springs, some);
    for (int i = 0; i < kDirections; ++i) scale[i] = hn::Load(d, some + i * kLanes);
  }
}

template <class S>
HWY_INLINE void add_to(Way<S>& sum, V<S> scale, const Way<S>& w) {
  sum.x = hn::MulAdd(scale, w.x, sum.x), sum.y = hn::MulAdd(scale, w.y, sum.y), sum.z = hn::MulAdd(scale, w.z, sum.z);
}

template <class S>
HWY_INLINE Way<S> times(V<S> scale, const Way<S>& w) {
  return {hn::Mul(scale, w.x), hn::Mul(scale, w.y), hn::Mul(scale, w.z)};
}

// What pulls at points n columns further on, on its way there from vector to vector.
template <int n, class S>
struct Carry {
  static constexpr int kVectors = n > int(hn::MaxLanes(Tag<S>())) ? n : 1;
  Way<S> before[kVectors];

  HWY_INLINE Carry() {
    const auto nothing = hn::Zero(Tag<S>());
    for (Way<S>& w : before) w = {nothing, nothing, nothing};
  }
  HWY_INLINE Way<S> pass(const Way<S>& now) {
    Way<S> out = before[0];
    if constexpr (n < int(hn::MaxLanes(Tag<S>())))
      out = {lanes_up<n, S>(out.x, now.x), lanes_up<n, S>(out.y, now.y), lanes_up<n, S>(out.z, now.z)};
    for (int i = 0; i + 1 < kVectors; ++i) before[i] = before[i + 1];
    before[kVectors - 1] = now;
    return out;
  }
};

template <class S>
HWY_INLINE Way<S> load_way(const S* from, std::ptrdiff_t st) {
  const Tag<S> d;
  return {hn::Load(d, from), hn::Load(d, from + st), hn::Load(d, from + 2 * st)};
}

template <class S>
HWY_INLINE void store_way(const Way<S>& w, S* to, std::ptrdiff_t st) {
  const Tag<S> d;
  hn::Store(w.x, d, to), hn::Store(w.y, d, to + st), hn::Store(w.z, d, to + 2 * st);
}

// One stage on the points of a vector.
template <bool pushed, bool low, class S>
HWY_INLINE void step(const Way<S>& force, const Place<low, S>& a, S kick_time, S drift_time, const S* gravity,
                     S* motion, const S* push, S* next, std::ptrdiff_t st) {
  const Tag<S> d;
  constexpr int kBlock = kColumns<S>;
  const auto w = hn::Load(d, motion + 3 * kBlock);
  const auto kick = hn::IfThenElseZero(hn::Ne(w, hn::Zero(d)), hn::Set(d, kick_time)), drift = hn::Set(d, drift_time);
  const auto move = [&](int k, V<S> f, V<S> high, [[maybe_unused]] V<S> x_low) HWY_ATTR {
    auto more = hn::Set(d, gravity[k]);
    if constexpr (pushed) more = hn::Add(more, hn::Load(d, push + k * kBlock));
    S *v_at = motion + k * kBlock, *to = next + k * st;
    const auto acceleration = hn::MulAdd(f, w, more);
    if constexpr (low) {
      S* v_low_at = v_at + 4 * kBlock;
      auto v = hn::Load(d, v_at), v_low = hn::Load(d, v_low_at);
      add_exactly<S>(v, v_low, hn::Mul(kick, acceleration));
      add_exactly<S>(high, x_low, hn::MulAdd(drift, v, hn::Mul(drift, v_low)));
      hn::Store(v, d, v_at), hn::Store(v_low, d, v_low_at);
      hn::Store(high, d, to), hn::Store(x_low, d, to + 3 * st);
    } else {
      const auto v = hn::MulAdd(kick, acceleration, hn::Load(d, v_at));
      hn::Store(v, d, v_at);
      hn::Store(hn::MulAdd(drift, v, high), d, to);
    }
  };
  move(0, force.x, a.x, a.low_x), move(1, force.y, a.y, a.low_y), move(2, force.z, a.z, a.low_z);
}

// The springs that begin in row r, and one stage on its points. Springs lead to the right and down alone, so a vector
// of columns may be stepped where it lies as soon as its springs are done; what they pull at further on is summed up on
// the way: in the row itself in registers, below it in the wake.
template <bool pushed, bool low, class S>
void row(const GridState<S>& grid, const GridWake<S>& wake, Index r, const Stage& stage) {
  const Tag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d)), kBlock = kColumns<S>, kFields = low ? 7 : 4;
  const std::ptrdiff_t st = grid.stride;
  const S kick = S(stage.kick), drift = S(stage.drift),
          gravity[3] = {grid.gravity[0], grid.gravity[1], grid.gravity[2]};
  const S *x1 = grid.position(r + 1), *x2 = grid.position(r + 2);
  S *x0 = grid.position(r), *motion = grid.motion + r * grid.blocks * kFields * kBlock;
  S *next = wake.next, *next2 = wake.next2;
  const S* push = pushed ? grid.push + r * grid.blocks * 3 * kBlock : nullptr;
  Springs<S> springs{grid.stiffness[r], grid.rest[r], grid.inverse[r]};
  Carry<1, S> one, one_down;
  Carry<2, S> two;
  for (Index block = grid.blocks; block > 0; --block) {
    for (int lane = 0; lane < kBlock; lane += kLanes) {
      const auto a = place<low, S>(x0, st);
      Way<S> w[kDirections];
      ways<low, S>(a, x0, x1, x2, st, w);
      V<S> scale[kDirections];
      scale_springs<low, S>(x0, x1, x2, st, springs, w, scale);
      const Way<S> above = load_way<S>(next, st);
      Way<S> down = load_way<S>(next2, st), up1 = times<S>(scale[kRight], w[kRight]);
      store_way<S>(times<S>(scale[kDown2], w[kDown2]), next2, st);
      add_to<S>(down, scale[kDown], w[kDown]), add_to<S>(down, scale[kAntidiagonal], w[kAntidiagonal]);
      const Way<S> diagonal = one_down.pass(times<S>(scale[kDiagonal], w[kDiagonal]));
      store_way<S>({hn::Add(down.x, diagonal.x), hn::Add(down.y, diagonal.y), hn::Add(down.z, diagonal.z)}, next, st);
      Way<S> force{hn::MulSub(scale[kRight], w[kRight].x, above.x), hn::MulSub(scale[kRight], w[kRight].y, above.y),
                   hn::MulSub(scale[kRight], w[kRight].z, above.z)};
      for (const int i : {kRight2, kDown, kDiagonal, kDown2}) add_to<S>(force, scale[i], w[i]);
      up1 = {hn::NegMulAdd(scale[kAntidiagonal], w[kAntidiagonal].x, up1.x),
             hn::NegMulAdd(scale[kAntidiagonal], w[kAntidiagonal].y, up1.y),
             hn::NegMulAdd(scale[kAntidiagonal], w[kAntidiagonal].z, up1.z)};
      const Way<S> from1 = one.pass(up1);
      const Way<S> from2 = two.pass(times<S>(scale[kRight2], w[kRight2]));
      force.x = hn::Sub(force.x, hn::Add(from1.x, from2.x)), force.y = hn::Sub(force.y, hn::Add(from1.y, from2.y));
      force.z = hn::Sub(force.z, hn::Add(from1.z, from2.z));
      step<pushed, low, S>(force, a, kick, drift, gravity, motion + lane, pushed ? push + lane : nullptr, x0, st);
      x0 += kLanes, x1 += kLanes, x2 += kLanes, next += kLanes, next2 += kLanes;
      springs.go_on(kLanes);
    }
    springs.go_on((kDirections - 1) * kBlock);
    motion += kFields * kBlock;
    if constexpr (pushed) push += 3 * kBlock;
  }
}

template <class S>
void drift_row(const GridState<S>& grid, Index r, S drift) {
  const Tag<S> d;
  constexpr int kBlock = kColumns<S>;
  const auto h = hn::Set(d, drift);
  const S* motion = grid.motion + r * grid.blocks * grid.fields() * kBlock;
  S* x = grid.position(r);
  for (Index block = 0; block < grid.blocks; ++block, motion += grid.fields() * kBlock, x += kBlock)
    for (int k = 0; k < 3; ++k)
      for (int lane = 0; lane < kBlock; lane += int(hn::MaxLanes(d))) {
        const S* v_at = motion + k * kBlock + lane;
        const std::ptrdiff_t at = k * grid.stride + lane;
        const auto v = hn::Load(d, v_at);
        auto high = hn::Load(d, x + at);
        if (grid.low) {
          const std::ptrdiff_t low_at = at + 3 * grid.stride;
          auto low = hn::Load(d, x + low_at);
          add_exactly<S>(high, low, hn::MulAdd(h, v, hn::Mul(h, hn::Load(d, v_at + 4 * kBlock))));
          hn::Store(high, d, x + at), hn::Store(low, d, x + low_at);
        } else {
          hn::Store(hn::MulAdd(h, v, high), d, x + at);
        }
      }
}

// A stage on row r, after those above it.
template <class S>
void row(const GridState<S>& grid, const GridWake<S>& wake, Index r, const Stage& stage) {
  if (stage.kick == 0) return drift_row(grid, r, S(stage.drift));
  if constexpr (sizeof(S) == 4) {
    if (grid.low)
      return grid.push ? row<true, true, S>(grid, wake, r, stage) : row<false, true, S>(grid, wake, r, stage);
  }
  grid.push ? row<true, false, S>(grid, wake, r, stage) : row<false, false, S>(grid, wake, r, stage);
}

// Nothing pulls on the first row from above.
template <class S>
void begin_wake(const GridState<S>& grid, const GridWake<S>& wake) {
  std::fill_n(wake.next, 3 * grid.stride, S(0));
  std::fill_n(wake.next2, 3 * grid.stride, S(0));
}

// A stage needs two rows below the one it steps, so the next stage may follow two rows behind.
template <class S>
void run_together(const GridState<S>& grid, std::span<const Stage> stages) {
  while (!stages.empty()) {
    const std::size_t together = std::min(grid.together, stages.size());
    for (std::size_t i = 0; i < together; ++i) begin_wake(grid, grid.wakes[i]);
    for (Index front = 0; front < grid.rows + 2 * Index(together - 1); ++front)
      for (std::size_t i = 0; i < together; ++i) {
        const Index r = front - 2 * Index(i);
        if (r < 0 || r >= grid.rows) continue;
        row(grid, grid.wakes[i], r, stages[i]);
      }
    stages = stages.subspan(together);
  }
}

// Rows [first, last) of one band. A stage goes from band to band with its wake, so each band is a stage ahead of the
// one below, which has stepped its first rows long before the band above comes to need them: the same order, and the
// same bits, as in one pass over all rows after the other. A band is never three stages ahead, so two wakes a band are
// enough.
template <class S>
void run_band(const GridState<S>& grid, std::span<const Stage> stages, int b) {
  const Index first = grid.first(b), last = grid.first(b + 1);
  const bool above = b > 0, below = b + 1 < grid.bands;
  GridBand& own = grid.band[b];
  for (int i = 0; i < int(stages.size()); ++i) {
    const GridWake<S>& wake = grid.wakes[std::size_t(i) % grid.wakes.size()];
    if (above)
      wait_for(grid.band[b - 1].done, i + 1);
    else
      begin_wake(grid, wake);
    for (Index r = first; r < last; ++r) {
      if (below && r == last - 2) wait_for(grid.band[b + 1].ready, i);
      row(grid, wake, r, stages[std::size_t(i)]);
      if (r == first + 1) own.ready.store(i + 1, std::memory_order_release);
    }
    own.done.store(i + 1, std::memory_order_release);
  }
}

template <class S>
void run_grid(const GridState<S>& grid, std::span<const Stage> stages, int b) {
  if (grid.bands == 1)
    run_together(grid, stages);
  else
    run_band(grid, stages, b);
}

void run_grid_float(const GridState<float>& grid, std::span<const Stage> stages, int b) { run_grid(grid, stages, b); }
void run_grid_double(const GridState<double>& grid, std::span<const Stage> stages, int b) { run_grid(grid, stages, b); }

void squares_float(Index n, const float* d3, float* out) { squared_lengths(n, d3, out); }
void squares_double(Index n, const double* d3, double* out) { squared_lengths(n, d3, out); }

}  // namespace hooke::softbody::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hooke::softbody {

namespace {

HWY_EXPORT(run_grid_float);
HWY_EXPORT(run_grid_double);
HWY_EXPORT(squares_float);
HWY_EXPORT(squares_double);

// Grids of more bytes than this leave a core's own caches: stages then run down the rows together.
constexpr std::size_t kCacheBytes = std::size_t(2) << 20;
constexpr std::size_t kTogether = 4;
// Bands of fewer points do not pay for waiting for each other.
constexpr Index kBandPoints = 1500, kBandRows = 8;

// O is the body's scalar, S the kernel's. A body in double that is stepped in float has two of them a value; one in
// float that is stepped in double has its low parts added.
template <class O, class S>
class GridStepper final : public Stepper<O> {
 public:
  GridStepper(const SpringNetwork& network, const SpringGrid& grid, const Points<O>& start) : columns_(grid.columns) {
    state_.low = kLow;
    state_.rows = grid.rows;
    state_.blocks = (grid.columns + kBlock - 1) / kBlock;
    state_.stride = (state_.blocks + 2) * kBlock;
    x_.resize(std::size_t((grid.rows + 2) * state_.planes() * state_.stride));
    motion_.resize(std::size_t(grid.rows * state_.blocks * state_.fields() * kBlock));
    state_.x = x_.data(), state_.motion = motion_.data();
    make_springs(network, grid, start);
    const std::size_t bytes = sizeof(S) * std::size_t(grid.rows * state_.blocks * kBlock) * 19;
    state_.together = bytes > kCacheBytes ? kTogether : 1;
    make_wakes(state_.together);
  }

  void load(const PointMasses<O>& points, const LowParts<O>& low, const Vec3& gravity, const Points<O>* push) override {
    for (int k = 0; k < 3; ++k) state_.gravity[k] = S(gravity[k]);
    if (push && push_.empty()) push_.resize(std::size_t(state_.rows * state_.blocks * 3 * kBlock));
    state_.push = push ? push_.data() : nullptr;
    const int fields = state_.fields();
    for (Index r = 0; r < state_.rows; ++r) {
      for (int k = 0; k < 3; ++k) {
        const O *x = &points.position(r * columns_, k), *v = &points.velocity(r * columns_, k);
        S* to = state_.position(r) + k * state_.stride;
        std::transform(x, x + columns_, to, [](O value) { return S(value); });
        to_blocks(v, r, fields, k, state_.motion, [](O value) { return S(value); });
        if (push) to_blocks(&(*push)(r * columns_, k), r, 3, k, push_.data(), [](O value) { return S(value); });
        if (!kLow) continue;
        const auto rest = [](O value) { return S(value - O(S(value))); };
        std::transform(x, x + columns_, to + 3 * state_.stride, rest);
        to_blocks(v, r, fields, 4 + k, state_.motion, rest);
      }
      to_blocks(&points.inverse_mass[r * columns_], r, fields, 3, state_.motion, [](O value) { return S(value); });
      clear_padding(r);
    }
    if constexpr (kWide) add_low(low);
  }

  void run(std::span<const Stage> stages, Gang* gang) override {
    const Index room = std::min(state_.rows / kBandRows, state_.rows * columns_ / kBandPoints);
    state_.bands = gang ? int(std::clamp<Index>(room, 1, gang->size())) : 1;
    if (state_.bands == 1) {
      run_one(stages, 0);
      return;
    }
    if (2 * std::size_t(state_.bands) > wakes_.size()) make_wakes(2 * std::size_t(state_.bands));
    if (bands_.size() < std::size_t(state_.bands)) bands_ = std::vector<GridBand>(std::size_t(state_.bands));
    state_.band = bands_.data();
    for (GridBand& band : bands_) band.ready = 0, band.done = 0;
    gang->run([&](int b) {
      if (b < state_.bands) run_one(stages, b);
    });
  }

  void store(PointMasses<O>& points, LowParts<O>& low_parts) const override {
    const int fields = state_.fields();
    if constexpr (kWide) low_parts.position.resize(points.size(), 3), low_parts.velocity.resize(points.size(), 3);
    for (Index r = 0; r < state_.rows; ++r)
      for (int k = 0; k < 3; ++k) {
        O *x = &points.position(r * columns_, k), *v = &points.velocity(r * columns_, k);
        const S* from = state_.position(r) + k * state_.stride;
        by_blocks([&](Index c, auto n) {
          const S *high = from + c, *low = high + 3 * state_.stride;
          const S *v_high = state_.motion + at(r, c, fields, k), *v_low = v_high + 4 * kBlock;
          for (Index i = 0; i < n; ++i) {
            x[c + i] = kLow ? O(high[i]) + O(low[i]) : O(high[i]);
            v[c + i] = kLow ? O(v_high[i]) + O(v_low[i]) : O(v_high[i]);
            if constexpr (kWide) {
              low_parts.position(r * columns_ + c + i, k) = O(high[i] - S(x[c + i]));
              low_parts.velocity(r * columns_ + c + i, k) = O(v_high[i] - S(v[c + i]));
            }
          }
        });
      }
  }

  std::string_view precision() const override {
    return kLow ? "double-float" : std::is_same_v<O, float> ? "float" : "double";
  }

 private:
  static constexpr int kBlock = kColumns<S>;
  static constexpr bool kLow = sizeof(O) > sizeof(S), kWide = sizeof(O) < sizeof(S);
  static constexpr S kRounding =
      kWide ? S(std::numeric_limits<O>::epsilon()) : std::numeric_limits<S>::epsilon();  // of places

  // Columns behind the last one are stepped, too: what a blow-up has left there would never go away.
  void clear_padding(Index r) {
    const Index end = state_.blocks * kBlock;
    for (int k = 0; k < state_.planes(); ++k)
      std::fill(state_.position(r) + k * state_.stride + columns_, state_.position(r) + k * state_.stride + end, S(0));
    for (int field = 0; field < state_.fields(); ++field)
      for (Index c = columns_; c < end; ++c) state_.motion[at(r, c, state_.fields(), field)] = S(0);
  }

  void add_low(const LowParts<O>& low) {
    for (Index r = 0; r < state_.rows && low.position.rows() > 0; ++r)
      for (int k = 0; k < 3; ++k)
        for (Index c = 0; c < columns_; ++c)
          state_.position(r)[k * state_.stride + c] += low.position(r * columns_ + c, k);
    for (Index r = 0; r < state_.rows && low.velocity.rows() > 0; ++r)
      for (int k = 0; k < 3; ++k)
        for (Index c = 0; c < columns_; ++c)
          state_.motion[at(r, c, state_.fields(), k)] += low.velocity(r * columns_ + c, k);
  }

  void run_one(std::span<const Stage> stages, int b) {
    if constexpr (std::is_same_v<S, float>)
      HWY_DYNAMIC_DISPATCH(run_grid_float)(state_, stages, b);
    else
      HWY_DYNAMIC_DISPATCH(run_grid_double)(state_, stages, b);
  }

  void make_wakes(std::size_t n) {
    wakes_.resize(n);
    const std::ptrdiff_t one = 3 * state_.stride;
    rings_.resize(n * std::size_t(2 * one));
    for (std::size_t i = 0; i < n; ++i) {
      wakes_[i].next = rings_.data() + std::ptrdiff_t(2 * i) * one;
      wakes_[i].next2 = wakes_[i].next + one;
    }
    state_.wakes = wakes_;
  }

  // Of a value of a point, in rows of blocks of so many fields.
  Index at(Index r, Index c, int fields, int field) const {
    return ((r * state_.blocks + c / kBlock) * fields + field) * kBlock + c % kBlock;
  }

  template <class Convert>
  void to_blocks(const O* from, Index r, int fields, int field, S* to, Convert convert) const {
    by_blocks([&](Index c, auto n) {
      S* block = to + at(r, c, fields, field);
      for (Index i = 0; i < n; ++i) block[i] = convert(from[c + i]);
    });
  }

  // action(c, n) for every block of n columns from c on. All but the last have a length that compilers know.
  template <class Action>
  void by_blocks(const Action& action) const {
    Index c = 0;
    for (; c + kBlock <= columns_; c += kBlock) action(c, std::integral_constant<Index, kBlock>());
    if (c < columns_) action(c, columns_ - c);
  }

  // As the kernel takes it.
  static S difference_of(O a, O b) {
    const S high = S(b) - S(a);
    return kLow ? high + (S(b - O(S(b))) - S(a - O(S(a)))) : high;
  }

  // Rows of parameters, each different one kept once.
  void make_springs(const SpringNetwork& network, const SpringGrid& grid, const Points<O>& start) {
    const Index width = state_.blocks * kBlock;
    std::vector<S> difference(std::size_t(3 * width)), square(static_cast<std::size_t>(width));
    std::map<std::vector<S>, std::vector<Index>> stiffness_rows, rest_rows, inverse_rows;
    std::vector<S> above;
    for (Index r = 0; r < grid.rows; ++r) {
      std::vector<S> stiffness(std::size_t(6 * width), S(0)), rest(std::size_t(6 * width), S(1)), inverse = stiffness;
      for (int direction = 0; direction < kDirections; ++direction) {
        std::fill(difference.begin(), difference.end(), S(1));
        for (Index c = 0; c < columns_; ++c) {
          const int index = grid.springs[std::size_t(direction)][std::size_t(r * columns_ + c)];
          if (index < 0) continue;
          const Spring& spring = network.springs[std::size_t(index)];
          stiffness[std::size_t(at(0, c, 6, direction))] = S(O(spring.stiffness));
          for (int k = 0; k < 3; ++k)
            difference[std::size_t(k * width + c)] = spring.rest_length == Spring::kFromStart
                                                         ? difference_of(start(spring.a, k), start(spring.b, k))
                                                         : S(O(k == 0 ? spring.rest_length : 0));
        }
        if constexpr (std::is_same_v<S, float>)
          HWY_DYNAMIC_DISPATCH(squares_float)(width, difference.data(), square.data());
        else
          HWY_DYNAMIC_DISPATCH(squares_double)(width, difference.data(), square.data());
        for (Index c = 0; c < width; ++c) {
          inverse[std::size_t(at(0, c, 6, direction))] =
              stiffness[std::size_t(at(0, c, 6, direction))] == 0 ? 0 : 1 / square[std::size_t(c)];
          rest[std::size_t(at(0, c, 6, direction))] = square[std::size_t(c)];
        }
      }
      // Where two rows differ by the rounding of positions alone, one serves both: half of that is its share in the
      // stiffness, and nothing at rest, which the squares tell.
      if (!above.empty() && std::equal(inverse.begin(), inverse.end(), above.begin(),
                                       [](S a, S b) { return std::abs(a - b) <= S(256) * kRounding * a; }))
        inverse = above;
      else
        above = inverse;
      stiffness_rows[std::move(stiffness)].push_back(r);
      rest_rows[std::move(rest)].push_back(r);
      inverse_rows[std::move(inverse)].push_back(r);
    }
    const auto lay = [&](const auto& rows, Lines<S>& memory, std::vector<const S*>& row) {
      row.resize(std::size_t(grid.rows));
      memory.resize(rows.size() * rows.begin()->first.size());
      S* place = memory.data();
      for (const auto& [values, where] : rows) {
        std::copy(values.begin(), values.end(), place);
        for (const Index r : where) row[std::size_t(r)] = place;
        place += values.size();
      }
    };
    lay(stiffness_rows, stiffness_, stiffness_row_);
    lay(rest_rows, rest_, rest_row_);
    lay(inverse_rows, inverse_, inverse_row_);
    state_.stiffness = stiffness_row_.data(), state_.rest = rest_row_.data(), state_.inverse = inverse_row_.data();
  }

  Index columns_;
  GridState<S> state_{};
  Lines<S> x_, motion_, push_, stiffness_, rest_, inverse_, rings_;
  std::vector<const S*> stiffness_row_, rest_row_, inverse_row_;
  std::vector<GridWake<S>> wakes_;
  std::vector<GridBand> bands_;
};

}  // namespace

template <class S>
std::unique_ptr<Stepper<S>> make_grid_stepper(const SpringNetwork& network, const SpringGrid& grid,
                                              const Points<S>& start) {
  return std::make_unique<GridStepper<S, S>>(network, grid, start);
}

std::unique_ptr<Stepper<double>> make_two_float_grid_stepper(const SpringNetwork& network, const SpringGrid& grid,
                                                             const Points<double>& start) {
  return std::make_unique<GridStepper<double, float>>(network, grid, start);
}

std::unique_ptr<Stepper<float>> make_fine_grid_stepper(const SpringNetwork& network, const SpringGrid& grid,
                                                       const Points<float>& start) {
  return std::make_unique<GridStepper<float, double>>(network, grid, start);
}

template std::unique_ptr<Stepper<float>> make_grid_stepper(const SpringNetwork&, const SpringGrid&,
                                                           const Points<float>&);
template std::unique_ptr<Stepper<double>> make_grid_stepper(const SpringNetwork&, const SpringGrid&,
                                                            const Points<double>&);

}  // namespace hooke::softbody
#endif  // HWY_ONCE
