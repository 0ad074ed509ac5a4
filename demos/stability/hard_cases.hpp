// The cases by what is hard about them; each file adds its own.
#pragma once

#include "stability.hpp"

namespace hooke::stability {

void add_loads(std::vector<Case>& out);   ///< mass ratio, many points, stiffness
void add_shocks(std::vector<Case>& out);  ///< bad starts, impacts, broken forces
void add_clocks(std::vector<Case>& out);  ///< frame times, pins, places, tiny steps, long runs
void add_rests(std::vector<Case>& out);   ///< rest and energy

}  // namespace hooke::stability
