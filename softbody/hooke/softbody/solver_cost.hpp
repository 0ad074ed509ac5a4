// What methods cost on a body: counted work times a fixed table, so that choices never depend on a clock.
#pragma once

#include <hooke/softbody/soft_body.hpp>

namespace hooke::softbody {

/// Nanoseconds of one force evaluation per spring or point, the step included; fixed, so that one scene gives one
/// choice on every machine. Only their ratios decide.
struct CostTable {
  double single, twice;  ///< float, double
};
inline constexpr CostTable kGridCost{0.75, 1.7};    ///< undamped springs of a grid, however numbered
inline constexpr CostTable kNetworkCost{2.4, 3.9};  ///< other undamped springs
/// The general way: other forces, dampers, other methods.
inline constexpr CostTable kDampedCost{8, 10};
inline constexpr CostTable kFilteredCost{1.6, 3.2};  ///< a step of filtered leapfrog
inline constexpr CostTable kXpbdCost{15, 17};        ///< a sweep of xpbd(), a quarter of its substep's rest included
inline constexpr CostTable kProductCost{20, 22};     ///< a product of an implicit solve

/// True where this body, with this RMS speed over points [m/s] and gravity [m/s²], is in float at steps of h stepped
/// in double (MotionSettings::compensated): that costs what double costs.
/// @param stable_step the method's largest [s]; 0: not looked at
bool rounding_shows(const SoftBodySettings& settings, double h, double speed, double gravity, double stable_step = 0);

/// What explicit methods and xpbd() cost on a body by the table; of implicit ones the evaluations alone (ImplicitCost).
class SolverCost {
 public:
  /// Cost: that of looking for rows in the springs.
  explicit SolverCost(const SoftBodySettings& settings);
  /// @param evaluations of all forces, or sweeps of xpbd()
  /// @param in_double rounding_shows
  /// @return [s]
  double seconds(const Method& method, Precision precision, double evaluations, bool in_double = false) const;

 private:
  const CostTable* fused_;  // what splittings cost
  double springs_and_points_;
};

/// What implicit methods cost on a body by the table and counted work, as if every step and every run of products
/// that is worth it began with a factorisation of the springs' matrix: 1 ns a multiplication in it and in its solves.
class ImplicitCost {
 public:
  /// Cost: that of ordering the matrix.
  explicit ImplicitCost(const SoftBodySettings& settings);
  /// @return [s]
  double seconds(Precision precision, double evaluations, double products, double steps) const;

 private:
  double springs_and_points_, factoring_ = 0, solving_ = 0;  // multiplications
};

/// Force evaluations of a run of `ticks` ticks of `substeps` steps, explicit methods; sweeps of xpbd().
double evaluations_of(const Method& method, double ticks, double substeps);

}  // namespace hooke::softbody
