#include <human/human.hpp>

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using namespace hooke;
using human::Human;

Human make_person(bool plant_feet) {
  human::HumanSettings settings;
  settings.plant_feet = plant_feet;
  settings.limb_gap = 0;
  settings.skin.voxel_size = 0.0145;  // how smooth the skin is does not matter here
  settings.skin.smoothing = 1;
  return Human(settings);
}

const Human& planted() {
  static const Human human = make_person(true);
  return human;
}

const Human& recorded() {
  static const Human human = make_person(false);
  return human;
}

io::JointFrame joint_at(const Human& who, const std::string& name, double t) {
  const auto& names = who.joint_names();
  std::vector<io::JointFrame> joints(names.size());
  who.pose(t, joints);
  return joints[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
}

// Lowest point of a foot [m].
double sole(const Human& who, const std::string& side, double t) {
  std::vector<Capsule> capsules(static_cast<std::size_t>(who.capsule_count()));
  who.capsules(t, capsules);
  double y = 1e9;
  for (std::size_t i = 0; i < capsules.size(); ++i)
    if (who.bones()[i].bone == side + "Foot" || who.bones()[i].bone == side + "ToeBase")
      y = std::min(y, std::min(capsules[i].a.y(), capsules[i].b.y()) - capsules[i].radius);
  return y;
}

// How much of the time in which a foot is at the floor its ball is slower than 3 cm/s.
double still_share(const Human& who) {
  constexpr double h = 1.0 / 240;
  int at_floor = 0;
  int still = 0;
  for (const char* side : {"Left", "Right"})
    for (double t = h; t < who.freeze_time() - 0.3; t += 2 * h) {
      if (sole(who, side, t) > 0.02) continue;
      const std::string ball = std::string(side) + "ToeBase";
      Vec3 way = joint_at(who, ball, t + h).position - joint_at(who, ball, t - h).position;
      way.y() = 0;
      ++at_floor;
      if (way.norm() / (2 * h) < 0.03) ++still;
    }
  return static_cast<double>(still) / at_floor;
}

double greatest_acceleration(const Human& who, const std::string& joint) {
  constexpr double h = 1.0 / 120;
  double greatest = 0;
  for (double t = who.start_time(); t < who.freeze_time(); t += h)
    greatest = std::max(greatest, (joint_at(who, joint, t - h).position - 2 * joint_at(who, joint, t).position +
                                   joint_at(who, joint, t + h).position)
                                          .norm() /
                                      (h * h));
  return greatest;
}

TEST(Footing, HoldsStandingFeetInPlace) {
  EXPECT_LT(still_share(recorded()), 0.5);
  EXPECT_GT(still_share(planted()), 0.8);
}

TEST(Footing, DoesNotJerkTheLegs) {
  for (const char* joint : {"LeftLeg", "LeftFoot", "RightLeg", "RightFoot"})
    EXPECT_LT(greatest_acceleration(planted(), joint), 1.1 * greatest_acceleration(recorded(), joint)) << joint;
}

TEST(Footing, KeepsBodyAndHeightOfFeet) {
  for (double t = planted().start_time(); t < 7.1; t += 0.02) {
    EXPECT_EQ(joint_at(planted(), "Spine", t).position, joint_at(recorded(), "Spine", t).position) << t;
    for (const char* side : {"Left", "Right"}) {
      EXPECT_NEAR(sole(planted(), side, t), sole(recorded(), side, t), 0.004) << side << " at " << t;
      const std::string foot = std::string(side) + "Foot";
      EXPECT_LT((joint_at(planted(), foot, t).position - joint_at(recorded(), foot, t).position).norm(), 0.12) << t;
      EXPECT_LT(joint_at(planted(), foot, t).rotation.angularDistance(joint_at(recorded(), foot, t).rotation), 1e-3);
    }
  }
}

}  // namespace
