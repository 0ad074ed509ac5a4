// Particle systems will live here. Today a particle is a point of a hooke::PointBody
// without springs; this header keeps the target's include path alive.
#pragma once

#include <hooke/types.hpp>
