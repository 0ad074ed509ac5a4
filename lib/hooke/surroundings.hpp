// What a sleeping body would feel of its surroundings.
#pragma once

#include <hooke/collider.hpp>

namespace hooke {

/// Remembers where moving solids were near a body that sleeps, and tells when one near it moves.
/// Cost: one motion callback and a few distances a moving collider and tick; a distance callback is asked for
/// all points of the body. Solids that stand still cost nothing.
class Surroundings {
 public:
  /// @param points of the body, world [m], (n, 3)  @param thickness kept from colliders [m]
  void remember(std::span<const Collider> colliders, double t, const Points<double>& points, double thickness);

  /// True where a solid near the body is not where it was, or the colliders are others.
  bool changed(std::span<const Collider> colliders, double t);

 private:
  bool near(const Shape& shape) const;

  Points<double> points_{0, 3}, normal_{0, 3};
  Vec3 center_{0, 0, 0};
  double reach_ = 0;   // how far from its centre the body feels a solid [m]
  double margin_ = 0;  // … from each of its points [m]
  std::size_t colliders_ = 0;
  std::vector<std::vector<Shape>> shapes_;  // of moving colliders, in order
  std::vector<Values<double>> distances_;   // of callbacks, in order
  std::vector<Shape> now_;
  Values<double> distance_;
};

}  // namespace hooke
