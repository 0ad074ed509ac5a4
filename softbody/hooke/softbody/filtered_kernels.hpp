// The inner loops of filtered leapfrog. Compiled once for each instruction set and chosen at run
// time, all with the same bits; internal to hooke::softbody and not installed.
#pragma once

#include <cstddef>

namespace hooke::softbody {

/// Rows that a block of row solves takes at once.
template <class S>
inline constexpr int kLanes = int(32 / sizeof(S));

/// The springs that start in one row of a grid. x[j] are the rows from it on, of which columns + 2
/// values may be read; spring[d] holds stiffness, rest length, its square and damping of
/// Direction d, each `stride` values. Forces are added to rows f[0] and f[1] and set in f[2].
/// rows_below: 2, or fewer at the end of the grid.
template <class S>
struct SheetRow {
  int columns, rows_below;
  std::ptrdiff_t stride;
  const S* x[3][3];
  const S* v[3][3];  // null without dampers
  const S* spring[6];
  S* f[3][3];
  S* scratch;  // 3 (columns + 2)
};
void sheet_springs(SheetRow<float>& row);
void sheet_springs(SheetRow<double>& row);

/// f becomes the right side of a row: scale · f + mass[i] (gravity, or extra[i] where not null).
template <class S>
struct SheetRight {
  int columns;
  S* f[3];
  S scale, gravity[3];
  const S* mass;
  const S* extra[3];
};
void sheet_right(SheetRight<float>& row);
void sheet_right(SheetRight<double>& row);

/// y = pivot y - w1 y1 - w2 y2 for three coordinates that lie `plane` apart.
template <class S>
struct SheetSweep {
  int columns;
  std::ptrdiff_t plane;
  S* y;
  const S *y1, *y2;
  S pivot, w1, w2;
};
void sheet_sweep(SheetSweep<float>& row);
void sheet_sweep(SheetSweep<double>& row);

/// Solves along kLanes rows of three coordinates; columns is a multiple of kLanes. below[c] = L(c, c - 1),
/// below2[c] = L(c, c - 2), above[c] = L(c + 1, c), above2[c] = L(c + 2, c).
template <class S>
struct SheetRowSolve {
  int columns;
  std::ptrdiff_t plane, stride;
  S* z;
  const S *below, *below2, *above, *above2, *inverse_pivot;
  S* scratch;  // 3 · kLanes · columns
};
void sheet_row_solve(SheetRowSolve<float>& block);
void sheet_row_solve(SheetRowSolve<double>& block);

/// v += kick z; x += h v; predicted = v + ½ z where not null. One coordinate of a row.
template <class S>
struct SheetMove {
  int columns;
  S *x, *v, *predicted;
  const S* z;
  S kick, h;
};
void sheet_move(SheetMove<float>& row);
void sheet_move(SheetMove<double>& row);

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
