// Feet that stay where they stand. A recorded skeleton fits its person only nearly, so feet
// drift while they carry the body; here they are held, and hips and knees give way.
#pragma once

#include <human/body.hpp>

namespace hooke::human {

/// Hold the ball of each foot in place on the floor while it stands, from the frame `begin` on:
/// the leg is bent and turned at hip and knee, the foot keeps its height and direction, the body
/// stays as it is. Between stances the shift goes over smoothly. Precondition: the floor is
/// y = 0 and the motion has the joints that make_body asks for. Deterministic. Cost: a few µs a frame.
void plant_feet(io::Motion& motion, Index begin);

}  // namespace hooke::human
