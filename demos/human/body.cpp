#include <hooke/error.hpp>
#include <human/body.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace hooke::human {
namespace {

using Quat = Eigen::Quaterniond;
using io::JointFrame;

constexpr double metres_per_unit = 0.0575;  // makes the recorded legs those of a 1.75 m person

int joint(const io::Motion& motion, const std::string& name) {
  const int found = motion.find(name);
  if (found < 0) throw Error("Human: the motion has no joint named " + name);
  return found;
}

Quat turn(double angle, const Vec3& axis) { return Quat(Eigen::AngleAxisd(angle, axis)); }

// The recorded skeleton has a short spine, short forearms and uneven shoulders; changing them
// does not move the feet. Its left leg is 2 % shorter, which leaves the left foot a centimetre
// in the air: both legs get the mean.
void give_ordinary_proportions(io::Motion& motion) {
  for (const char* name : {"Spine", "Spine1"}) motion.offsets[joint(motion, name)] *= 1.4;
  for (const char* name : {"Neck1", "Head"}) motion.offsets[joint(motion, name)] *= 0.9;
  // The middle of the body is in the middle.
  for (const char* name : {"Spine", "Spine1", "Neck1", "Head"})
    motion.offsets[joint(motion, name)] = motion.offsets[joint(motion, name)].norm() * Vec3::UnitY();
  for (const char* name : {"LeftUpLeg", "RightUpLeg"}) motion.offsets[joint(motion, name)].z() *= 0.5;
  for (const char* name : {"Leg", "Foot"}) {
    Vec3& left = motion.offsets[joint(motion, std::string("Left") + name)];
    Vec3& right = motion.offsets[joint(motion, std::string("Right") + name)];
    const double mean = (left.norm() + right.norm()) / 2;
    left *= mean / left.norm();
    right *= mean / right.norm();
  }
  for (const double side : {1.0, -1.0}) {
    const std::string prefix = side > 0 ? "Left" : "Right";
    motion.offsets[joint(motion, prefix + "Arm")] = Vec3(side * 3.0, 1.2, -0.36);
    motion.offsets[joint(motion, prefix + "ForeArm")] = Vec3(side * 5.05, 0, 0);
    motion.offsets[joint(motion, prefix + "Hand")] = Vec3(side * 4.3, 0, 0);
  }
}

// Adds capsules given in the axes of the T-pose (x to the left, y up, z forward) relative to
// a joint; what is on a side is given for the left and mirrored.
class Sculptor {
 public:
  Sculptor(const io::Motion& motion, std::span<const JointFrame> t_pose, std::vector<BoneCapsule>& to)
      : motion_(motion), frames_(t_pose), to_(to) {}

  double height(const std::string& name) const {
    return frames_[static_cast<std::size_t>(joint(motion_, name))].position.y();
  }
  void middle(const std::string& name, const Vec3& a, const Vec3& b, double radius) {
    const int j = joint(motion_, name);
    const Quat back = frames_[static_cast<std::size_t>(j)].rotation.conjugate();
    to_.push_back({name, j, back * a, back * b, radius});
  }
  void both(const std::string& name, const Vec3& a, const Vec3& b, double radius) {
    const Vec3 mirror(-1, 1, 1);
    middle("Left" + name, a, b, radius);
    middle("Right" + name, mirror.cwiseProduct(a), mirror.cwiseProduct(b), radius);
  }
  // The same on both sides of a bone in the middle.
  void pair(const std::string& name, const Vec3& a, const Vec3& b, double radius) {
    const Vec3 mirror(-1, 1, 1);
    middle(name, a, b, radius);
    middle(name, mirror.cwiseProduct(a), mirror.cwiseProduct(b), radius);
  }
  // Along the bone to a child joint, from one fraction of it to another.
  void along(const std::string& name, const std::string& child, double from, double to, double radius,
             const Vec3& shift_a = Vec3::Zero(), const Vec3& shift_b = Vec3::Zero()) {
    for (const double side : {1.0, -1.0}) {
      const std::string prefix = side > 0 ? "Left" : "Right";
      const JointFrame& start = frames_[static_cast<std::size_t>(joint(motion_, prefix + name))];
      const JointFrame& end = frames_[static_cast<std::size_t>(joint(motion_, prefix + child))];
      const Vec3 bone = end.position - start.position;
      const Vec3 mirror(side, 1, 1);
      middle(prefix + name, from * bone + mirror.cwiseProduct(shift_a), to * bone + mirror.cwiseProduct(shift_b),
             radius);
    }
  }
  // Many capsules between neighbouring stations, each a capsule: a shape that tapers.
  struct Station {
    Vec3 a, b;
    double radius;
  };
  void loft(const std::string& name, const std::vector<Station>& stations) {
    for (std::size_t s = 0; s + 1 < stations.size(); ++s) {
      const Station& from = stations[s];
      const Station& to = stations[s + 1];
      const double length = std::max((to.a - from.a).norm(), (to.b - from.b).norm());
      const int steps = std::max(1, static_cast<int>(std::ceil(length / 0.013)));
      for (int i = 0; i <= steps; ++i) {
        const double u = static_cast<double>(i) / steps;
        middle(name, from.a + u * (to.a - from.a), from.b + u * (to.b - from.b),
               from.radius + u * (to.radius - from.radius));
      }
    }
  }
  void loft_both(const std::string& name, std::vector<Station> stations) {
    loft("Left" + name, stations);
    for (Station& s : stations) s.a.x() *= -1, s.b.x() *= -1;
    loft("Right" + name, stations);
  }
  // Round stations along the bone to a child joint.
  struct Ring {
    double fraction, radius;
    Vec3 shift = Vec3::Zero();
  };
  void limb(const std::string& name, const std::string& child, const std::vector<Ring>& rings) {
    for (const double side : {1.0, -1.0}) {
      const std::string prefix = side > 0 ? "Left" : "Right";
      const JointFrame& start = frames_[static_cast<std::size_t>(joint(motion_, prefix + name))];
      const JointFrame& end = frames_[static_cast<std::size_t>(joint(motion_, prefix + child))];
      std::vector<Station> stations;
      for (const Ring& r : rings) {
        const Vec3 centre = r.fraction * (end.position - start.position) + Vec3(side, 1, 1).cwiseProduct(r.shift);
        stations.push_back({centre, centre, r.radius});
      }
      loft(prefix + name, stations);
    }
  }

 private:
  const io::Motion& motion_;
  std::span<const JointFrame> frames_;
  std::vector<BoneCapsule>& to_;
};

// The sole is flat: everything on it ends on one level, given here from the ankle.
double sole_level(const Vec3& ball) { return ball.y() - .027; }

// Lengths in metres for a height of about 1.75 m.
void sculpt_capsules(Sculptor s, const Vec3& ball) {
  // Torso, from below.
  s.middle("Hips", {-.07, -.03, .008}, {.07, -.03, .008}, .094);
  s.pair("Hips", {.06, -.088, -.014}, {.062, -.045, -.02}, .084);
  s.middle("LowerBack", {-.058, .045, .006}, {.058, .045, .006}, .087);
  s.middle("LowerBack", {-.05, .11, .006}, {.05, .11, .006}, .083);
  s.middle("Spine", {-.055, .005, .006}, {.055, .005, .006}, .086);
  s.middle("Spine", {-.069, .07, .006}, {.069, .07, .006}, .091);
  s.middle("Spine", {-.08, .13, .004}, {.08, .13, .004}, .094);
  s.middle("Spine1", {-.092, .022, .0}, {.092, .022, .0}, .086);
  s.pair("Spine1", {.105, -.04, -.012}, {.13, .03, -.018}, .056);
  // Shoulder girdle: from the neck down to the shoulder, and the collar bones.
  s.pair("Spine1", {.022, .115, -.02}, {.115, .07, -.024}, .046);
  s.along("Shoulder", "Arm", .3, .9, .053, Vec3::Zero(), {0, .002, 0});
  // Neck and head.
  s.middle("Neck", {0, .06, -.012}, {0, .1, -.006}, .06);
  s.middle("Neck1", {0, -.01, -.004}, {0, .11, .004}, .056);
  s.middle("Head", {0, .115, -.022}, {0, .12, .03}, .08);
  s.middle("Head", {0, .02, -.008}, {0, .1, -.026}, .066);
  s.middle("Head", {0, .07, .02}, {0, .1, .03}, .07);
  s.middle("Head", {0, .022, .05}, {0, .08, .05}, .053);
  // Arms.
  s.along("Arm", "ForeArm", .0, .24, .052, {-.006, -.004, 0});
  s.along("Arm", "ForeArm", .15, .6, .046);
  s.along("Arm", "ForeArm", .5, 1, .041);
  s.along("ForeArm", "Hand", .08, .35, .042);
  s.along("ForeArm", "Hand", .25, .68, .036);
  s.along("ForeArm", "Hand", .6, 1, .03);
  s.both("Hand", {.005, 0, .01}, {.085, 0, .021}, .021);
  s.both("Hand", {.005, 0, -.01}, {.085, 0, -.021}, .021);
  s.both("Hand", {.09, -.004, .018}, {.16, -.025, .012}, .0155);
  s.both("Hand", {.09, -.004, -.018}, {.15, -.025, -.012}, .0155);
  s.both("Hand", {.025, -.004, .03}, {.078, -.014, .05}, .0135);
  // Legs.
  s.along("UpLeg", "Leg", .0, .25, .083, {.006, 0, 0}, {.003, 0, .006});
  s.along("UpLeg", "Leg", .15, .62, .073, {.003, 0, .006}, {0, 0, .006});
  s.along("UpLeg", "Leg", .5, 1, .061, {0, 0, .005});
  s.along("Leg", "Foot", .1, .38, .056, {0, 0, -.002}, {0, 0, -.012});
  s.along("Leg", "Foot", .3, .66, .046, {0, 0, -.01}, {0, 0, -.006});
  s.along("Leg", "Foot", .6, .97, .037);
  const double sole = sole_level(ball);
  s.both("Foot", {0, sole + .036, -.024}, {0, sole + .038, .02}, .036);
  s.both("Foot", {.004, -.004, .012}, {.018, sole + .029, ball.z()}, .029);
  s.both("Foot", {-.004, -.004, .012}, {-.018, sole + .029, ball.z()}, .029);
  s.both("ToeBase", {.018, 0, 0}, {.013, -.003, .05}, .024);
  s.both("ToeBase", {-.018, 0, 0}, {-.013, -.003, .045}, .024);
}

// The same body with smooth transitions; not far outside the capsules anywhere.
void sculpt_flesh(Sculptor s, const Vec3& ball) {
  const auto across = [](double half, double y, double z, double radius) {
    return Sculptor::Station{{-half, y, z}, {half, y, z}, radius};
  };
  const auto at = [](double y, double z, double radius) { return Sculptor::Station{{0, y, z}, {0, y, z}, radius}; };
  const double waist = s.height("Hips");
  const double ribs = s.height("Spine") - waist;
  const double chest = s.height("Spine1") - waist;
  s.loft("Hips", {across(.07, -.04, .006, .092), across(.068, -.01, .007, .092), across(.06, .05, .006, .086),
                  across(.053, .105, .006, .083), across(.056, ribs + .01, .006, .086),
                  across(.069, ribs + .07, .006, .091), across(.08, ribs + .13, .004, .092),
                  across(.09, chest + .025, -.001, .085), across(.06, chest + .05, -.008, .072)});
  s.pair("Hips", {.06, -.086, -.014}, {.062, -.045, -.016}, .083);
  s.pair("Spine1", {.1, -.04, -.012}, {.125, .03, -.018}, .055);
  s.pair("Spine1", {.022, .112, -.02}, {.115, .07, -.024}, .046);
  s.limb("Shoulder", "Arm", {{.3, .055}, {.9, .053, {0, .002, 0}}});
  s.loft("Neck", {at(.06, -.014, .066), at(.1, -.006, .058), at(.15, -.002, .054), at(.2, .004, .055)});
  s.loft("Head", {{{0, .115, -.022}, {0, .12, .03}, .08},
                  {{0, .08, .01}, {0, .09, .038}, .07},
                  {{0, .022, .05}, {0, .06, .05}, .053}});
  s.loft("Head", {at(.1, -.028, .072), at(.06, -.018, .066), at(.0, -.004, .056)});
  s.middle("Head", {0, .122, -.008}, {0, .124, .016}, .081);
  s.limb("Arm", "ForeArm", {{0, .05, {-.004, -.004, 0}}, {.2, .051}, {.5, .045}, {.85, .04}, {1, .04}});
  s.limb("ForeArm", "Hand", {{0, .04}, {.18, .042}, {.45, .038}, {.85, .029}, {1, .027}});
  s.loft_both("Hand", {{{0, 0, -.006}, {0, 0, .006}, .025},
                       {{.04, 0, -.018}, {.04, 0, .018}, .0215},
                       {{.085, 0, -.023}, {.085, 0, .023}, .019},
                       {{.13, -.012, -.018}, {.125, -.012, .019}, .016},
                       {{.155, -.025, -.01}, {.16, -.025, .01}, .0145}});
  s.both("Hand", {.03, -.004, .028}, {.078, -.014, .05}, .0135);
  s.limb("UpLeg", "Leg",
         {{0, .081, {.005, 0, 0}},
          {.2, .083, {.004, 0, .004}},
          {.5, .074, {.001, 0, .006}},
          {.85, .062, {0, 0, .004}},
          {1, .058}});
  s.limb("Leg", "Foot",
         {{0, .058},
          {.12, .055, {0, 0, -.004}},
          {.3, .057, {0, 0, -.011}},
          {.55, .048, {0, 0, -.008}},
          {.85, .038},
          {1, .037}});
  const double sole = sole_level(ball);
  s.both("Foot", {0, sole + .037, -.024}, {0, sole + .039, .02}, .037);
  for (const double side : {1.0, -1.0})
    s.loft_both("Foot",
                {{{side * .003, -.004, .01}, {side * .003, -.004, .01}, .032},
                 {{side * .018, sole + .029, ball.z()}, {side * .018, sole + .029, ball.z()}, .029},
                 {{side * .013, sole + .024, ball.z() + .048}, {side * .013, sole + .024, ball.z() + .048}, .024}});
}

// Sets where a joint's frame points in space, given its parent's.
void set_global(const io::Motion& motion, std::vector<Quat>& global, int j, const Quat& rotation, io::LocalPose& pose) {
  const int parent = motion.parents[static_cast<std::size_t>(j)];
  global[static_cast<std::size_t>(j)] = rotation;
  pose.rotations[static_cast<std::size_t>(j)] =
      parent < 0 ? rotation : Quat(global[static_cast<std::size_t>(parent)].conjugate() * rotation);
}

}  // namespace

Body make_body(io::Motion recording, double height) {
  Body body;
  give_ordinary_proportions(recording);
  io::scale(recording, metres_per_unit);
  if (recording.frame_count() < 2) throw Error("Human: the motion must have more than one frame");
  io::local_pose(recording, recording.first_time, body.t_pose);
  io::drop_frames(recording, 1);
  body.t_pose.root.setZero();
  body.motion = std::move(recording);

  std::vector<JointFrame> frames(static_cast<std::size_t>(body.motion.joint_count()));
  io::global_pose(body.motion, body.t_pose, frames);
  const Vec3 ball = frames[static_cast<std::size_t>(joint(body.motion, "LeftToeBase"))].position -
                    frames[static_cast<std::size_t>(joint(body.motion, "LeftFoot"))].position;
  sculpt_capsules(Sculptor(body.motion, frames, body.capsules), ball);
  sculpt_flesh(Sculptor(body.motion, frames, body.flesh), ball);

  io::global_pose(body.motion, standing(body, {.arms = 0.4}), frames);
  std::vector<Capsule> capsules(body.capsules.size());
  place_capsules(body.capsules, frames, capsules);
  const double factor = height / (top(capsules) - bottom(capsules));
  io::scale(body.motion, factor);
  for (auto* part : {&body.capsules, &body.flesh})
    for (BoneCapsule& c : *part) {
      c.a *= factor;
      c.b *= factor;
      c.radius *= factor;
    }
  return body;
}

io::LocalPose standing(const Body& body, const Stance& stance) {
  const io::Motion& motion = body.motion;
  std::vector<JointFrame> frames(static_cast<std::size_t>(motion.joint_count()));
  io::global_pose(motion, body.t_pose, frames);
  std::vector<Quat> extra(frames.size(), Quat::Identity());  // turn in T-pose axes, relative to the parent's
  const auto set = [&](const std::string& name, const Quat& q) {
    extra[static_cast<std::size_t>(joint(motion, name))] = q;
  };
  for (const double side : {1.0, -1.0}) {
    const std::string prefix = side > 0 ? "Left" : "Right";
    const Vec3 forward = side * Vec3::UnitZ();
    set(prefix + "Shoulder", turn(-stance.shoulder, forward));
    set(prefix + "Arm", turn(stance.shoulder + stance.arms - std::numbers::pi / 2, forward));
    set(prefix + "ForeArm", turn(-stance.elbows, side * Vec3::UnitY()));
    set(prefix + "UpLeg", turn(stance.legs, forward));
    set(prefix + "Foot", turn(-stance.legs, forward));
  }
  io::LocalPose pose = body.t_pose;
  std::vector<Quat> turned(frames.size());
  std::vector<Quat> global(frames.size());
  for (std::size_t j = 0; j < frames.size(); ++j) {
    const int parent = motion.parents[j];
    turned[j] = parent < 0 ? extra[j] : Quat(turned[static_cast<std::size_t>(parent)] * extra[j]);
    set_global(motion, global, static_cast<int>(j), turned[j] * frames[j].rotation, pose);
  }
  pose.root.setZero();
  io::global_pose(motion, pose, frames);
  std::vector<Capsule> capsules(body.capsules.size());
  place_capsules(body.capsules, frames, capsules);
  if (!capsules.empty()) pose.root.y() -= bottom(capsules);
  return pose;
}

void place_capsules(std::span<const BoneCapsule> capsules, std::span<const JointFrame> frames, std::span<Capsule> out) {
  assert(out.size() == capsules.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const BoneCapsule& c = capsules[i];
    const JointFrame& frame = frames[static_cast<std::size_t>(c.joint)];
    out[i].a = frame * c.a;
    out[i].b = frame * c.b;
    out[i].radius = c.radius;
  }
}

double bottom(std::span<const Capsule> capsules) {
  double y = 1e300;
  for (const Capsule& c : capsules) y = std::min(y, std::min(c.a.y(), c.b.y()) - c.radius);
  return y;
}

double top(std::span<const Capsule> capsules) {
  double y = -1e300;
  for (const Capsule& c : capsules) y = std::max(y, std::max(c.a.y(), c.b.y()) + c.radius);
  return y;
}

}  // namespace hooke::human
