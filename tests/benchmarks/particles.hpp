// Particle systems against the memory they live in.
#pragma once

#include "table.hpp"

namespace hooke::bench {

/// A pipeline of modules against an in-place read-modify-write of as many arrays.
Table particle_pipeline(bool quick);

/// What each module adds to the cost of a particle.
Table particle_modules(bool quick);

}  // namespace hooke::bench
