// A spring network read as a grid, and the low-pass filter over its points that filtered
// leapfrog multiplies accelerations with. Set-up only; the loops of a step are in filtered_kernels.hpp.
// Internal to hooke::softbody and not installed.
#pragma once

#include <hooke/point_masses.hpp>
#include <hooke/softbody/spring_network.hpp>

#include <array>
#include <string>
#include <vector>

namespace hooke::softbody {

/// The springs of a grid by what they join: from point (r, c) to (r, c + 1), (r, c + 2), (r + 1, c),
/// (r + 1, c + 1), (r + 2, c), and from (r, c + 1) to (r + 1, c).
enum Direction { kRight, kRight2, kDown, kDiagonal, kAntidiagonal, kDown2, kDirections };

/// Rows × columns points, index = row · columns + column, and the springs that start at each.
struct SpringGrid {
  Index rows = 0, columns = 0;
  std::array<std::vector<int>, kDirections> springs;  ///< by point: index in the network, or -1

  /// Reads a network as a grid.
  /// @throws std::invalid_argument where springs join other points than the above, or the same twice
  static SpringGrid of(const SpringNetwork& network, Index points);
};

/// Masses as unit · row[r] · column[c], by medians, and what single points carry beside that.
struct MassModel {
  double unit = 0;             ///< [kg]
  Values<double> row, column;  ///< factors
  struct Odd {
    Index point;
    double extra;  ///< in units, > -row · column
  };
  std::vector<Odd> odd;

  MassModel(const SpringGrid& grid, const Values<double>& mass);
};

/// A symmetric matrix of five diagonals and its factors L D Lᵀ.
class Pentadiagonal {
 public:
  /// The identity.
  explicit Pentadiagonal(Index n);
  void add(Index i, Index j, double value);  ///< to (i, j) and (j, i), |i - j| <= 2; once for i == j
  void factor();                             ///< @pre positive definite

  Index size() const { return diagonal_.size(); }
  Values<double> solve(Values<double> b) const;
  Values<double> times(const Values<double>& x) const;
  /// L(i, i - 1), L(i, i - 2) and 1 / D(i, i).
  const Values<double>& below() const { return below_; }
  const Values<double>& below2() const { return below2_; }
  const Values<double>& inverse_pivot() const { return inverse_pivot_; }

 private:
  Values<double> diagonal_, off_, off2_;  // (i, i), (i, i + 1), (i, i + 2)
  Values<double> below_, below2_, inverse_pivot_;
};

/// One direction of the filter's inverse: M + a² Kᵀ M⁻¹ K along a line of points of relative masses
/// M, where K is the path's Laplacian, free at open ends and simply supported at held points,
/// whose rows are the identity's.
struct LineFilter {
  Pentadiagonal matrix;
  std::vector<Index> held;
  /// By held point: the motion of the line that follows a unit motion of it.
  std::vector<Values<double>> extension;

  LineFilter(const Values<double>& mass, const std::vector<bool>& is_held, double a);
};

}  // namespace hooke::softbody
