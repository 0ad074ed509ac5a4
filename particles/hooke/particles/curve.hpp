// Numbers and colours that change over time or over a particle's life.
#pragma once

#include <hooke/types.hpp>

#include <vector>

namespace hooke::particles {

/// Straight between its points, constant before the first and after the last.
class Curve {
 public:
  Curve(double constant = 0);  // NOLINT: a number is a curve
  /// @param times increasing  @param values as many, finite
  /// @throws std::invalid_argument naming the index and the rule
  Curve(std::vector<double> times, std::vector<double> values);

  double operator()(double t) const;
  double least() const;
  double most() const;

  /// ∫ from the first time, or 0 for a constant, to t. For curves without negative values it grows with t.
  double integral(double t) const;
  /// The first t at which the integral is `value`. Where it never is: infinity.
  double inverse_integral(double value) const;

 private:
  std::vector<double> times_, values_, sums_;  // sums_: the integral at each time
};

/// Linear RGB over age as a share of life: straight between its points.
struct ColorRamp {
  std::vector<double> ages{0};              ///< increasing, in [0, 1]
  std::vector<Vec3> colors{Vec3(1, 1, 1)};  ///< as many

  Vec3 operator()(double age) const;
  /// @throws std::invalid_argument
  void check() const;
};

}  // namespace hooke::particles
