#include <hooke/softbody/grid_order.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace hooke::softbody {

namespace {

struct Step {
  Index row = 0, column = 0;
};

bool allowed(Step s) {
  const Index r = std::abs(s.row), c = std::abs(s.column);
  return r <= 2 && c <= 2 && r + c > 0 && (r == 0 || c == 0 || (r == 1 && c == 1));
}

// What one step along a row and one along a column are near a point.
struct Basis {
  Vec3 along_row = Vec3::Zero(), along_column = Vec3::Zero();

  // The step nearest to d, if it is one that springs take and d leads near its end.
  std::optional<Step> step(const Vec3& d) const {
    const double rr = along_row.dot(along_row), rc = along_row.dot(along_column), cc = along_column.dot(along_column);
    const double determinant = rr * cc - rc * rc;
    if (!(determinant > 0.05 * rr * cc)) return std::nullopt;
    const double dr = d.dot(along_row), dc = d.dot(along_column);
    const double column = std::round((cc * dr - rc * dc) / determinant),
                 row = std::round((rr * dc - rc * dr) / determinant);
    if (!(std::abs(column) <= 2 && std::abs(row) <= 2)) return std::nullopt;
    const Step nearest{Index(row), Index(column)};
    const double off = (d - column * along_row - row * along_column).squaredNorm();
    if (!allowed(nearest) || !(off <= 0.5 * std::min(rr, cc) * (row * row + column * column))) return std::nullopt;
    return nearest;
  }
  void take(Step s, const Vec3& d) {
    if (s.row == 0 && std::abs(s.column) == 1) along_row = double(s.column) * d;
    if (s.column == 0 && std::abs(s.row) == 1) along_column = double(s.row) * d;
  }
};

class Search {
 public:
  Search(const SpringNetwork& network, const Points<double>& start)
      : start_(start), neighbours_(std::size_t(start.rows())) {
    for (const Spring& spring : network.springs) {
      neighbours_[std::size_t(spring.a)].push_back(spring.b);
      neighbours_[std::size_t(spring.b)].push_back(spring.a);
    }
    // Nearest first: what they tell of the lattice serves the others.
    for (std::size_t i = 0; i < neighbours_.size(); ++i)
      std::stable_sort(neighbours_[i].begin(), neighbours_[i].end(), [&](int a, int b) {
        return between(int(i), a).squaredNorm() < between(int(i), b).squaredNorm();
      });
  }

  std::vector<int> order() {
    const auto fewer = [](const auto& a, const auto& b) { return a.size() < b.size(); };
    const auto [fewest, most] = std::minmax_element(neighbours_.begin(), neighbours_.end(), fewer);
    if (neighbours_.size() < 4 || fewest->size() < 2 || most->size() > 12) return {};
    const int seed = int(fewest - neighbours_.begin());
    // Structural springs are the shortest in most grids.
    struct Pair {
      double size;
      Basis basis;
    };
    std::vector<Pair> pairs;
    for (const int a : *fewest)
      for (const int b : *fewest) {
        const Basis basis{between(seed, a), between(seed, b)};
        const auto explained = [&](int q) { return basis.step(between(seed, q)).has_value(); };
        if (a >= b || !std::all_of(fewest->begin(), fewest->end(), explained)) continue;
        pairs.push_back({basis.along_row.squaredNorm() + basis.along_column.squaredNorm(), basis});
      }
    std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.size < b.size; });
    constexpr std::size_t kTries = 3;
    for (std::size_t i = 0; i < std::min(pairs.size(), kTries); ++i)
      if (place_all(seed, pairs[i].basis) && order_rows()) return order_;
    return {};
  }

 private:
  Vec3 between(int a, int b) const { return (start_.row(b) - start_.row(a)).matrix().transpose(); }

  bool place_all(int seed, const Basis& basis) {
    const std::size_t n = neighbours_.size();
    place_.assign(n, {});
    known_.assign(n, false);
    std::vector<Basis> bases(n);
    std::vector<int> found{seed};
    known_[std::size_t(seed)] = true;
    bases[std::size_t(seed)] = basis;
    for (std::size_t next = 0; next < found.size(); ++next) {
      const int p = found[next];
      const Step here = place_[std::size_t(p)];
      Basis& lattice = bases[std::size_t(p)];
      for (const int q : neighbours_[std::size_t(p)]) {
        if (!known_[std::size_t(q)]) continue;
        const Step there = place_[std::size_t(q)], step{there.row - here.row, there.column - here.column};
        if (!allowed(step)) return false;
        lattice.take(step, between(p, q));
      }
      for (const int q : neighbours_[std::size_t(p)]) {
        if (known_[std::size_t(q)]) continue;
        const Vec3 d = between(p, q);
        const std::optional<Step> step = lattice.step(d);
        if (!step) return false;
        lattice.take(*step, d);
        known_[std::size_t(q)] = true;
        place_[std::size_t(q)] = {here.row + step->row, here.column + step->column};
        bases[std::size_t(q)] = lattice;
        found.push_back(q);
      }
    }
    return found.size() == n;
  }

  // True where the places fill a rectangle.
  bool order_rows() {
    Step low = place_[0], high = low;
    for (const Step& s : place_) {
      low = {std::min(low.row, s.row), std::min(low.column, s.column)};
      high = {std::max(high.row, s.row), std::max(high.column, s.column)};
    }
    const Index n = Index(place_.size()), height = high.row - low.row + 1, width = high.column - low.column + 1;
    if (height < 2 || width < 2 || height > n || width > n || height * width != n) return false;
    order_.assign(place_.size(), -1);
    const bool turned = height > width;  // long rows are faster
    for (std::size_t i = 0; i < place_.size(); ++i) {
      const Index row = place_[i].row - low.row, column = place_[i].column - low.column;
      int& at = order_[std::size_t(turned ? column * height + row : row * width + column)];
      if (at >= 0) return false;
      at = int(i);
    }
    return true;
  }

  const Points<double>& start_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<Step> place_;
  std::vector<bool> known_;
  std::vector<int> order_;
};

// Row i of `to` becomes row order[i].
template <class S>
void gather(const Points<S>& from, const std::vector<int>& order, Points<S>& to) {
  to.resize(from.rows(), 3);
  for (Index i = 0; i < from.rows(); ++i) to.row(i) = from.row(order[std::size_t(i)]);
}

template <class S>
class RenumberedStepper final : public Stepper<S> {
 public:
  RenumberedStepper(std::unique_ptr<Stepper<S>> inner, std::vector<int> order)
      : inner_(std::move(inner)), order_(std::move(order)) {}

  void load(const PointMasses<S>& points, const LowParts<S>& low, const Vec3& gravity, const Points<S>* push) override {
    gather(points.position, order_, points_.position), gather(points.velocity, order_, points_.velocity);
    points_.inverse_mass.resize(points.size());
    for (std::size_t i = 0; i < order_.size(); ++i) points_.inverse_mass[Index(i)] = points.inverse_mass[order_[i]];
    gather(low.position, order_, low_.position), gather(low.velocity, order_, low_.velocity);
    if (push) gather(*push, order_, push_);
    inner_->load(points_, low_, gravity, push ? &push_ : nullptr);
  }
  void run(std::span<const Stage> stages, Gang* gang) override { inner_->run(stages, gang); }
  void store(PointMasses<S>& points, LowParts<S>& low) const override {
    inner_->store(points_, low_);
    scatter(points_.position, points.position), scatter(points_.velocity, points.velocity);
    scatter(low_.position, low.position), scatter(low_.velocity, low.velocity);
  }
  std::string_view precision() const override { return inner_->precision(); }

 private:
  void scatter(const Points<S>& from, Points<S>& to) const {
    to.resize(from.rows(), 3);
    for (Index i = 0; i < from.rows(); ++i) to.row(order_[std::size_t(i)]) = from.row(i);
  }

  std::unique_ptr<Stepper<S>> inner_;
  std::vector<int> order_;
  mutable PointMasses<S> points_;
  mutable LowParts<S> low_;
  Points<S> push_{0, 3};
};

}  // namespace

std::vector<int> grid_order(const SpringNetwork& network, const Points<double>& start) {
  return start.rows() < 4 ? std::vector<int>{} : Search(network, start).order();
}

SpringNetwork renumbered(const SpringNetwork& network, const std::vector<int>& order) {
  std::vector<int> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) place[std::size_t(order[i])] = int(i);
  SpringNetwork out = network;
  for (Spring& spring : out.springs) spring.a = place[std::size_t(spring.a)], spring.b = place[std::size_t(spring.b)];
  return out;
}

template <class S>
Points<S> renumbered(const Points<S>& values, const std::vector<int>& order) {
  Points<S> out;
  gather(values, order, out);
  return out;
}

template <class S>
std::unique_ptr<Stepper<S>> renumbered(std::unique_ptr<Stepper<S>> inner, std::vector<int> order) {
  return std::make_unique<RenumberedStepper<S>>(std::move(inner), std::move(order));
}

template Points<float> renumbered(const Points<float>&, const std::vector<int>&);
template Points<double> renumbered(const Points<double>&, const std::vector<int>&);
template std::unique_ptr<Stepper<float>> renumbered(std::unique_ptr<Stepper<float>>, std::vector<int>);
template std::unique_ptr<Stepper<double>> renumbered(std::unique_ptr<Stepper<double>>, std::vector<int>);

}  // namespace hooke::softbody
