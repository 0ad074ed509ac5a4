// The Cholesky factors of a sparse matrix of 3×3 blocks, one row of blocks a point.
#pragma once

#include <hooke/types.hpp>

#include <vector>

namespace hooke {

/// What ties two points to each other in a symmetric matrix of 3×3 blocks: +block at (a, a) and (b, b), -block
/// at (a, b) and (b, a). With b < 0 it is +block at (a, a) alone.
struct Coupling {
  int a, b;
  Mat3 block;  ///< symmetric
};

/// Sparse Cholesky factorisation of blocks, column by column, in the order of approximate minimum degree
/// (Amestoy, Davis, Duff 1996; George, Liu, "Computer Solution of Large Sparse Positive Definite Systems",
/// 1981). What depends on the pattern alone is kept while the pattern stays; no memory is asked for then. A grid
/// of n points costs about n^1.5, a solid about n².
class BlockCholesky {
 public:
  /// Looks at the pattern of n points and these couplings, if it is not the last one.
  void analyse(Index n, const std::vector<Coupling>& couplings);

  /// Multiplications of one `factor` after `analyse`; infinity where it would take more memory than is sensible.
  double cost() const { return cost_; }

  /// Factors the matrix of these diagonal blocks (their couplings' share included) and couplings of the pattern last
  /// analysed; `off_diagonal[k]` is the block at (a, b) of coupling k. False where the matrix is not positive definite.
  bool factor(const std::vector<Mat3>& diagonal, const std::vector<Mat3>& off_diagonal);

  /// x := A⁻¹ x, shape (n, 3).
  void solve(Points<double>& x);

 private:
  Index size_ = -1;
  double cost_ = 0;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<int> place_;            // of a point in the order of elimination
  std::vector<std::size_t> first_;    // of the blocks of a column: its diagonal block
  std::vector<int> row_;              // of a block
  std::vector<std::size_t> slot_;     // of a pair's block
  std::vector<char> turned_;          // ... true where it is stored as its transpose
  std::vector<Mat3> value_;           // the factor
  std::vector<std::size_t> where_;    // of a row in the present column
  std::vector<int> waiting_, next_;   // columns that change column j next, as lists
  std::vector<std::size_t> reached_;  // their next block
  std::vector<Vec3> work_;
};

}  // namespace hooke
