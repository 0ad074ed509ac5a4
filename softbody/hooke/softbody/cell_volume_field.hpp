// The force by which every cell of a lattice keeps its volume.
#pragma once

#include <hooke/force_field.hpp>

#include <array>
#include <vector>

namespace hooke::softbody {

/// Pressure in each cell of a box of points: E = ½ κ Σ (V - V₀)² / V₀ over the cells, with V = a · (b × c)
/// of a cell's mean edges along x, y and z, and V₀ that of the start. V is negative in a cell that is turned
/// inside out, so that it is driven back: springs alone are as content in the mirror. The force is the exact
/// gradient; it sums to zero over the points of a cell and changes neither momentum nor angular momentum.
/// One volume a cell, from mean edges: a finer condition would lock (Flanagan and Belytschko 1981).
/// Cost: 1.7 times that of the springs along edges and face diagonals.
template <class S>
class CellVolumeField final : public ForceField<S> {
 public:
  /// @param stiffness κ [Pa], >= 0
  /// @param points along x, y and z, >= 2 each; point (x, y, z) has index (z · ny + y) · nx + x
  /// @param start (nx · ny · nz, 3)
  /// @throws std::invalid_argument for other numbers of points and for cells without volume
  CellVolumeField(double stiffness, const std::array<int, 3>& points, const Points<S>& start);

  /// By cell, x fastest [m³]; for looking at, not in a step.
  std::vector<double> volumes(const Points<S>& x) const;

  bool uses_velocity() const override { return false; }
  bool anywhere() const override { return true; }
  bool passive() const override { return true; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;
  void add_fine_force(const Points<S>& x, const Points<S>& low, const Points<S>& v, double t,
                      Points<S>& f) const override;
  /// The change of pressure, κ/V₀ ∇V ∇Vᵀ, is never negative; `safe` leaves out the turning of the faces.
  void add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const override;
  double potential_energy(const Points<S>& x) const override;
  /// The largest row of κ/√(V₀ V₀') ∇V' · w ∇V over pairs of cells, and of the rest.
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>& v,
                                            const Values<S>& inverse_mass) const override;
  void describe(Blueprint& out) const override;

 private:
  // Calls work(first, count, corners, cell) for the cells along x, `corners` the first point of each of the
  // four rows of points beside them.
  template <class Work>
  void each_row(const Work& work) const;
  void add_forces(const Points<S>& x, const Points<S>* low, Points<S>& f) const;

  S stiffness_;
  std::array<int, 3> points_;
  std::vector<S> start_;  // V₀ by cell
  // Scratch of rate_bounds; a field belongs to one body and is asked by one thread at a time.
  mutable std::vector<Eigen::Matrix<double, 3, 4>> faces_;
  mutable std::vector<double> rows_;  // by cell
  mutable Values<double> sums_;       // by point
};

extern template class CellVolumeField<float>;
extern template class CellVolumeField<double>;

}  // namespace hooke::softbody
