#include <hooke/block_cholesky.hpp>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hooke {

namespace {

constexpr std::size_t kMostBlocks = 4'000'000;  // 288 MB

// L Lᵀ = m in place, the lower half. False where m is not positive definite.
bool factor_block(Mat3& m) {
  for (int j = 0; j < 3; ++j) {
    double pivot = m(j, j);
    for (int k = 0; k < j; ++k) pivot -= m(j, k) * m(j, k);
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
    m(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 3; ++i) {
      double sum = m(i, j);
      for (int k = 0; k < j; ++k) sum -= m(i, k) * m(j, k);
      m(i, j) = sum / m(j, j);
    }
  }
  return true;
}

// b := b L⁻ᵀ.
void divide_right(const Mat3& l, Mat3& b) {
  b.col(0) /= l(0, 0);
  b.col(1) = (b.col(1) - l(1, 0) * b.col(0)) / l(1, 1);
  b.col(2) = (b.col(2) - l(2, 0) * b.col(0) - l(2, 1) * b.col(1)) / l(2, 2);
}

}  // namespace

void BlockCholesky::analyse(Index n, const std::vector<Coupling>& couplings) {
  const auto same = [](const Coupling& c, const std::pair<int, int>& p) { return c.a == p.first && c.b == p.second; };
  if (n == size_ && std::equal(couplings.begin(), couplings.end(), pairs_.begin(), pairs_.end(), same)) return;
  size_ = n;
  pairs_.clear();
  for (const Coupling& c : couplings) pairs_.emplace_back(c.a, c.b);

  std::vector<Eigen::Triplet<double>> edges;
  for (const auto& [a, b] : pairs_)
    if (b >= 0 && a != b) edges.emplace_back(a, b, 1.0), edges.emplace_back(b, a, 1.0);
  for (int i = 0; i < int(n); ++i) edges.emplace_back(i, i, 1.0);
  Eigen::SparseMatrix<double> graph(n, n);
  graph.setFromTriplets(edges.begin(), edges.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph, order);
  const auto points = std::size_t(n);
  std::vector<int> point(points);  // at a place
  place_.resize(points);
  for (int i = 0; i < int(n); ++i) point[std::size_t(i)] = order.indices()[i];
  for (int i = 0; i < int(n); ++i) place_[std::size_t(point[std::size_t(i)])] = i;

  // A column has the rows of its own couplings and those of the columns whose first row it is.
  std::vector<std::vector<int>> rows(points), children(points);
  std::vector<int> mark(points, -1);
  std::size_t blocks = 0;
  cost_ = 0;
  for (int j = 0; j < int(n); ++j) {
    auto& mine = rows[std::size_t(j)];
    mark[std::size_t(j)] = j;
    const auto take = [&](int i) {
      if (i > j && mark[std::size_t(i)] != j) mark[std::size_t(i)] = j, mine.push_back(i);
    };
    for (Eigen::SparseMatrix<double>::InnerIterator it(graph, point[std::size_t(j)]); it; ++it)
      take(place_[std::size_t(it.row())]);
    for (const int child : children[std::size_t(j)])
      for (const int i : rows[std::size_t(child)]) take(i);
    std::sort(mine.begin(), mine.end());
    if (!mine.empty()) children[std::size_t(mine[0])].push_back(j);
    blocks += mine.size() + 1;
    cost_ += 27 * (0.5 * double(mine.size()) * double(mine.size() + 1) + double(mine.size()) + 1);
    if (blocks > kMostBlocks) {
      cost_ = std::numeric_limits<double>::infinity();
      return;
    }
  }
  first_.assign(1, 0);
  row_.clear();
  for (int j = 0; j < int(n); ++j) {
    row_.push_back(j);
    row_.insert(row_.end(), rows[std::size_t(j)].begin(), rows[std::size_t(j)].end());
    first_.push_back(row_.size());
  }
  slot_.assign(pairs_.size(), 0);
  turned_.assign(pairs_.size(), 0);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    if (pairs_[k].second < 0) continue;
    int i = place_[std::size_t(pairs_[k].first)], j = place_[std::size_t(pairs_[k].second)];
    turned_[k] = i < j;
    if (i < j) std::swap(i, j);
    const auto begin = row_.begin() + std::ptrdiff_t(first_[std::size_t(j)]),
               end = row_.begin() + std::ptrdiff_t(first_[std::size_t(j) + 1]);
    slot_[k] = std::size_t(std::lower_bound(begin, end, i) - row_.begin());
  }
  value_.resize(row_.size());
  where_.resize(points);
  waiting_.resize(points), next_.resize(points), reached_.resize(points);
  work_.resize(points);
}

bool BlockCholesky::factor(const std::vector<Mat3>& diagonal, const std::vector<Mat3>& off_diagonal) {
  std::fill(value_.begin(), value_.end(), Mat3::Zero());
  for (std::size_t i = 0; i < place_.size(); ++i) value_[first_[std::size_t(place_[i])]] = diagonal[i];
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    if (pairs_[k].second < 0) continue;
    if (turned_[k])
      value_[slot_[k]] += off_diagonal[k].transpose();
    else
      value_[slot_[k]] += off_diagonal[k];
  }
  std::fill(waiting_.begin(), waiting_.end(), -1);
  for (std::size_t j = 0; j < place_.size(); ++j) {
    for (std::size_t p = first_[j]; p < first_[j + 1]; ++p) where_[std::size_t(row_[p])] = p;
    const auto wait = [&](int k) {
      const std::size_t at = reached_[std::size_t(k)];
      if (at == first_[std::size_t(k) + 1]) return;
      int& list = waiting_[std::size_t(row_[at])];
      next_[std::size_t(k)] = list;
      list = k;
    };
    for (int k = waiting_[j]; k >= 0;) {
      const int following = next_[std::size_t(k)];
      const std::size_t at = reached_[std::size_t(k)]++, end = first_[std::size_t(k) + 1];
      const Mat3 mine = value_[at].transpose();
      for (std::size_t p = at; p < end; ++p) value_[where_[std::size_t(row_[p])]].noalias() -= value_[p] * mine;
      wait(k);
      k = following;
    }
    Mat3& pivot = value_[first_[j]];
    if (!factor_block(pivot)) return false;
    for (std::size_t p = first_[j] + 1; p < first_[j + 1]; ++p) divide_right(pivot, value_[p]);
    reached_[j] = first_[j] + 1;
    wait(int(j));
  }
  return true;
}

void BlockCholesky::solve(Points<double>& x) {
  for (std::size_t i = 0; i < place_.size(); ++i) work_[std::size_t(place_[i])] = x.row(Index(i)).matrix().transpose();
  for (std::size_t j = 0; j < work_.size(); ++j) {
    const Mat3& l = value_[first_[j]];
    Vec3& b = work_[j];
    b[0] /= l(0, 0);
    b[1] = (b[1] - l(1, 0) * b[0]) / l(1, 1);
    b[2] = (b[2] - l(2, 0) * b[0] - l(2, 1) * b[1]) / l(2, 2);
    for (std::size_t p = first_[j] + 1; p < first_[j + 1]; ++p) work_[std::size_t(row_[p])].noalias() -= value_[p] * b;
  }
  for (std::size_t j = work_.size(); j-- > 0;) {
    Vec3 b = work_[j];
    for (std::size_t p = first_[j] + 1; p < first_[j + 1]; ++p)
      b.noalias() -= value_[p].transpose() * work_[std::size_t(row_[p])];
    const Mat3& l = value_[first_[j]];
    b[2] /= l(2, 2);
    b[1] = (b[1] - l(2, 1) * b[2]) / l(1, 1);
    b[0] = (b[0] - l(1, 0) * b[1] - l(2, 0) * b[2]) / l(0, 0);
    work_[j] = b;
  }
  for (std::size_t i = 0; i < place_.size(); ++i) x.row(Index(i)) = work_[std::size_t(place_[i])].transpose().array();
}

}  // namespace hooke
