// The state of a body made of points. Only data: what moves it is integrator.hpp.
#pragma once

#include <hooke/types.hpp>

namespace hooke {

/// n point masses in user order; position and velocity belong to the same time at every tick.
///
/// Positions are relative to a double origin of the body's own, so that float keeps its
/// digits however far the body is from the world's origin: world = origin + position.
template <class S>
struct PointMasses {
  Vec3 origin{0, 0, 0};      ///< [m]
  Points<S> position{0, 3};  ///< [m], relative to origin
  Points<S> velocity{0, 3};  ///< [m/s]
  Values<S> inverse_mass;    ///< [1/kg]; 0 = immovable: no gravity, force or collision moves it
  Values<S> mass;            ///< [kg]; survives pinning, so that a released point weighs what it did

  Index size() const { return position.rows(); }
  /// ½ Σ m |v|² [J] over all points. Not finite where a velocity is not.
  double kinetic_energy() const {
    return 0.5 *
           double((mass * (velocity.col(0).square() + velocity.col(1).square() + velocity.col(2).square())).sum());
  }
};

}  // namespace hooke
