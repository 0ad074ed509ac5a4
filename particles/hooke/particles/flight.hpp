// The innermost loop: legs of flight with bounces off planes, in registers from the first leg of a tick to the
// last. Internal to hooke::particles and not installed.
#pragma once

#include <hooke/particles/tile.hpp>

#include <span>
#include <vector>

namespace hooke::particles {

/// A half-space at the end of a leg.
template <class S>
struct Plane {
  S normal[3], offset;  ///< normal · x < offset is solid [m]
  S wall[3];            ///< its velocity [m/s]
  S bounce, friction;   ///< restitution, Coulomb's coefficient
  S slow;               ///< approach speed below which nothing bounces [m/s]
  S near;               ///< distance that counts as touching [m]
};

/// v ← v + gain v + add: what drag leaves is not rounded to a factor near 1.
template <class S>
struct Kick {
  S gain = 0, add[3] = {0, 0, 0};
};

/// A kick, then a drift x ← x + drift v that planes reflect.
template <class S>
struct Leg {
  Kick<S> kick;
  S drift = 0;  ///< [s]
};

/// An impact faster than `slow`.
template <class S>
struct Hit {
  Index particle;  ///< in the tile
  int leg;
  S speed;  ///< of approach [m/s]
  S position[3], normal[3];
};

template <class S>
struct Flight {
  std::span<const Leg<S>> legs;
  const Kick<S>* last = nullptr;     ///< a kick after the legs, or null
  bool settles = false;              ///< in the end, what presses slowly into a plane stops there
  const Plane<S>* planes = nullptr;  ///< plane_count a leg
  Index plane_count = 0;
  const S* skip = nullptr;              ///< planes let particles alone whose number here is not positive
  std::vector<Hit<S>>* hits = nullptr;  ///< where to tell impacts, or null
  int first_leg = 0;                    ///< number of legs[0], for hits
};

/// @return whether all positions and velocities are finite in the end
bool fly(const Tile<float>& tile, const Flight<float>& flight);
bool fly(const Tile<double>& tile, const Flight<double>& flight);

/// Planes alone, those of the first leg, after a drift that did not look at them.
void reflect(const Tile<float>& tile, const Flight<float>& flight);
void reflect(const Tile<double>& tile, const Flight<double>& flight);

/// v ← v + gain v + add + share a.
void kick(const Tile<float>& tile, const Kick<float>& kick, const float* const a[3], float share);
void kick(const Tile<double>& tile, const Kick<double>& kick, const double* const a[3], double share);

}  // namespace hooke::particles
