// How far a scene's run is from the truth: estimated by halving its steps over a first part, or
// verified by a converged run of the whole.
#pragma once

#include <scene/scene.hpp>

#include <string>
#include <vector>

namespace hooke::scene {

/// Of one body at the end of the run.
struct Accuracy {
  std::string body;
  double error = 0;        ///< RMS over its points [m]
  double size = 0;         ///< diagonal of its box at the start [m]
  double uncertainty = 0;  ///< of the truth it was compared with [m]; 0 for estimates
};

struct ErrorEstimate {
  std::vector<Accuracy> bodies;
  double part = 0;  ///< of the run, that was repeated
  double cost = 0;  ///< force evaluations spent over those of the run
};

/// The part of a run that an estimate repeats.
inline constexpr double kEstimatedPart = 1.0 / 16;

/// Repeats the first part of the run with the steps it has and with half of them: their difference / (1 - 2^-p),
/// with p the method's order (1 where there are colliders), extrapolated to the end as the power of time
/// it was seen to grow with, between 0.5 and 2.5. Adaptive methods are compared at 1/32 of their tolerance.
/// Particle systems are left out. Motion that is rough or chaotic may err more. Cost: 3/16 of the run, told in the
/// answer.
/// @param like the scene whose run it is, in any state: what was chosen for it is kept
/// @throws hooke::Error where one of the two diverges
ErrorEstimate estimate_errors(const Scene& like);

/// Compares the end of a run of soft bodies with Blanes-Moan 6 (RK4 where forces take velocities) in double, its
/// steps halved until that changes it by less than a tenth of the error, at most 6 times.
/// Cost: tens of times the run's.
/// @param end a scene that was run to its end
/// @throws hooke::Error where the reference diverges
std::vector<Accuracy> verify_errors(const Scene& end);

}  // namespace hooke::scene
