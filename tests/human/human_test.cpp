#include <hooke/error.hpp>
#include <human/human.hpp>

#include <vdb/closed_mesh.hpp>

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

namespace {

using namespace hooke;
using human::Human;
using testing::HasSubstr;

// Built once: the skin takes a second.
const Human& person() {
  static const Human human;
  return human;
}

std::vector<Capsule> capsules_at(double t) {
  std::vector<Capsule> capsules(static_cast<std::size_t>(person().capsule_count()));
  person().capsules(t, capsules);
  return capsules;
}

double lowest(const std::string& part, const std::vector<Capsule>& capsules) {
  double y = 1e9;
  for (std::size_t i = 0; i < capsules.size(); ++i)
    if (person().bones()[i].bone.find(part) != std::string::npos)
      y = std::min(y, std::min(capsules[i].a.y(), capsules[i].b.y()) - capsules[i].radius);
  return y;
}

// Greatest speed of a capsule's end by central differences [m/s].
double greatest_speed(double t, double h) {
  const auto before = capsules_at(t - h);
  const auto after = capsules_at(t + h);
  double speed = 0;
  for (std::size_t i = 0; i < before.size(); ++i)
    speed = std::max({speed, (after[i].a - before[i].a).norm() / (2 * h), (after[i].b - before[i].b).norm() / (2 * h)});
  return speed;
}

// Greatest difference between the velocities right before and right after t [m/s].
double velocity_jump(double t, double h) {
  const auto before = capsules_at(t - h);
  const auto at = capsules_at(t);
  const auto after = capsules_at(t + h);
  double jump = 0;
  for (std::size_t i = 0; i < at.size(); ++i)
    jump = std::max({jump, (after[i].a - 2 * at[i].a + before[i].a).norm() / h,
                     (after[i].b - 2 * at[i].b + before[i].b).norm() / h});
  return jump;
}

TEST(Human, StandsUprightAtTheAskedHeight) {
  const auto capsules = capsules_at(person().start_time());
  EXPECT_NEAR(human::top(capsules) - human::bottom(capsules), 1.75, 0.01);
  EXPECT_NEAR(lowest("LeftFoot", capsules), 0, 0.005);
  EXPECT_NEAR(lowest("RightFoot", capsules), 0, 0.005);
  EXPECT_GT(lowest("Head", capsules), 1.4);
  human::HumanSettings tall;
  tall.height = 2;
  tall.skin.voxel_size = 0.02;
  const Human other(tall);
  std::vector<Capsule> now(static_cast<std::size_t>(other.capsule_count()));
  other.capsules(other.start_time(), now);
  EXPECT_NEAR(human::top(now) - human::bottom(now), 2, 0.01);
}

TEST(Human, ArmsHangClearOfTheBodyAtRest) {
  const auto capsules = capsules_at(person().start_time());
  double gap = 1e9;
  for (std::size_t i = 0; i < capsules.size(); ++i)
    for (std::size_t k = 0; k < capsules.size(); ++k) {
      const std::string& hand = person().bones()[i].bone;
      const std::string& leg = person().bones()[k].bone;
      if (hand.find("Hand") == std::string::npos || leg.find("UpLeg") == std::string::npos) continue;
      gap = std::min(gap, signed_distance(capsules[k], capsules[i].a) - capsules[i].radius);
      gap = std::min(gap, signed_distance(capsules[k], capsules[i].b) - capsules[i].radius);
    }
  EXPECT_GT(gap, 0.02);
}

TEST(Human, FeetNeverSinkAndOneStandsOnTheFloor) {
  double deepest = 1;
  int standing = 0;
  int frames = 0;
  for (double t = 0; t <= 7.1; t += 1.0 / 120, ++frames) {
    const double y = human::bottom(capsules_at(t));
    deepest = std::min(deepest, y);
    if (std::abs(y) < 0.01) ++standing;
  }
  EXPECT_GT(deepest, -0.005);
  EXPECT_LT(deepest, 0.01);
  // The rest of the time he leaps: five leaps of a third of a second.
  EXPECT_GT(standing, frames * 0.6);
  EXPECT_LT(standing, frames * 0.9);
}

TEST(Human, IsAtRestAtTheStart) {
  const auto first = capsules_at(person().start_time());
  for (const double t : {-100.0, person().start_time() + 0.5, person().start_time() + 1.0}) {
    const auto now = capsules_at(t);
    for (std::size_t i = 0; i < now.size(); ++i) {
      EXPECT_LT((now[i].a - first[i].a).norm(), 1e-6);
      EXPECT_LT((now[i].b - first[i].b).norm(), 1e-6);
    }
  }
}

TEST(Human, IsExactlyFrozenInTheEnd) {
  EXPECT_EQ(person().freeze_time(), 7.0);
  const auto frozen = capsules_at(7.0);
  Points<double> skin;
  Points<double> later;
  person().skin(7.0, skin);
  for (const double t : {7.0 + 1e-12, 7.001, 7.1, 8.0, 10.0, 1e6}) {
    const auto now = capsules_at(t);
    for (std::size_t i = 0; i < now.size(); ++i) {
      EXPECT_EQ(now[i].a, frozen[i].a);
      EXPECT_EQ(now[i].b, frozen[i].b);
    }
    person().skin(t, later);
    EXPECT_TRUE((skin == later).all());
  }
  const auto before = capsules_at(6.9);
  double moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) moved = std::max(moved, (before[i].a - frozen[i].a).norm());
  EXPECT_GT(moved, 1e-5) << "frozen too early";
}

TEST(Human, PlaysTheRecordingAndSlowsDownSmoothly) {
  EXPECT_DOUBLE_EQ(person().recording_time(0), 4.8);
  EXPECT_NEAR(person().recording_time(6.7), 11.5, 1e-12);
  EXPECT_NEAR(person().recording_time(7), 11.65, 1e-12);
  EXPECT_EQ(person().recording_time(7), person().recording_time(9));
  double rate = 1;
  for (double t = 6.69; t < 7.02; t += 0.001) {
    const double next = (person().recording_time(t + 0.001) - person().recording_time(t)) / 0.001;
    EXPECT_LE(next, rate + 1e-9);
    EXPECT_LT(rate - next, 0.01);
    rate = next;
  }
}

TEST(Human, VelocityIsContinuous) {
  // Accelerations reach 10 g (100 m/s²): over 1e-5 s that is 1e-3 m/s.
  for (const double t : {-3.0, -1.5, -1.0, -1.0 / 120, 0.0, 0.005, 1.0, 5.9, 6.7, 6.85, 7.0})
    EXPECT_LT(velocity_jump(t, 1e-5), 2e-3) << t;
  for (double t = -1.6; t < 7.1; t += 0.0173) EXPECT_LT(velocity_jump(t, 1e-5), 2e-3) << t;
}

TEST(Human, MovesAtHumanSpeeds) {
  double speed = 0;
  for (double t = -1.6; t < 7.1; t += 0.01) speed = std::max(speed, greatest_speed(t, 1e-3));
  EXPECT_LT(speed, 12);
  EXPECT_GT(speed, 2);
}

TEST(Human, ShownPathLiesAroundTheOrigin) {
  Vec3 low = Vec3::Constant(1e9);
  Vec3 high = -low;
  for (double t = 0; t < 7; t += 0.05)
    for (const Capsule& c : capsules_at(t)) {
      low = low.cwiseMin(c.a);
      high = high.cwiseMax(c.a);
    }
  EXPECT_NEAR(low.x() + high.x(), 0, 0.4);
  EXPECT_NEAR(low.z() + high.z(), 0, 0.4);
}

TEST(HumanSkin, IsClosedAndOutward) {
  const TriangleMesh& mesh = person().skin();
  EXPECT_LT(mesh.triangles.size(), 60000u);
  EXPECT_GT(mesh.triangles.size(), 30000u);
  EXPECT_EQ(test::open_edges(mesh.triangles), 0);
  Points<double> vertices;
  for (const double t : {person().start_time(), 0.4, 1.2, 3.0, 6.0, 7.0}) {
    person().skin(t, vertices);
    ASSERT_TRUE(vertices.isFinite().all());
    EXPECT_NEAR(test::volume(vertices, mesh.triangles), 0.066, 0.012) << t;  // [m³], about 66 kg
  }
}

// Triangles that face against the surface around them.
int folded(const Points<double>& vertices, const std::vector<Triangle>& triangles) {
  const auto normal = [&](const Triangle& t) {
    const Vec3 a = vertices.row(t[0]).matrix();
    const Vec3 b = vertices.row(t[1]).matrix();
    const Vec3 c = vertices.row(t[2]).matrix();
    return Vec3((b - a).cross(c - a));
  };
  std::vector<Vec3> around(static_cast<std::size_t>(vertices.rows()), Vec3::Zero());
  for (const Triangle& t : triangles)
    for (const int v : t) around[static_cast<std::size_t>(v)] += normal(t);
  int count = 0;
  for (const Triangle& t : triangles) {
    Vec3 mean = Vec3::Zero();
    for (const int v : t) mean += around[static_cast<std::size_t>(v)].normalized();
    if (normal(t).dot(mean) < 0) ++count;
  }
  return count;
}

TEST(HumanSkin, FoldsNowhereButInTheCreaseOfAnElbow) {
  const TriangleMesh& mesh = person().skin();
  EXPECT_EQ(folded(mesh.vertices, mesh.triangles), 0);
  Points<double> vertices;
  for (double t = person().start_time(); t < 7.1; t += 0.1) {
    person().skin(t, vertices);
    EXPECT_LE(folded(vertices, mesh.triangles), 15) << t;
  }
}

TEST(HumanSkin, StaysWithinTheClearance) {
  const human::HumanSettings settings;
  const double clearance = person().skin_clearance(person().start_time(), 7.1, 15);
  EXPECT_LT(clearance, settings.skin.clearance);
  EXPECT_GT(clearance, 0.002) << "the measure would see nothing";
}

TEST(HumanAttachment, ReproducesPointsAndFollowsTheSkin) {
  Points<double> points(3, 3);
  const double t0 = person().start_time();
  Points<double> skin;
  person().skin(t0, skin);
  points.row(0) = skin.row(100);
  points.row(1) = skin.row(5000);
  points.row(2) = skin.row(20000);
  const human::Attachment attachment = person().attach(points, t0);
  Points<double> now;
  person().attached(attachment, t0, now);
  EXPECT_LT((now - points).abs().maxCoeff(), 1e-9);
  for (const double t : {0.0, 1.8, 7.0}) {
    person().attached(attachment, t, now);
    person().skin(t, skin);
    EXPECT_LT((now.row(0) - skin.row(100)).matrix().norm(), 0.03) << t;
    EXPECT_LT((now.row(1) - skin.row(5000)).matrix().norm(), 0.03) << t;
    EXPECT_LT((now.row(2) - skin.row(20000)).matrix().norm(), 0.03) << t;
  }
}

TEST(HumanAttachment, ToOneJointIsRigid) {
  const Points<double> points = Points<double>::Random(20, 3);
  const human::Attachment attachment = person().attach(points, 0.5, "Spine1");
  Points<double> now;
  person().attached(attachment, 0.5, now);
  EXPECT_LT((now - points).abs().maxCoeff(), 1e-9);
  person().attached(attachment, 3.3, now);
  EXPECT_GT((now - points).abs().maxCoeff(), 0.1);
  for (Index i = 0; i < 20; ++i)
    for (Index k = 0; k < i; ++k)
      EXPECT_NEAR((now.row(i) - now.row(k)).matrix().norm(), (points.row(i) - points.row(k)).matrix().norm(), 1e-9);
  EXPECT_THROW(person().attach(points, 0, "Tail"), std::invalid_argument);
}

TEST(HumanErrors, SayWhichPackageHasTheMotion) {
  human::HumanSettings settings;
  settings.motion = "/nowhere/01_01.bvh";
  try {
    const Human human(settings);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("/nowhere/01_01.bvh"));
    EXPECT_THAT(e.what(), HasSubstr("apt-get install assimp-testmodels"));
  }
}

TEST(HumanErrors, RefuseSettingsOutOfRange) {
  const auto refused = [](auto change) {
    human::HumanSettings settings;
    change(settings);
    EXPECT_THROW(const Human human(settings), std::invalid_argument);
  };
  refused([](auto& s) { s.height = 0; });
  refused([](auto& s) { s.until = s.from; });
  refused([](auto& s) { s.until = 1000; });
  refused([](auto& s) { s.from = 1; });
  refused([](auto& s) { s.blend_in = 0; });
  refused([](auto& s) { s.settle = -1; });
  refused([](auto& s) { s.filter_hz = 0; });
  refused([](auto& s) { s.limb_gap = -0.01; });
  refused([](auto& s) { s.limb_gap = 0.5; });
}

}  // namespace
