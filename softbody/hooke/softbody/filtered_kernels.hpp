// The inner loops of filtered leapfrog. Compiled once for each instruction set and chosen at run
// time; internal to hooke::softbody and not installed.
#pragma once

#include <hooke/softbody/filtered_grid.hpp>

#include <cstddef>

namespace hooke::softbody {

/// Rows that a block of row solves takes at once.
template <class S>
inline constexpr int kLanes = int(32 / sizeof(S));

/// Below this length [m], squared, a spring has no direction. It is added to all squares of lengths.
template <class S>
inline constexpr S kTiny = S(1e-24);

/// Squares of lengths of n differences x|y|z, the same bits as the springs'.
void sheet_squares(int n, const float* difference, float* out);
void sheet_squares(int n, const double* difference, double* out);

/// The forces on a row of a grid, and behind them the first half of the solves down the columns:
/// z = b - w1 z1 - w2 z2 with b = scale f + mass g. Rows of positions and velocities have three coordinates `pad`
/// apart, may be read from -1 to columns + 2 and start on a vector, as all others do.
template <class S>
struct SheetForward {
  int columns;  // a multiple of kLanes
  std::ptrdiff_t pad, plane;
  const S *x[3], *v[3];                 // this row and the next two; v: for dampers only
  const S *above, *above2;              // positions of the row before, and the one before that
  S* pull;                              // gets force over length of kDown, kDiagonal, kAntidiagonal, kDown2
  const S *pull1, *pull2;               // what it got in the two rows before
  const S *stiffness, *rest, *damping;  // by vector and direction; L then L²; damping: null without dampers.
                                        // An antidiagonal spring is kept with its upper end
  const S *scale, *mass;                // by column
  S gravity[3];
  const S* extra;  // null, or accelerations in place of gravity
  S* right;        // null, or gets b, `pad` apart
  S* z;
  const S *z1, *z2;
  S w1, w2;
};
void sheet_forward(const SheetForward<float>& row);
void sheet_forward(const SheetForward<double>& row);

/// Solves kLanes rows from z on in place: the second half down the columns, then along the rows. below[c] =
/// L(c, c - 1), below2[c] = L(c, c - 2), above[c] = L(c + 1, c), above2[c] = L(c + 2, c) along rows; pivot, next,
/// next2 are 1 / D, above and above2 of the columns, at these rows.
template <class S>
struct SheetBack {
  int columns;  // a multiple of kLanes
  std::ptrdiff_t plane, stride;
  S* z;
  S* wait;       // six rows: the two rows below as the columns' solve left them, three coordinates each
  const S* add;  // null, or what is added between the solves: 3 · kLanes rows
  const S *pivot, *next, *next2;
  const S *below, *below2, *above, *above2, *inverse_pivot;
  S* scratch;  // 3 · kLanes · columns
};
void sheet_back(const SheetBack<float>& block);
void sheet_back(const SheetBack<double>& block);

/// v += kick z; x += h v; predicted = v + ½ z where not null. Three coordinates of a row.
template <class S>
struct SheetMove {
  int columns;
  S *x[3], *v[3], *predicted[3];
  const S* z[3];
  S kick, h;
};
void sheet_move(const SheetMove<float>& row);
void sheet_move(const SheetMove<double>& row);

/// sum += weight · y for three coordinates.
template <class S>
struct SheetSum {
  int columns;
  std::ptrdiff_t plane, sum_plane;
  S* sum;
  const S* y;
  S weight;
};
void sheet_sum(SheetSum<float>& row);
void sheet_sum(SheetSum<double>& row);

}  // namespace hooke::softbody
