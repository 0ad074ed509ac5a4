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

// Stages whose old rows a band has seen, and those it has finished.
struct alignas(64) GridBand {
  std::atomic<int> ready{0};
  alignas(64) std::atomic<int> done{0};
};

// What a stage keeps of the rows it has seen: old positions, and force over length of the springs that begin there.
template <class S>
struct GridWake {
  S* near;  // by row, of the last two: five directions
  S* far;   // by row, of the last four: springs that skip a row
  S* old;   // by row, of the last four
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
  S* halo;  // by band: its first two rows as they were before the stage

  Index first(int b) const { return rows * b / bands; }
  int planes() const { return low ? 6 : 3; }
  int fields() const { return low ? 7 : 4; }
  S* edge(int b, int row) const { return halo + (b * 2 + row) * planes() * stride + kColumns<S>; }
  S* position(Index row) const { return x + row * planes() * stride + kColumns<S>; }
  S* old(const GridWake<S>& wake, Index row) const { return wake.old + (row & 3) * planes() * stride + kColumns<S>; }
  S* near(const GridWake<S>& wake, Index row) const { return wake.near + (row & 1) * 5 * stride + kColumns<S>; }
  S* far(const GridWake<S>& wake, Index row) const { return wake.far + (row & 3) * stride + kColumns<S>; }
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
  a.x = hn::Load(d, x), a.y = hn::Load(d, x + st), a.z = hn::Load(d, x + 2 * st);
  if constexpr (low)
    a.low_x = hn::Load(d, x + 3 * st), a.low_y = hn::Load(d, x + 4 * st), a.low_z = hn::Load(d, x + 5 * st);
  return a;
}

// From `to` to a: the other way round it costs loads of their own.
template <bool low, class S>
HWY_INLINE void difference(const Place<low, S>& a, const S* to, std::ptrdiff_t st, V<S>& x, V<S>& y, V<S>& z) {
  const Tag<S> d;
  x = hn::Sub(a.x, hn::LoadU(d, to)), y = hn::Sub(a.y, hn::LoadU(d, to + st));
  z = hn::Sub(a.z, hn::LoadU(d, to + 2 * st));
  if constexpr (low) {
    x = hn::Add(x, hn::Sub(a.low_x, hn::LoadU(d, to + 3 * st)));
    y = hn::Add(y, hn::Sub(a.low_y, hn::LoadU(d, to + 4 * st)));
    z = hn::Add(z, hn::Sub(a.low_z, hn::LoadU(d, to + 5 * st)));
  }
}

// The springs that begin in a row by direction: where they lead to, and where their forces over length go.
template <class S>
struct Row {
  const S* x;
  const S* to[kDirections];
  S* scale[kDirections];
};

template <class S>
HWY_INLINE Row<S> row_of(const GridState<S>& grid, const GridWake<S>& wake, Index r, const S* x1, const S* x2) {
  const S* x = grid.position(r);
  S* near = grid.near(wake, r);
  const std::ptrdiff_t st = grid.stride;
  return {x,
          {x + 1, x + 2, x1, x1 + 1, x1 - 1, x2},
          {near, near + st, near + 2 * st, near + 3 * st, near + 4 * st, grid.far(wake, r)}};
}

// Puts right those of a block of columns that the series does not hold for.
template <bool low, class S>
HWY_NOINLINE void scale_far(const GridState<S>& grid, const Row<S>& row, Index r, Index block) {
  const Tag<S> d;
  constexpr int kBlock = kColumns<S>;
  for (int lane = 0; lane < kBlock; lane += int(hn::MaxLanes(d))) {
    const Index c = block * kBlock + lane;
    const auto a = place<low, S>(row.x + c, grid.stride);
    for (int i = 0; i < kDirections; ++i) {
      V<S> x, y, z;
      difference<low, S>(a, row.to[i] + c, grid.stride, x, y, z);
      const Index at = (block * 6 + i) * kBlock + lane;
      const auto rest = hn::Load(d, grid.rest[r] + at), l2 = squared_length(d, x, y, z), more = hn::Sub(l2, rest);
      const auto e = hn::Mul(more, hn::Load(d, grid.inverse[r] + at));
      const auto near = hn::Le(hn::Abs(e), hn::Set(d, kNear<S>));
      const auto exact = far_from_rest(d, hn::Load(d, grid.stiffness[r] + at), more, l2, rest);
      S* scale = row.scale[i] + c;
      hn::Store(hn::IfThenElse(near, hn::Load(d, scale), exact), d, scale);
    }
  }
}

// Force over length of the springs that begin in row r. In two loops, the deviations l²/L² - 1 first: processors do not
// look far enough ahead to work on so many springs at once that their latencies would not show.
template <bool low, class S>
void scale_row(const GridState<S>& grid, const GridWake<S>& wake, Index r, const Row<S>& row) {
  const Tag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d)), kBlock = kColumns<S>;
  const std::ptrdiff_t st = grid.stride;
  S* HWY_RESTRICT old = grid.old(wake, r);
  const S *stiffness = grid.stiffness[r], *rest = grid.rest[r], *inverse = grid.inverse[r];
  for (Index block = 0; block < grid.blocks; ++block)
    for (int lane = 0; lane < kBlock; lane += kLanes) {
      const Index c = block * kBlock + lane, at = block * 6 * kBlock + lane;
      const auto a = place<low, S>(row.x + c, st);
      hn::Store(a.x, d, old + c), hn::Store(a.y, d, old + st + c), hn::Store(a.z, d, old + 2 * st + c);
      if constexpr (low) {
        S* old_low = old + 3 * st + c;
        hn::Store(a.low_x, d, old_low), hn::Store(a.low_y, d, old_low + st), hn::Store(a.low_z, d, old_low + 2 * st);
      }
      for (int i = 0; i < kDirections; ++i) {
        V<S> dx, dy, dz;
        difference<low, S>(a, row.to[i] + c, st, dx, dy, dz);
        const auto more = hn::Sub(squared_length(d, dx, dy, dz), hn::Load(d, rest + at + i * kBlock));
        hn::Store(hn::Mul(more, hn::Load(d, inverse + at + i * kBlock)), d, row.scale[i] + c);
      }
    }
  for (Index block = 0; block < grid.blocks; ++block) {
    auto worst = hn::Zero(d);
    for (int i = 0; i < kDirections; ++i)
      for (int lane = 0; lane < kBlock; lane += kLanes) {
        S* scale = row.scale[i] + block * kBlock + lane;
        const auto e = hn::Load(d, scale);
        worst = hn::Max(worst, hn::Abs(e));
        hn::Store(hn::Mul(hn::Mul(hn::Load(d, stiffness + (block * 6 + i) * kBlock + lane), e), near_rest(d, e)), d,
                  scale);
      }
    if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Le(worst, hn::Set(d, kNear<S>))))) scale_far<low, S>(grid, row, r, block);
  }
}

// One stage on the points of row r, after the springs that begin in it.
template <bool pushed, bool low, class S>
void step_row(const GridState<S>& grid, const GridWake<S>& wake, Index r, const Stage& stage, const Row<S>& row) {
  const Tag<S> d;
  constexpr int kLanes = int(hn::MaxLanes(d)), kBlock = kColumns<S>, kFields = low ? 7 : 4;
  const std::ptrdiff_t st = grid.stride;
  const auto kick = hn::Set(d, S(stage.kick)), drift = hn::Set(d, S(stage.drift));
  const auto gx = hn::Set(d, grid.gravity[0]), gy = hn::Set(d, grid.gravity[1]), gz = hn::Set(d, grid.gravity[2]);
  const S *s0 = grid.near(wake, r), *s1 = grid.near(wake, r - 1), *far = grid.far(wake, r),
          *far2 = grid.far(wake, r - 2);
  const S *x0 = grid.old(wake, r), *x1 = row.to[kDown], *x2 = row.to[kDown2], *u1 = grid.old(wake, r - 1),
          *u2 = grid.old(wake, r - 2);
  S* HWY_RESTRICT next = grid.position(r);
  S* HWY_RESTRICT motion = grid.motion + r * grid.blocks * kFields * kBlock;
  const S* push = pushed ? grid.push + r * grid.blocks * 3 * kBlock : nullptr;
  for (Index block = 0; block < grid.blocks; ++block) {
    for (int lane = 0; lane < kBlock; lane += kLanes) {
      const auto a = place<low, S>(x0, st);
      // Three sums that do not wait for each other: from above, along the row, from below.
      V<S> fx, fy, fz;
      const auto pull = [&](const S* to, const S* scale) HWY_ATTR {
        const auto s = hn::LoadU(d, scale);
        V<S> x, y, z;
        difference<low, S>(a, to, st, x, y, z);
        fx = hn::NegMulAdd(s, x, fx), fy = hn::NegMulAdd(s, y, fy), fz = hn::NegMulAdd(s, z, fz);
      };
      fx = hn::Zero(d), fy = fx, fz = fx;
      pull(u2, far2), pull(u1, s1 + kDown * st);
      pull(u1 - 1, s1 + kDiagonal * st - 1), pull(u1 + 1, s1 + kAntidiagonal * st + 1);
      auto sx = fx, sy = fy, sz = fz;
      fx = hn::Zero(d), fy = fx, fz = fx;
      pull(x0 - 2, s0 + kRight2 * st - 2), pull(x0 - 1, s0 - 1), pull(x0 + 1, s0), pull(x0 + 2, s0 + kRight2 * st);
      sx = hn::Add(sx, fx), sy = hn::Add(sy, fy), sz = hn::Add(sz, fz);
      fx = hn::Zero(d), fy = fx, fz = fx;
      pull(x1 - 1, s0 + kAntidiagonal * st), pull(x1 + 1, s0 + kDiagonal * st), pull(x1, s0 + kDown * st);
      pull(x2, far);
      fx = hn::Add(sx, fx), fy = hn::Add(sy, fy), fz = hn::Add(sz, fz);
      const auto w = hn::Load(d, motion + 3 * kBlock + lane);
      const auto free = hn::Ne(w, hn::Zero(d));
      const auto step = [&](int k, V<S> f, V<S> g, V<S> high, [[maybe_unused]] V<S> x_low) HWY_ATTR {
        auto more = hn::IfThenElseZero(free, g);
        if constexpr (pushed) more = hn::Add(more, hn::Load(d, push + k * kBlock + lane));
        S *v_at = motion + k * kBlock + lane, *to = next + k * st;
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
      step(0, fx, gx, a.x, a.low_x), step(1, fy, gy, a.y, a.low_y), step(2, fz, gz, a.z, a.low_z);
      x0 += kLanes, x1 += kLanes, x2 += kLanes, u1 += kLanes, u2 += kLanes, next += kLanes;
      s0 += kLanes, s1 += kLanes, far += kLanes, far2 += kLanes;
    }
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

template <bool low, class S>
void row(const GridState<S>& grid, const GridWake<S>& wake, Index r, const Stage* stage, const S* x1, const S* x2) {
  const Row<S> row = row_of(grid, wake, r, x1, x2);
  scale_row<low, S>(grid, wake, r, row);
  if (!stage) return;
  if (grid.push)
    step_row<true, low, S>(grid, wake, r, *stage, row);
  else
    step_row<false, low, S>(grid, wake, r, *stage, row);
}

// A stage on row r, with the two below it; without one, no more than its springs.
template <class S>
void row(const GridState<S>& grid, const GridWake<S>& wake, Index r, const Stage* stage, const S* x1, const S* x2) {
  if constexpr (sizeof(S) == 4) {
    if (grid.low) return row<true, S>(grid, wake, r, stage, x1, x2);
  }
  row<false, S>(grid, wake, r, stage, x1, x2);
}

// Nothing pulls on the first row from above.
template <class S>
void begin_wake(const GridState<S>& grid, const GridWake<S>& wake) {
  std::fill_n(grid.near(wake, -1) - kColumns<S>, 5 * grid.stride, S(0));
  for (Index r = -2; r < 0; ++r) {
    std::fill_n(grid.far(wake, r) - kColumns<S>, grid.stride, S(0));
    std::fill_n(grid.old(wake, r) - kColumns<S>, grid.planes() * grid.stride, S(0));
  }
}

// A stage needs two rows ahead of the one it steps, so the next stage may follow three rows behind.
template <class S>
void run_together(const GridState<S>& grid, std::span<const Stage> stages) {
  while (!stages.empty()) {
    const std::size_t together = std::min(grid.together, stages.size());
    for (std::size_t i = 0; i < together; ++i) begin_wake(grid, grid.wakes[i]);
    for (Index front = 0; front < grid.rows + 3 * Index(together - 1); ++front)
      for (std::size_t i = 0; i < together; ++i) {
        const Index r = front - 3 * Index(i);
        if (r < 0 || r >= grid.rows) continue;
        if (stages[i].kick == 0)
          drift_row(grid, r, S(stages[i].drift));
        else
          row(grid, grid.wakes[i], r, &stages[i], grid.position(r + 1), grid.position(r + 2));
      }
    stages = stages.subspan(together);
  }
}

// Rows [first, last) of one band. Springs that cross its upper edge are worked on twice, by both bands, from
// the same old positions: the same bits as in one pass over all rows. Before the band below steps
// its first rows it keeps their old positions for us; before we step our last rows it has used them.
template <class S>
void run_band(const GridState<S>& grid, std::span<const Stage> stages, int b) {
  const Index first = grid.first(b), last = grid.first(b + 1);
  const bool above = b > 0, below = b + 1 < grid.bands;
  const GridWake<S>& wake = grid.wakes[std::size_t(b)];
  GridBand& own = grid.band[b];
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const Stage& stage = stages[i];
    if (stage.kick == 0) {
      for (Index r = first; r < last; ++r) drift_row(grid, r, S(stage.drift));
      own.ready.store(int(i) + 1, std::memory_order_release);
      own.done.store(int(i) + 1, std::memory_order_release);
      continue;
    }
    if (above) {
      wait_for(grid.band[b - 1].done, int(i));
      for (int k = 0; k < 2; ++k)
        std::copy_n(grid.position(first + k) - kColumns<S>, grid.planes() * grid.stride, grid.edge(b, k) - kColumns<S>);
      for (Index r = first - 2; r < first; ++r)
        row<S>(grid, wake, r, nullptr, grid.position(r + 1), grid.position(r + 2));
    } else {
      begin_wake(grid, wake);
    }
    own.ready.store(int(i) + 1, std::memory_order_release);
    for (Index r = first; r < last; ++r) {
      const auto under = [&](Index row) HWY_ATTR {
        return below && row >= last ? grid.edge(b + 1, int(row - last)) : grid.position(row);
      };
      if (below && r == last - 2) wait_for(grid.band[b + 1].ready, int(i) + 1);
      row(grid, wake, r, &stage, under(r + 1), under(r + 2));
    }
    own.done.store(int(i) + 1, std::memory_order_release);
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
// Bands of fewer points do not pay for their edges.
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
    if (std::size_t(state_.bands) > wakes_.size()) make_wakes(std::size_t(state_.bands));
    if (bands_.size() < std::size_t(state_.bands)) {
      bands_ = std::vector<GridBand>(std::size_t(state_.bands));
      halo_.resize(std::size_t(state_.bands * 2 * state_.planes() * state_.stride));
    }
    state_.band = bands_.data(), state_.halo = halo_.data();
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
        for (Index c = 0; c < columns_; c += kBlock) {
          const Index n = std::min<Index>(kBlock, columns_ - c);
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
        }
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
    const std::ptrdiff_t near = 2 * 5 * state_.stride, far = 4 * state_.stride,
                         one = near + far + 4 * state_.planes() * state_.stride;
    rings_.resize(n * std::size_t(one));
    for (std::size_t i = 0; i < n; ++i) {
      wakes_[i].near = rings_.data() + std::ptrdiff_t(i) * one;
      wakes_[i].far = wakes_[i].near + near;
      wakes_[i].old = wakes_[i].far + far;
    }
    state_.wakes = wakes_;
  }

  // Of a value of a point, in rows of blocks of so many fields.
  Index at(Index r, Index c, int fields, int field) const {
    return ((r * state_.blocks + c / kBlock) * fields + field) * kBlock + c % kBlock;
  }

  template <class Convert>
  void to_blocks(const O* from, Index r, int fields, int field, S* to, Convert convert) const {
    for (Index c = 0; c < columns_; c += kBlock)
      std::transform(from + c, from + std::min(c + kBlock, columns_), to + at(r, c, fields, field), convert);
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
          // An antidiagonal spring is worked on with its upper end, which is one column further.
          const Index point = r * columns_ + c - (direction == kAntidiagonal);
          if (point < r * columns_) continue;
          const int index = grid.springs[std::size_t(direction)][std::size_t(point)];
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
  Lines<S> x_, motion_, push_, stiffness_, rest_, inverse_, rings_, halo_;
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
