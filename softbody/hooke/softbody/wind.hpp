// Air that moves, and what it does to triangles.
#pragma once

#include <hooke/force_field.hpp>

#include <cstdint>
#include <memory>
#include <vector>

namespace hooke::softbody {

/// Uniform wind with gusts. A still wind is air drag.
struct Wind {
  Vec3 velocity{0, 0, 0};      ///< mean [m/s]
  double gust = 0;             ///< largest change of speed as a share of the mean, >= 0
  double gust_period = 2;      ///< of the slowest gust [s], > 0
  double swing = 0;            ///< largest change of direction, about the y axis [rad]
  double start = 0;            ///< time of the world at which the wind's own clock begins [s]
  double stop = 1e300;         ///< from here on its own clock the air is still [s]
  double fade = 0.3;           ///< before `stop`, the wind dies down over this time [s]
  double air_density = 1.204;  ///< [kg/m³]
  double drag = 1.2;           ///< coefficient of a plate across the wind
  double lift = 0.6;           ///< coefficient of a plate at an angle
  std::uint32_t seed = 1;      ///< of the gusts' phases
  bool once_a_tick = false;    ///< evaluate at the start of a tick and hold: cheaper, first order in the tick

  Vec3 velocity_at(double t) const;  ///< [m/s] at world time t; a smooth function of time alone
};

/// Aerodynamic force on triangles, a third to each corner:
///   drag ½ ρ C_d A |cos α| |v| v, lift ½ ρ C_l A |v|² cos α sin α across v,
/// with v the air's velocity relative to the triangle and α its angle to the normal; the same
/// from both sides. Cost: about 3 ns a triangle on runs of a grid.
template <class S>
class WindField final : public ForceField<S> {
 public:
  /// @throws std::invalid_argument for values that break the rules above or triangles outside [0, point_count)
  WindField(const Wind& wind, const std::vector<Triangle>& triangles, Index point_count);

  bool uses_velocity() const override { return true; }
  bool anywhere() const override { return true; }
  bool passive() const override { return wind_.velocity.isZero(0); }  // still air only takes energy
  bool once_a_tick() const override { return wind_.once_a_tick; }
  void add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const override;
  void add_damping_times(const Points<S>& x, const Points<S>& v, const Points<S>& d, Points<S>& out) const override;
  typename ForceField<S>::Rates rate_bounds(const Points<S>& x, const Points<S>& v,
                                            const Values<S>& inverse_mass) const override;
  void describe(Blueprint& out) const override;

 private:
  struct Run {  // triangles whose corners all move on by one point from one to the next
    Index corner[3], count;
  };
  const Values<S>& damping(const Points<S>& x, const Points<S>& v) const;

  Wind wind_;
  std::vector<Run> runs_;
  std::vector<Triangle> triangles_, loose_;
  mutable Values<S> damping_;  // scratch: a field belongs to one body, which one thread moves
};

extern template class WindField<float>;
extern template class WindField<double>;

}  // namespace hooke::softbody
