// Fast ways to move the points of one body, in a layout of their own.
#pragma once

#include <hooke/gang.hpp>
#include <hooke/point_masses.hpp>

#include <span>
#include <string_view>

namespace hooke {

/// A part of a splitting method's step: v += kick a(x); x += drift v.
struct Stage {
  double kick = 0, drift = 0;  ///< [s]
};

/// What positions and velocities are too small by, (n, 3) each; without rows where nothing is kept.
template <class S>
struct LowParts {
  Points<S> position{0, 3}, velocity{0, 3};
};

/// Runs splitting methods on the points of one body whose forces depend on position alone: the same
/// method as Integrator's, equal to it to rounding. What holds the forces makes it; it owns copies of the
/// points in the order and layout that suit it.
template <class S>
class Stepper {
 public:
  virtual ~Stepper() = default;

  /// Takes over positions, velocities and inverse masses. Low parts only matter to steppers that are more precise
  /// than S.
  /// @param gravity [m/s²], on free points  @param push acceleration of every point [m/s²], (n, 3), or null
  virtual void load(const PointMasses<S>& points, const LowParts<S>& low, const Vec3& gravity,
                    const Points<S>* push) = 0;
  /// @param gang threads that may share the work, or null; the same bits at any number of them
  virtual void run(std::span<const Stage> stages, Gang* gang) = 0;
  /// Writes positions and velocities back; low parts become what they are too small by, nothing where the stepper
  /// is no more precise than S.
  virtual void store(PointMasses<S>& points, LowParts<S>& low) const = 0;
  /// float, double or double-float: what the state is kept in from step to step.
  virtual std::string_view precision() const = 0;
};

}  // namespace hooke
