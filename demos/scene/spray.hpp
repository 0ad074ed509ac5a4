// Standard scenes of particle systems: many particles whose ways are known in closed form.
#pragma once

#include <scene/standard.hpp>

namespace hooke::scene {

/// 4,096 particles thrown in all directions against linear drag.
StandardScene spray_with_linear_drag();
/// 4,096 particles that fall at all speeds against quadratic drag.
StandardScene rain_with_quadratic_drag();

}  // namespace hooke::scene
