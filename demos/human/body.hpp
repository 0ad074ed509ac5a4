// The body that is put on the recorded skeleton: proportions, the capsules on its bones and
// how it stands at rest. Time and deformation are not known here.
#pragma once

#include <hooke/io/motion.hpp>
#include <hooke/shapes.hpp>

#include <span>
#include <string>
#include <vector>

namespace hooke::human {

/// A capsule that moves rigidly with one joint.
struct BoneCapsule {
  std::string bone;   ///< name of the joint
  int joint = 0;      ///< index of the joint
  Vec3 a{0, 0, 0};    ///< [m] in the joint's frame
  Vec3 b{0, 0, 0};    ///< [m] in the joint's frame
  double radius = 0;  ///< [m]
};

/// How a standing person holds arms and legs [rad].
struct Stance {
  double arms = 0;      ///< angle of the upper arms to the vertical, outward
  double elbows = 0;    ///< flexion
  double legs = 0;      ///< angle of the legs to the vertical, outward
  double shoulder = 0;  ///< drop of the shoulder girdle
};

/// A skeleton in metres with its motion, and the capsules on it.
struct Body {
  io::Motion motion;                  ///< [m], without the T-pose of frame 0
  io::LocalPose t_pose;               ///< upright, arms sideways, facing +z, up is +y
  std::vector<BoneCapsule> capsules;  ///< what others collide with, left and right alike
  std::vector<BoneCapsule> flesh;     ///< finer ones that taper smoothly, for the skin
};

/// An athletic person of `height` [m] on the skeleton of the recording. Spine, shoulders and
/// forearms get ordinary proportions; legs keep the recorded ones, or the feet would slide.
/// Throws hooke::Error when a joint is missing.
Body make_body(io::Motion recording, double height);

/// The body standing, facing +z, hips above the origin, lowest point at y = 0.
io::LocalPose standing(const Body& body, const Stance& stance);

/// Capsules on joints, in the space of the joints. Precondition: out.size() == capsules.size().
void place_capsules(std::span<const BoneCapsule> capsules, std::span<const io::JointFrame> frames,
                    std::span<Capsule> out);

/// Lowest and highest y [m] of capsules.
double bottom(std::span<const Capsule> capsules);
double top(std::span<const Capsule> capsules);

}  // namespace hooke::human
