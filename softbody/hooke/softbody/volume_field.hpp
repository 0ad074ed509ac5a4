// The force by which a closed surface keeps the volume that it encloses.
#pragma once

#include <hooke/force_field.hpp>

#include <vector>

namespace hooke::softbody {

/// Pressure in a closed surface, the same everywhere: E = ½ κ (V - V₀)² / V₀, with V the enclosed
/// volume and V₀ that of the start. Each triangle hands a third of pressure × area to its corners,
/// which is the exact gradient on a closed surface and sums to zero: it changes no momentum.
/// Cost: about 10 ns a triangle.
template <class S>
class VolumeField final : public ForceField<S> {
 public:
  /// @param stiffness κ [Pa], >= 0; start (n, 3)
  /// @throws std::invalid_argument for triangles outside [0, n), a surface that is not closed or not
  ///         counter-clockwise from outside throughout, and one that encloses no volume
  VolumeField(double stiffness, const std::vector<Triangle>& triangles, const Points<S>& start);

  /// What the triangles enclose at x [m³].
  double volume(const Points<S>& x) const;

  bool uses_velocity() const override { return false; }
  bool anywhere() const override { return true; }
  bool passive() const override { return true; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;
  /// The change of pressure, κ/V₀ ∇V ∇Vᵀ, is never negative; `safe` leaves out the turning of the surface.
  void add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const override;
  double potential_energy(const Points<S>& x) const override;
  /// κ/V₀ Σ w |∇V|², exact for the pressure's change, and the largest row of the rest.
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>& v,
                                            const Values<S>& inverse_mass) const override;
  void describe(Blueprint& out) const override;

 private:
  double pressure(const Points<S>& x) const;  // [Pa], of compression

  double stiffness_, start_volume_;
  std::vector<Triangle> triangles_;
  // Scratch of rate_bounds; a field belongs to one body and is asked by one thread at a time.
  mutable Eigen::Array<double, Eigen::Dynamic, 4> sums_;
};

extern template class VolumeField<float>;
extern template class VolumeField<double>;

}  // namespace hooke::softbody
