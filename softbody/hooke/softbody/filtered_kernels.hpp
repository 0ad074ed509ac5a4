// The inner loops of filtered leapfrog. Compiled once for each instruction set and chosen at run
// time; internal to hooke::softbody and not installed.
#pragma once

#include <hooke/softbody/filtered_grid.hpp>

#include <cstddef>

namespace hooke::softbody {

/// Columns of a block, and rows that a block of row solves takes at once: a cache line, whatever the vectors' length.
template <class S>
inline constexpr int kLanes = int(64 / sizeof(S));

/// Squares of lengths of n differences x|y|z, the same bits as the springs'.
void sheet_squares(int n, const float* difference, float* out);
void sheet_squares(int n, const double* difference, double* out);

/// Of the springs that begin in a block of columns of a row, by direction: stiffness, the exact L² and about 1 / L²;
/// damping: null without dampers.
template <class S>
struct SheetSprings {
  const S *stiffness, *rest, *inverse, *damping;
};

/// The springs that begin in a row of a grid, the forces on that row and, behind them, the first half of the solves
/// down the columns: z = b - w1 z1 - w2 z2 with b = scale f + mass g. Positions and velocities may be read up to
/// columns + 2, past the end of their rows, where no spring acts; all other rows start on a cache line.
template <class S>
struct SheetForward {
  int columns;                // a multiple of kLanes
  std::ptrdiff_t pad, plane;  // from coordinate to coordinate, of z and of everything without a distance of its own
  const S *x[3], *v[3];       // this row and the next two; v: for dampers only
  std::ptrdiff_t apart[3];    // from coordinate to coordinate of these
  const S *near, *far;        // minus the forces so far on this row, and on the next
  S *next_near, *next_far;    // get those on the next, and on the one after that
  const SheetSprings<S>* springs;  // by block
  const S *scale, *mass;           // by column
  S gravity[3];
  const S* extra;  // null, or accelerations in place of gravity
  S* right;        // null, or gets b, `pad` apart
  S* z;
  const S *z1, *z2;
  S w1, w2;
  bool far_from_rest;  // a guess, whether springs are out of the reach of the series; comes back true or false
};
void sheet_forward(SheetForward<float>& row);
void sheet_forward(SheetForward<double>& row);

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
