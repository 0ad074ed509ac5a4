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
  Sculptor(Body& body, std::span<const JointFrame> t_pose) : body_(body), frames_(t_pose) {}

  void middle(const std::string& name, const Vec3& a, const Vec3& b, double radius) {
    const int j = joint(body_.motion, name);
    const Quat back = frames_[static_cast<std::size_t>(j)].rotation.conjugate();
    body_.capsules.push_back({name, j, back * a, back * b, radius});
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
      const JointFrame& start = frames_[static_cast<std::size_t>(joint(body_.motion, prefix + name))];
      const JointFrame& end = frames_[static_cast<std::size_t>(joint(body_.motion, prefix + child))];
      const Vec3 bone = end.position - start.position;
      const Vec3 mirror(side, 1, 1);
      middle(prefix + name, from * bone + mirror.cwiseProduct(shift_a), to * bone + mirror.cwiseProduct(shift_b),
             radius);
    }
  }

 private:
  Body& body_;
  std::span<const JointFrame> frames_;
};

// Lengths in metres for a height of about 1.75 m.
void sculpt(Body& body, std::span<const JointFrame> t_pose) {
  Sculptor s(body, t_pose);
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
  // The sole: everything below ends on one level.
  const auto foot = t_pose[static_cast<std::size_t>(joint(body.motion, "LeftFoot"))];
  const auto toes = t_pose[static_cast<std::size_t>(joint(body.motion, "LeftToeBase"))];
  const Vec3 ball = toes.position - foot.position;
  const double sole = ball.y() - .027;
  s.both("Foot", {0, sole + .036, -.024}, {0, sole + .038, .02}, .036);
  s.both("Foot", {.004, -.004, .012}, {.018, sole + .029, ball.z()}, .029);
  s.both("Foot", {-.004, -.004, .012}, {-.018, sole + .029, ball.z()}, .029);
  s.both("ToeBase", {.018, 0, 0}, {.013, -.003, .05}, .024);
  s.both("ToeBase", {-.018, 0, 0}, {-.013, -.003, .045}, .024);
}

// Sets where a joint's frame points in space, given its parent's.
void set_global(const io::Motion& motion, std::vector<Quat>& global, int j, const Quat& rotation,
                io::LocalPose& pose) {
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
  sculpt(body, frames);

  io::global_pose(body.motion, standing(body, {.arms = 0.4}), frames);
  std::vector<Capsule> capsules(body.capsules.size());
  place_capsules(body, frames, capsules);
  const double factor = height / (top(capsules) - bottom(capsules));
  io::scale(body.motion, factor);
  for (BoneCapsule& c : body.capsules) {
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
  place_capsules(body, frames, capsules);
  if (!capsules.empty()) pose.root.y() -= bottom(capsules);
  return pose;
}

void place_capsules(const Body& body, std::span<const JointFrame> frames, std::span<Capsule> out) {
  assert(out.size() == body.capsules.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const BoneCapsule& c = body.capsules[i];
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
