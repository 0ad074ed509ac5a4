#include <hooke/softbody/filtered_grid.hpp>

#include <algorithm>
#include <stdexcept>

namespace hooke::softbody {

namespace {

// Which spring of a grid of that many columns joins a and b, seen from which point.
bool place(Index a, Index b, Index columns, Direction& direction, Index& start) {
  if (a > b) std::swap(a, b);
  const Index down = b / columns - a / columns, right = b % columns - a % columns;
  start = a;
  if (down == 0 && right == 1) return direction = kRight, true;
  if (down == 0 && right == 2) return direction = kRight2, true;
  if (down == 1 && right == 0) return direction = kDown, true;
  if (down == 1 && right == 1) return direction = kDiagonal, true;
  if (down == 1 && right == -1) return direction = kAntidiagonal, start = a - 1, true;
  if (down == 2 && right == 0) return direction = kDown2, true;
  return false;
}

}  // namespace

SpringGrid SpringGrid::of(const SpringNetwork& network, Index points) {
  network.check(points);
  // The number of columns is the distance of two points that a spring joins, unless there are too few springs.
  std::vector<Index> candidates;
  for (const Spring& spring : network.springs) candidates.push_back(std::abs(spring.b - spring.a));
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  if (candidates.size() > kDirections)
    throw std::invalid_argument("filtered-leapfrog needs a grid; the springs join points of " +
                                std::to_string(candidates.size()) + " different distances in their numbering");
  SpringGrid grid;
  std::size_t stranger = 0;
  for (const Index columns : candidates) {
    if (columns < 2 || points % columns != 0) continue;
    const auto fits = [&](const Spring& spring) {
      Direction direction;
      Index start;
      return place(spring.a, spring.b, columns, direction, start);
    };
    const auto odd = std::find_if_not(network.springs.begin(), network.springs.end(), fits);
    if (odd == network.springs.end()) {
      grid.columns = columns, grid.rows = points / columns;
      break;
    }
    stranger = std::max(stranger, std::size_t(odd - network.springs.begin()));
  }
  if (grid.columns == 0) {
    std::string rule = "filtered-leapfrog needs a grid of " + std::to_string(points) +
                       " points whose springs join neighbours along rows, columns and diagonals, or skip one";
    if (!network.springs.empty())
      rule += "; spring " + std::to_string(stranger) + " joins points " + std::to_string(network.springs[stranger].a) +
              " and " + std::to_string(network.springs[stranger].b);
    throw std::invalid_argument(rule);
  }
  for (auto& springs : grid.springs) springs.assign(std::size_t(points), -1);
  for (std::size_t i = 0; i < network.springs.size(); ++i) {
    const Spring& spring = network.springs[i];
    Direction direction{};
    Index start = 0;
    place(spring.a, spring.b, grid.columns, direction, start);
    int& entry = grid.springs[direction][std::size_t(start)];
    if (entry >= 0)
      throw std::invalid_argument("filtered-leapfrog: springs " + std::to_string(entry) + " and " + std::to_string(i) +
                                  " join the same points");
    entry = int(i);
  }
  return grid;
}

MassModel::MassModel(const SpringGrid& grid, const Values<double>& mass) : row(grid.rows), column(grid.columns) {
  // Differences below this share of a mass are rounding.
  constexpr double kSame = 1e-5;
  std::vector<double> some;
  const auto median = [&some] {
    const auto middle = some.begin() + std::ptrdiff_t(some.size() / 2);
    std::nth_element(some.begin(), middle, some.end());
    return *middle;
  };
  some.assign(mass.begin(), mass.end());
  unit = median();
  const auto factor = [&] {
    const double value = median() / unit;
    return std::abs(value - 1) < kSame ? 1 : value;
  };
  for (Index r = 0; r < grid.rows; ++r) {
    some.assign(mass.begin() + r * grid.columns, mass.begin() + (r + 1) * grid.columns);
    row[r] = factor();
  }
  for (Index c = 0; c < grid.columns; ++c) {
    some.clear();
    for (Index r = 0; r < grid.rows; ++r) some.push_back(mass[r * grid.columns + c]);
    column[c] = factor();
  }
  for (Index i = 0; i < mass.size(); ++i) {
    const double model = row[i / grid.columns] * column[i % grid.columns];
    const double extra = mass[i] / unit - model;
    if (std::abs(extra) > kSame * model) odd.push_back({i, extra});
  }
}

Pentadiagonal::Pentadiagonal(Index n)
    : diagonal_(Values<double>::Ones(n)), off_(Values<double>::Zero(n)), off2_(Values<double>::Zero(n)) {}

void Pentadiagonal::add(Index i, Index j, double value) {
  const Index first = std::min(i, j), apart = std::abs(i - j);
  (apart == 0 ? diagonal_ : apart == 1 ? off_ : off2_)[first] += value;
}

void Pentadiagonal::factor() {
  const Index n = size();
  Values<double> pivot(n);
  below_.setZero(n), below2_.setZero(n), inverse_pivot_.resize(n);
  for (Index i = 0; i < n; ++i) {
    if (i > 1) below2_[i] = off2_[i - 2] / pivot[i - 2];
    if (i > 0) {
      double value = off_[i - 1];
      if (i > 1) value -= below2_[i] * pivot[i - 2] * below_[i - 1];
      below_[i] = value / pivot[i - 1];
    }
    pivot[i] = diagonal_[i];
    if (i > 0) pivot[i] -= below_[i] * below_[i] * pivot[i - 1];
    if (i > 1) pivot[i] -= below2_[i] * below2_[i] * pivot[i - 2];
    inverse_pivot_[i] = 1 / pivot[i];
  }
}

Values<double> Pentadiagonal::solve(Values<double> b) const {
  const Index n = size();
  for (Index i = 0; i < n; ++i) {
    if (i > 0) b[i] -= below_[i] * b[i - 1];
    if (i > 1) b[i] -= below2_[i] * b[i - 2];
  }
  for (Index i = n; i-- > 0;) {
    b[i] *= inverse_pivot_[i];
    if (i + 1 < n) b[i] -= below_[i + 1] * b[i + 1];
    if (i + 2 < n) b[i] -= below2_[i + 2] * b[i + 2];
  }
  return b;
}

Values<double> Pentadiagonal::times(const Values<double>& x) const {
  Values<double> out = diagonal_ * x;
  for (Index i = 0; i + 1 < size(); ++i) out[i] += off_[i] * x[i + 1], out[i + 1] += off_[i] * x[i];
  for (Index i = 0; i + 2 < size(); ++i) out[i] += off2_[i] * x[i + 2], out[i + 2] += off2_[i] * x[i];
  return out;
}

LineFilter::LineFilter(const Values<double>& mass, const std::vector<bool>& is_held, double a) : matrix(mass.size()) {
  const Index n = mass.size();
  std::vector<Values<double>> pull;  // by held point: minus what its motion adds to the others' equations
  std::vector<Index> number(std::size_t(n), -1);
  for (Index i = 0; i < n; ++i)
    if (is_held[std::size_t(i)]) {
      number[std::size_t(i)] = Index(held.size());
      held.push_back(i);
      pull.push_back(Values<double>::Zero(n));
      pull.back()[i] = 1;
    }
  for (Index i = 0; i < n; ++i) {
    if (is_held[std::size_t(i)]) continue;
    matrix.add(i, i, mass[i] - 1);
    // Row i of K, whose square joins the matrix.
    Index at[3];
    double weight[3];
    int count = 1;
    at[0] = i, weight[0] = 0;
    for (const Index j : {i - 1, i + 1})
      if (j >= 0 && j < n) at[count] = j, weight[count] = -1, weight[0] += 1, ++count;
    for (int p = 0; p < count; ++p)
      for (int q = 0; q < count; ++q) {
        const double value = a * a * weight[p] * weight[q] / mass[i];
        if (is_held[std::size_t(at[p])]) continue;
        if (is_held[std::size_t(at[q])])
          pull[std::size_t(number[std::size_t(at[q])])][at[p]] -= value;
        else if (at[p] <= at[q])
          matrix.add(at[p], at[q], value);
      }
  }
  matrix.factor();
  for (const Values<double>& right : pull) extension.push_back(matrix.solve(right));
}

}  // namespace hooke::softbody
