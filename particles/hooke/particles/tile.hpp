// A few hundred particles that stay in cache while all of a system's modules run over them.
#pragma once

#include <hooke/types.hpp>

#include <cstdint>

namespace hooke::particles {

/// A run of particles of one system. Coordinates are relative to the system's origin; arrays of `count` numbers, each
/// readable and writable up to the next multiple of kLanes.
template <class S>
struct Tile {
  static constexpr Index kLanes = 32;

  Index count = 0;
  S* x[3] = {};                           ///< position [m]
  S* v[3] = {};                           ///< velocity [m/s]
  const S* inverse_mass = nullptr;        ///< [1/kg]; null where all weigh the same
  S same_inverse_mass = 1;                ///< [1/kg], where they do
  const std::uint64_t* serial = nullptr;  ///< number of birth
};

}  // namespace hooke::particles
