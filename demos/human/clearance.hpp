// Room between the limbs and the trunk of a body, and the motion that keeps it: cloth must
// fit where a recorded arm brushes past the hip. What the cloth is, is not known here.
#pragma once

#include <human/body.hpp>

#include <limits>

namespace hooke::human {

/// Distance [m] between the surfaces of two capsules, minus the depth when they overlap.
double gap(const Capsule& a, const Capsule& b);

/// Nearest capsules of two groups.
struct NearestPair {
  double gap = std::numeric_limits<double>::infinity();  ///< [m]
  int first = -1;                                        ///< index in the first group
  int second = -1;                                       ///< index in the second group
};
NearestPair nearest_pair(std::span<const Capsule> first, std::span<const Capsule> second);

/// Parts of a body between which cloth must fit. Armpits are left out: no cloth fits there.
struct LimbGroups {
  std::vector<BoneCapsule> left_arm;   ///< elbow (the last quarter of the upper arm), forearm, hand
  std::vector<BoneCapsule> right_arm;  ///< the same on the right
  std::vector<BoneCapsule> trunk;      ///< hips to chest and both thighs
};
LimbGroups limb_groups(std::span<const BoneCapsule> body);

/// Turn the arms of `motion` away at the shoulders, so that in every frame from `begin` on they
/// are `wanted` [m] clear of trunk and thighs. A turn rises and falls smoothly within `reach` [s]
/// before and after the frames that need it; elsewhere the motion stays exactly as it was, and so
/// do the frames before `begin`, which must be clear. `motion` has the joints of `body`.
/// Deterministic. Cost: about 10 µs a frame and a millisecond for each frame that was worst.
void keep_arms_clear(io::Motion& motion, const Body& body, double wanted, double reach, Index begin);

}  // namespace hooke::human
