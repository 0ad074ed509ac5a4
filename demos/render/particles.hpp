// Sparks, smoke and drops: what to draw of them, and the light that hot things give.
#pragma once

#include <render/image.hpp>

#include <hooke/types.hpp>

#include <span>
#include <string>
#include <vector>

namespace hooke::render {

/// Many particles of one kind and how to draw them. What the pointers name must live until
/// draw() returns. Arrays have one row a particle; null ones take the value named.
struct Particles {
  enum class Kind {
    Sparks,  ///< streaks of their own light, along the way they went while the shutter was open
    Smoke,   ///< soft puffs that hide what is behind them, lit by the studio and by sparks; also foam
    Drops    ///< clear balls that bend and reflect the light, drawn out along their way
  };
  Kind kind = Kind::Sparks;
  const Points<float>* positions = nullptr;   ///< required [m], where they are when the shutter closes
  const Points<float>* velocities = nullptr;  ///< [m/s], required for sparks; null: at rest. Smoke has no use for it
  /// Linear RGB. Sparks (required): the radiance of the glowing ball, on the scale where a
  /// lit white surface is 1, so thousands are usual. Smoke: reflectance. Drops: what is left
  /// of light that goes through. Null: white.
  const Points<float>* colors = nullptr;
  const Values<float>* radii = nullptr;      ///< required [m]
  const Values<float>* opacities = nullptr;  ///< share hidden at the middle, in [0, 1]; null: 1. Not for sparks
  const Values<float>* turns = nullptr;      ///< smoke: turns the puff and picks its pattern [rad]; null: 0
  const Values<float>* ages = nullptr;       ///< [s]; a streak is not longer than its particle is old; null: old
  double shutter = 1.0 / 60;                 ///< how long the shutter was open [s]
  /// Smoke: one puff on black instead of the built-in ones. The brightest channel is how
  /// much it hides, the hue multiplies `colors`.
  const Image* texture = nullptr;
};

/// Throws std::invalid_argument that names the array and the first particle at fault if
/// one is missing, has another length than positions, or holds what cannot be drawn.
void require_drawable(const Particles& particles);

/// Linear sRGB of a black body at that temperature, relative to the luminance of one at
/// 2000 K: Planck's law through the analytic colour matching functions of Wyman, Sloan and
/// Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT
/// 2(2), 2013. What sRGB cannot show (blue below 1900 K) is 0. `kelvin` must be in
/// [500, 50000]; throws std::invalid_argument.
Vec3 black_body(double kelvin);

/// A small light that stands for many sparks.
struct Lamp {
  Vec3 place{0, 0, 0};  ///< [m]
  Vec3 power{0, 0, 0};  ///< [m²]; a white surface far away that faces it is power / distance² bright
  double size = 0;      ///< [m], how far its sparks are from `place` (root of the mean square)

  /// The mean of 1 / distance² from sparks spread by `size` [1/m²]: exact to second order
  /// far away, bounded within. `least` [m] widens the lamp.
  double falloff(const Vec3& from, double least = 0) const;
};

/// At most `most` lamps that together give the light of all sparks. The same sparks give
/// the same lamps. Costs a few times sparks · lamps.
std::vector<Lamp> lamps_of(std::span<const Particles> particles, int most = 16);

}  // namespace hooke::render
