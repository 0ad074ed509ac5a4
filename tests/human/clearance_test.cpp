#include <human/clearance.hpp>
#include <human/human.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using namespace hooke;
using human::BoneCapsule;
using human::Human;

// Two people who differ in nothing but their arms; how smooth the skin is does not matter here.
Human make_person(double limb_gap) {
  human::HumanSettings settings;
  settings.limb_gap = limb_gap;
  settings.skin.voxel_size = 0.0145;
  settings.skin.smoothing = 1;
  return Human(settings);
}

const Human& cleaned() {
  static const Human human = make_person(human::HumanSettings().limb_gap);
  return human;
}

const Human& recorded() {
  static const Human human = make_person(0);
  return human;
}

std::vector<Capsule> placed(const Human& who, const std::vector<BoneCapsule>& group, double t) {
  std::vector<io::JointFrame> joints(who.joint_names().size());
  who.pose(t, joints);
  std::vector<Capsule> capsules(group.size());
  human::place_capsules(group, joints, capsules);
  return capsules;
}

struct Moment {
  double gap = 1e9;
  double t = 0;
  std::string between;
};

// The moment from rest to the freeze when arms are nearest to trunk and thighs.
Moment nearest_moment(const Human& who) {
  const human::LimbGroups groups = human::limb_groups(who.bones());
  Moment nearest;
  for (double t = who.start_time(); t < who.freeze_time() + 0.1; t += 1.0 / 120) {
    const auto trunk = placed(who, groups.trunk, t);
    for (const auto& arm : {groups.left_arm, groups.right_arm}) {
      const auto pair = human::nearest_pair(placed(who, arm, t), trunk);
      if (pair.gap < nearest.gap)
        nearest = {pair.gap, t,
                   arm[static_cast<std::size_t>(pair.first)].bone + " and " +
                       groups.trunk[static_cast<std::size_t>(pair.second)].bone};
    }
  }
  return nearest;
}

// Greatest acceleration of arms and hands by central differences [m/s²].
double greatest_acceleration(const Human& who) {
  const human::LimbGroups groups = human::limb_groups(who.bones());
  constexpr double h = 1.0 / 120;
  double greatest = 0;
  for (double t = who.start_time(); t < who.freeze_time(); t += h)
    for (const auto& arm : {groups.left_arm, groups.right_arm}) {
      const auto before = placed(who, arm, t - h);
      const auto now = placed(who, arm, t);
      const auto after = placed(who, arm, t + h);
      for (std::size_t i = 0; i < now.size(); ++i)
        greatest = std::max(greatest, (before[i].b - 2 * now[i].b + after[i].b).norm() / (h * h));
    }
  return greatest;
}

TEST(CapsuleGap, IsTheDistanceOfTheSurfaces) {
  const Capsule x{{-1, 0, 0}, {1, 0, 0}, 0.1};
  EXPECT_NEAR(human::gap(x, {{0, 0.5, -1}, {0, 0.5, 1}, 0.2}), 0.2, 1e-15) << "crossing";
  EXPECT_NEAR(human::gap(x, {{-3, 0.5, 0}, {3, 0.5, 0}, 0.2}), 0.2, 1e-15) << "parallel";
  EXPECT_NEAR(human::gap(x, {{2, 0, 0}, {3, 0, 0}, 0.2}), 0.7, 1e-15) << "end to end";
  EXPECT_NEAR(human::gap(x, {{4, 4, 0}, {4, 4, 0}, 1}), 5 - 1.1, 1e-15) << "a sphere";
  EXPECT_NEAR(human::gap(x, {{0, 0.05, -1}, {0, 0.05, 1}, 0.1}), -0.15, 1e-15) << "overlapping";
}

TEST(CapsuleGap, IsNoMoreThanBetweenAnyTwoPoints) {
  constexpr unsigned seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto point = [&] { return Vec3(number(random), number(random), number(random)); };
  for (int pair = 0; pair < 200; ++pair) {
    const Capsule a{point(), point(), 0.1};
    const Capsule b{point(), point(), 0.2};
    double sampled = 1e9;
    for (int i = 0; i <= 400; ++i)
      sampled = std::min(sampled, signed_distance(b, a.a + i / 400.0 * (a.b - a.a)) - a.radius);
    EXPECT_LE(human::gap(a, b), sampled + 1e-12);
    EXPECT_GT(human::gap(a, b), sampled - 5e-3);
    EXPECT_NEAR(human::gap(a, b), human::gap(b, a), 1e-9);
  }
}

TEST(ArmClearance, LeavesRoomForClothAllTheTime) {
  const Moment nearest = nearest_moment(cleaned());
  EXPECT_GE(nearest.gap, 0.034) << nearest.between << " at " << nearest.t << " s";
  EXPECT_LT(nearest.gap, 0.05) << "the measure would see nothing";
}

TEST(ArmClearance, IsNotInTheRecording) {
  const Moment nearest = nearest_moment(recorded());
  EXPECT_LT(nearest.gap, 0) << nearest.between << " at " << nearest.t << " s";
}

TEST(ArmClearance, DoesNotJerkTheArms) {
  EXPECT_LT(greatest_acceleration(cleaned()), 1.2 * greatest_acceleration(recorded()));
}

TEST(ArmClearance, MovesNothingButTheArms) {
  for (double t = cleaned().start_time(); t < 7.1; t += 0.05) {
    const auto now = placed(cleaned(), cleaned().bones(), t);
    const auto as_recorded = placed(recorded(), cleaned().bones(), t);
    for (std::size_t i = 0; i < now.size(); ++i) {
      const std::string& bone = cleaned().bones()[i].bone;
      if (bone.ends_with("Arm") || bone.ends_with("Hand")) {
        EXPECT_LT((now[i].b - as_recorded[i].b).norm(), 0.25) << bone << " at " << t << " s";
      } else {
        EXPECT_EQ(now[i].b, as_recorded[i].b) << bone << " at " << t << " s";
      }
    }
  }
}

}  // namespace
