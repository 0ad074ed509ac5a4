#include <hooke/softbody/spring_field.hpp>

#include <hooke/softbody/kernels.hpp>
#if HOOKE_HAS_HIGHWAY
#include <hooke/softbody/grid_order.hpp>
#include <hooke/softbody/grid_stepper.hpp>
#include <hooke/softbody/mesh_stepper.hpp>
#endif

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace hooke::softbody {

namespace {

// Shorter runs do not pay for themselves.
constexpr Index kShortestRun = 8;
// A gap of so few springs in a run, as at the end of a grid's row, is bridged by springs without stiffness.
constexpr int kLongestGap = 2;

template <class S>
struct Unit {
  Eigen::Matrix<S, 3, 1> n;
  S length;
};

template <class S>
Unit<S> direction(const Points<S>& x, int a, int b) {
  const Eigen::Matrix<S, 3, 1> d = (x.row(b) - x.row(a)).matrix().transpose();
  const S l = d.norm();
  if (!(l > S(0))) return {Eigen::Matrix<S, 3, 1>::Zero(), S(0)};
  return {d / l, l};
}

// Share of the stiffness that acts across the spring: 1 - L / l.
template <class S>
S across(const Unit<S>& unit, S rest) {
  return unit.length > S(0) ? 1 - rest / unit.length : S(0);
}

}  // namespace

template <class S>
SpringField<S>::SpringField(std::shared_ptr<const SpringNetwork> network, const Points<S>& start, bool two_floats)
    : network_(std::move(network)), start_(start), two_floats_(two_floats) {
  network_->check(start.rows());
  const auto& springs = network_->springs;
  std::vector<std::size_t> order(springs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    const Spring &s = springs[i], &t = springs[j];
    return std::tuple(s.b - s.a, s.a) < std::tuple(t.b - t.a, t.a);
  });
  // Runs first, the rest behind them. A bridge is a spring that pulls nothing.
  std::vector<Spring> loose, sorted;
  for (std::size_t i = 0; i < order.size();) {
    std::vector<Spring> run{springs[order[i]]};
    std::size_t end = i + 1;
    for (; end < order.size(); ++end) {
      const Spring& next = springs[order[end]];
      const int gap = next.a - run.back().a - 1;
      if (next.b - next.a != run.back().b - run.back().a || gap < 0 || gap > kLongestGap) break;
      for (int k = 0; k < gap; ++k) run.push_back({run.back().a + 1, run.back().b + 1, 0, 0, 1});
      run.push_back(next);
    }
    if (Index(run.size()) >= kShortestRun) {
      runs_.push_back({Index(sorted.size()), Index(run.size()), run[0].a, run[0].b});
      sorted.insert(sorted.end(), run.begin(), run.end());
    } else {
      for (; i < end; ++i) loose.push_back(springs[order[i]]);
    }
    i = end;
  }
  loose_ = Index(sorted.size());
  sorted.insert(sorted.end(), loose.begin(), loose.end());

  const Index n = Index(sorted.size());
  stiffness_.resize(n), rest_.resize(n), rest_squared_.resize(n), fine_rest_squared_.resize(n), damping_.resize(n);
  a_.resize(sorted.size()), b_.resize(sorted.size());
  for (Index i = 0; i < n; ++i) {
    const Spring& s = sorted[std::size_t(i)];
    a_[std::size_t(i)] = s.a, b_[std::size_t(i)] = s.b;
    stiffness_[i] = S(s.stiffness), damping_[i] = S(s.damping);
    damped_ = damped_ || s.damping > 0;
    if (s.rest_length == Spring::kFromStart) {
      // The same operations in the same order as the kernel's.
      const S dx = start(s.b, 0) - start(s.a, 0), dy = start(s.b, 1) - start(s.a, 1),
              dz = start(s.b, 2) - start(s.a, 2);
      rest_squared_[i] = dx * dx + dy * dy + dz * dz;
      rest_[i] = std::sqrt(rest_squared_[i]);
      const double x = double(start(s.b, 0)) - double(start(s.a, 0)), y = double(start(s.b, 1)) - double(start(s.a, 1)),
                   z = double(start(s.b, 2)) - double(start(s.a, 2));
      fine_rest_squared_[i] = x * x + y * y + z * z;
    } else {
      rest_[i] = S(s.rest_length);
      rest_squared_[i] = rest_[i] * rest_[i];
      fine_rest_squared_[i] = double(rest_[i]) * double(rest_[i]);
    }
  }
}

template <class S>
void SpringField<S>::add_force(const Points<S>& x, const Points<S>& v, double, Points<S>& f) const {
  add_forces(x, nullptr, v, f);
}

template <class S>
void SpringField<S>::add_fine_force(const Points<S>& x, const Points<S>& low, const Points<S>& v, double,
                                    Points<S>& f) const {
  add_forces(x, &low, v, f);
}

template <class S>
void SpringField<S>::add_forces(const Points<S>& x, const Points<S>* low, const Points<S>& v, Points<S>& f) const {
  SpringBlock<S> block;
  for (int k = 0; k < 3; ++k) block.low_a[k] = block.low_b[k] = nullptr;
  const auto parameters = [&](Index first, int n) {
    block.n = n;
    block.stiffness = stiffness_.data() + first;
    block.rest = rest_.data() + first;
    block.rest_squared = rest_squared_.data() + first;
    block.fine_rest_squared = fine_rest_squared_.data() + first;
    block.damping = damped_ ? damping_.data() + first : nullptr;
  };
  for (const Run& run : runs_) {
    for (Index done = 0; done < run.count; done += kBlock) {
      parameters(run.first + done, int(std::min<Index>(kBlock, run.count - done)));
      const Index a = run.a + done, b = run.b + done;
      for (int k = 0; k < 3; ++k) {
        block.a[k] = x.col(k).data() + a, block.b[k] = x.col(k).data() + b;
        if (low) block.low_a[k] = low->col(k).data() + a, block.low_b[k] = low->col(k).data() + b;
        block.va[k] = v.col(k).data() + a, block.vb[k] = v.col(k).data() + b;
        block.sum_a[k] = f.col(k).data() + a, block.sum_b[k] = f.col(k).data() + b;
      }
      spring_forces(block);
    }
  }
  S gathered[18][kBlock];
  for (int k = 0; k < 3; ++k) {
    block.a[k] = gathered[k], block.b[k] = gathered[3 + k];
    block.va[k] = gathered[6 + k], block.vb[k] = gathered[9 + k];
    if (low) block.low_a[k] = gathered[12 + k], block.low_b[k] = gathered[15 + k];
    block.sum_a[k] = block.sum_b[k] = nullptr;
  }
  for (Index first = loose_; first < size(); first += kBlock) {
    const int n = int(std::min<Index>(kBlock, size() - first));
    const int *a = a_.data() + first, *b = b_.data() + first;
    parameters(first, n);
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < n; ++i) gathered[k][i] = x(a[i], k), gathered[3 + k][i] = x(b[i], k);
      if (low)
        for (int i = 0; i < n; ++i) gathered[12 + k][i] = (*low)(a[i], k), gathered[15 + k][i] = (*low)(b[i], k);
      if (damped_)
        for (int i = 0; i < n; ++i) gathered[6 + k][i] = v(a[i], k), gathered[9 + k][i] = v(b[i], k);
    }
    spring_forces(block);
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < n; ++i) f(a[i], k) += block.f[k][i], f(b[i], k) -= block.f[k][i];
  }
}

template <class S>
void SpringField<S>::add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const {
  for (Index i = 0; i < size(); ++i) {
    const int a = a_[std::size_t(i)], b = b_[std::size_t(i)];
    const Unit<S> unit = direction(x, a, b);
    S side = across(unit, rest_[i]);
    if (safe) side = std::max(side, S(0));
    const Eigen::Matrix<S, 3, 1> difference = (d.row(a) - d.row(b)).matrix().transpose();
    const S along = difference.dot(unit.n);
    const Eigen::Matrix<S, 3, 1> force = stiffness_[i] * (along * unit.n + side * (difference - along * unit.n));
    for (int k = 0; k < 3; ++k) out(a, k) += force[k], out(b, k) -= force[k];
  }
}

template <class S>
void SpringField<S>::add_damping_times(const Points<S>& x, const Points<S>&, const Points<S>& d, Points<S>& out) const {
  for (Index i = 0; i < size(); ++i) {
    if (damping_[i] == S(0)) continue;
    const int a = a_[std::size_t(i)], b = b_[std::size_t(i)];
    const Unit<S> unit = direction(x, a, b);
    const S along = damping_[i] * (d.row(a) - d.row(b)).matrix().transpose().dot(unit.n);
    for (int k = 0; k < 3; ++k) out(a, k) += along * unit.n[k], out(b, k) -= along * unit.n[k];
  }
}

template <class S>
void SpringField<S>::add_couplings(const Points<S>& x, const Points<S>&, double h, std::vector<Coupling>& out) const {
  for (Index i = 0; i < size(); ++i) {
    const int a = a_[std::size_t(i)], b = b_[std::size_t(i)];
    const Unit<S> unit = direction(x, a, b);
    const Vec3 n = unit.n.template cast<double>();
    const double k = h * h * double(stiffness_[i]), side = k * std::max(double(across(unit, rest_[i])), 0.0);
    out.push_back({a, b, side * Mat3::Identity() + (k - side + h * double(damping_[i])) * n * n.transpose()});
  }
}

template <class S>
double SpringField<S>::potential_energy(const Points<S>& x) const {
  double sum = 0;
  SpringBlock<S> block;
  const auto add = [&](Index first, int n) {
    block.n = n;
    block.stiffness = stiffness_.data() + first, block.rest = rest_.data() + first;
    sum += spring_energy(block);
  };
  for (const Run& run : runs_)
    for (Index done = 0; done < run.count; done += kBlock) {
      for (int k = 0; k < 3; ++k) {
        block.a[k] = x.col(k).data() + run.a + done;
        block.b[k] = x.col(k).data() + run.b + done;
      }
      add(run.first + done, int(std::min<Index>(kBlock, run.count - done)));
    }
  S gathered[6][kBlock];
  for (int k = 0; k < 3; ++k) block.a[k] = gathered[k], block.b[k] = gathered[3 + k];
  for (Index first = loose_; first < size(); first += kBlock) {
    const int n = int(std::min<Index>(kBlock, size() - first));
    for (int k = 0; k < 3; ++k) {
      const S* column = x.col(k).data();
      for (int i = 0; i < n; ++i) {
        gathered[k][i] = column[a_[std::size_t(first + i)]];
        gathered[3 + k][i] = column[b_[std::size_t(first + i)]];
      }
    }
    add(first, n);
  }
  return sum;
}

template <class S>
typename ForceField<S>::Rates SpringField<S>::rate_bounds(const Points<S>& x, const Points<S>&,
                                                          const Values<S>& inverse_mass) const {
  const Index points = x.rows();
  for (auto* sums : {&bound_sums_, damped_ ? &damping_sums_ : nullptr})
    if (sums) sums->setZero(points, 6);
  BoundBlock<S> block;
  const auto parameters = [&](Index first, int n) {
    block.n = n;
    block.stiffness = stiffness_.data() + first;
    block.rest = rest_.data() + first;
    block.damping = damped_ ? damping_.data() + first : nullptr;
  };
  const auto add = [](auto& sums, const S(&values)[6][kBlock], Index at, int n) {
    for (int k = 0; k < 6; ++k) {
      S* to = sums.col(k).data() + at;
      for (int i = 0; i < n; ++i) to[i] += values[k][i];
    }
  };
  for (const Run& run : runs_)
    for (Index done = 0; done < run.count; done += kBlock) {
      parameters(run.first + done, int(std::min<Index>(kBlock, run.count - done)));
      const Index a = run.a + done, b = run.b + done;
      for (int k = 0; k < 3; ++k) block.a[k] = x.col(k).data() + a, block.b[k] = x.col(k).data() + b;
      block.wa = inverse_mass.data() + a, block.wb = inverse_mass.data() + b;
      spring_bounds(block);
      for (const Index end : {a, b}) {
        add(bound_sums_, block.k, end, block.n);
        if (damped_) add(damping_sums_, block.c, end, block.n);
      }
    }
  S gathered[8][kBlock];
  for (int k = 0; k < 3; ++k) block.a[k] = gathered[k], block.b[k] = gathered[3 + k];
  block.wa = gathered[6], block.wb = gathered[7];
  for (Index first = loose_; first < size(); first += kBlock) {
    const int n = int(std::min<Index>(kBlock, size() - first));
    const int *a = a_.data() + first, *b = b_.data() + first;
    parameters(first, n);
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < 3; ++k) gathered[k][i] = x(a[i], k), gathered[3 + k][i] = x(b[i], k);
      gathered[6][i] = inverse_mass[a[i]], gathered[7][i] = inverse_mass[b[i]];
    }
    spring_bounds(block);
    for (int k = 0; k < 6; ++k)
      for (int i = 0; i < n; ++i)
        for (const int point : {a[i], b[i]}) {
          bound_sums_(point, k) += block.k[k][i];
          if (damped_) damping_sums_(point, k) += block.c[k][i];
        }
  }
  // Only rows of free points count.
  const auto largest = [&](const Eigen::Array<S, Eigen::Dynamic, 6>& sums) {
    double found = 0;
    S bounds[kBlock];
    for (Index first = 0; first < points; first += kBlock) {
      const int n = int(std::min<Index>(kBlock, points - first));
      const S* columns[6];
      for (int k = 0; k < 6; ++k) columns[k] = sums.col(k).data() + first;
      eigenvalue_bounds(n, columns, bounds);
      for (int i = 0; i < n; ++i)
        if (inverse_mass[first + i] != S(0)) found = std::max(found, double(bounds[i]));
    }
    return found;
  };
  return {largest(bound_sums_), damped_ ? largest(damping_sums_) : 0};
}

template <class S>
std::unique_ptr<Stepper<S>> SpringField<S>::any_stepper(bool fine) const {
  constexpr bool single = std::is_same_v<S, float>;
  if (damped_ || (fine && !single)) return nullptr;
#if HOOKE_HAS_HIGHWAY
  const auto of_grid = [&](const SpringNetwork& network, const Points<S>& start) -> std::unique_ptr<Stepper<S>> {
    const SpringGrid grid = SpringGrid::of(network, start.rows());
    if constexpr (single) {
      if (fine) return make_fine_grid_stepper(network, grid, start);
    } else {
      if (two_floats_) return make_two_float_grid_stepper(network, grid, start);
    }
    return make_grid_stepper(network, grid, start);
  };
  try {
    return of_grid(*network_, start_);
  } catch (const std::invalid_argument&) {
    // Not a grid as it is numbered.
  }
  try {
    if (const std::vector<int> order = grid_order(*network_, start_.template cast<double>()); !order.empty())
      return renumbered(of_grid(renumbered(*network_, order), renumbered(start_, order)), order);
  } catch (const std::invalid_argument&) {
    // Two springs between the same points.
  }
  if constexpr (single)
    if (fine) return make_fine_mesh_stepper(*network_, start_);
  return two_floats_ ? nullptr : make_mesh_stepper(*network_, start_);
#else
  return nullptr;
#endif
}

template <class S>
void SpringField<S>::describe(Blueprint& out) const {
  CheckpointWriter springs;
  springs.add(a_), springs.add(b_);
  for (const Values<S>* values : {&stiffness_, &rest_, &damping_}) springs.add(*values);
  out.add("springs", size());
  out.add_sum("springs", springs);
}

template class SpringField<float>;
template class SpringField<double>;

}  // namespace hooke::softbody
