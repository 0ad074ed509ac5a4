#include <human/clearance.hpp>

#include <algorithm>
#include <cmath>

namespace hooke::human {
namespace {

using Quat = Eigen::Quaterniond;

// The nearest points of two segments.
struct Nearest {
  Vec3 first;
  Vec3 second;
};

// Ericson, Real-Time Collision Detection, 5.1.9: clamp the first parameter, then the second,
// then the first again.
Nearest nearest_of_segments(const Capsule& one, const Capsule& two) {
  const Vec3 d1 = one.b - one.a;
  const Vec3 d2 = two.b - two.a;
  const Vec3 between = one.a - two.a;
  const double length1 = d1.squaredNorm();
  const double along = d1.dot(d2);
  const double determinant = length1 * d2.squaredNorm() - along * along;
  double s = 0;
  if (determinant > 1e-14)
    s = std::clamp((along * d2.dot(between) - d1.dot(between) * d2.squaredNorm()) / determinant, 0.0, 1.0);
  const Vec3 second = nearest_on_segment(two.a, two.b, one.a + s * d1);
  const Vec3 first = nearest_on_segment(one.a, one.b, second);
  return {first, nearest_on_segment(two.a, two.b, first)};
}

// Smooth to the second derivative: 1 at 0, 0 from ±1 on.
double bump(double u) { return std::abs(u) < 1 ? std::pow(1 - u * u, 3) : 0; }

Quat rotation(const Vec3& vector) {
  const double angle = vector.norm();
  return angle > 0 ? Quat(Eigen::AngleAxisd(angle, vector / angle)) : Quat::Identity();
}

// One arm that is turned at its shoulder.
class ArmCleaner {
 public:
  ArmCleaner(io::Motion& motion, const Body& body, const std::string& side, double wanted)
      : motion_(motion), body_(body), arm_(body.motion.find(side + "Arm")), wanted_(wanted) {
    LimbGroups groups = limb_groups(body.capsules);
    limb_ = side == "Left" ? std::move(groups.left_arm) : std::move(groups.right_arm);
    trunk_ = std::move(groups.trunk);
    limb_capsules_.resize(limb_.size());
    trunk_capsules_.resize(trunk_.size());
    const auto frames = static_cast<std::size_t>(motion.frame_count());
    for (std::size_t f = 0; f < frames; ++f) recorded_.push_back(rotation_of(f));
    turns_.assign(frames, Vec3::Zero());
    gaps_.resize(frames);
    joints_.resize(static_cast<std::size_t>(motion.joint_count()));
  }

  // Again and again gives the frame that needs it most room, and the frames around it some.
  void clear(double reach, Index begin) {
    constexpr int most_rounds = 2000;
    constexpr double tolerance = 2e-4;  // [m]
    const Index frames = motion_.frame_count();
    const double width = reach * motion_.frame_rate;
    const Index free = std::min(frames - 1, begin + static_cast<Index>(width / 4));  // where turns are possible
    for (Index f = 0; f < frames; ++f) measure(static_cast<std::size_t>(f));
    for (int round = 0; round < most_rounds; ++round) {
      const Index worst = std::min_element(gaps_.begin() + free, gaps_.end()) - gaps_.begin();
      if (gaps_[static_cast<std::size_t>(worst)] > wanted_ - tolerance) break;
      const Vec3 turn = turn_away(static_cast<std::size_t>(worst));
      const auto half = static_cast<Index>(width);
      for (Index f = std::max(begin, worst - half); f <= std::min(frames - 1, worst + half); ++f) {
        const double calm = 1 - bump(static_cast<double>(f - begin) / width);  // zero at `begin`
        apply(static_cast<std::size_t>(f), calm * bump(static_cast<double>(f - worst) / width) * turn);
      }
    }
  }

 private:
  Quat& rotation_of(std::size_t frame) {
    return motion_.rotations[frame * static_cast<std::size_t>(motion_.joint_count()) + static_cast<std::size_t>(arm_)];
  }

  NearestPair measure(std::size_t frame) {
    io::local_pose(motion_, motion_.first_time + static_cast<double>(frame) / motion_.frame_rate, pose_);
    io::global_pose(motion_, pose_, joints_);
    place_capsules(limb_, joints_, limb_capsules_);
    place_capsules(trunk_, joints_, trunk_capsules_);
    const NearestPair pair = nearest_pair(limb_capsules_, trunk_capsules_);
    gaps_[frame] = pair.gap;
    return pair;
  }

  // The smallest turn that gives a frame its room, as a rotation vector in the parent's frame:
  // the gap grows by turn · (arm × normal).
  Vec3 turn_away(std::size_t frame) {
    const NearestPair pair = measure(frame);
    const Nearest nearest = nearest_of_segments(limb_capsules_[static_cast<std::size_t>(pair.first)],
                                                trunk_capsules_[static_cast<std::size_t>(pair.second)]);
    const Vec3 normal = (nearest.first - nearest.second).normalized();
    const Vec3 arm = nearest.first - joints_[static_cast<std::size_t>(arm_)].position;
    const Vec3 gradient = arm.cross(normal);
    constexpr double most = 0.1;  // [rad] at a time
    const double angle = std::min(most, (wanted_ - pair.gap) / std::max(gradient.norm(), 1e-3));
    const int parent = body_.motion.parents[static_cast<std::size_t>(arm_)];
    return joints_[static_cast<std::size_t>(parent)].rotation.conjugate() * (angle * gradient.normalized());
  }

  void apply(std::size_t frame, const Vec3& turn) {
    turns_[frame] += turn;
    const Quat& recorded = recorded_[frame];
    Quat turned = rotation(turns_[frame]) * recorded;
    if (turned.dot(recorded) < 0) turned.coeffs() *= -1;
    rotation_of(frame) = turned;
    measure(frame);
  }

  io::Motion& motion_;
  const Body& body_;
  int arm_;
  double wanted_;
  std::vector<BoneCapsule> limb_;
  std::vector<BoneCapsule> trunk_;
  std::vector<Quat> recorded_;
  std::vector<Vec3> turns_;  // rotation vectors, one a frame
  std::vector<double> gaps_;
  io::LocalPose pose_;
  std::vector<io::JointFrame> joints_;
  std::vector<Capsule> limb_capsules_;
  std::vector<Capsule> trunk_capsules_;
};

}  // namespace

double gap(const Capsule& a, const Capsule& b) {
  const Nearest nearest = nearest_of_segments(a, b);
  return (nearest.first - nearest.second).norm() - a.radius - b.radius;
}

NearestPair nearest_pair(std::span<const Capsule> first, std::span<const Capsule> second) {
  NearestPair nearest;
  for (std::size_t i = 0; i < first.size(); ++i)
    for (std::size_t k = 0; k < second.size(); ++k) {
      const double d = gap(first[i], second[k]);
      if (d < nearest.gap) nearest = {d, static_cast<int>(i), static_cast<int>(k)};
    }
  return nearest;
}

LimbGroups limb_groups(std::span<const BoneCapsule> body) {
  LimbGroups groups;
  for (BoneCapsule capsule : body) {
    const bool left = capsule.bone.starts_with("Left");
    const bool right = capsule.bone.starts_with("Right");
    const std::string part = capsule.bone.substr(left ? 4 : right ? 5 : 0);
    if (part == "Hips" || part == "LowerBack" || part == "Spine" || part == "Spine1" || part == "UpLeg")
      groups.trunk.push_back(capsule);
    if (part == "Arm") {
      if (capsule.a.norm() < 0.45 * capsule.b.norm()) continue;
      capsule.a = (capsule.a + capsule.b) / 2;  // the lower half of the arm's lower half
    }
    if (part == "Arm" || part == "ForeArm" || part == "Hand")
      (left ? groups.left_arm : groups.right_arm).push_back(capsule);
  }
  return groups;
}

void keep_arms_clear(io::Motion& motion, const Body& body, double wanted, double reach, Index begin) {
  for (const char* side : {"Left", "Right"}) ArmCleaner(motion, body, side, wanted).clear(reach, begin);
}

}  // namespace hooke::human
