// How driven things move.
#pragma once

#include <hooke/types.hpp>

#include <vector>

namespace hooke::scene {

/// Where something driven is, relative to its start, in shown time. Before time 0 it stands still.
struct Key {
  double time = 0;       ///< [s]
  Vec3 offset{0, 0, 0};  ///< [m]
};
struct Drive {
  Vec3 translate{0, 0, 0};  ///< [m/s]
  Vec3 swing{0, 0, 0};      ///< amplitude of a sine [m]
  double period = 1;        ///< of the sine [s]
  std::vector<Key> keys;    ///< instead of the above: a smooth path through these

  Vec3 offset(double t) const;  ///< [m]; a function of time alone
};

}  // namespace hooke::scene
