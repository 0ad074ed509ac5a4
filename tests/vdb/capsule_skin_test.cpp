#include <hooke/vdb/capsule_skin.hpp>

#include <vdb/closed_mesh.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace hooke;
constexpr double pi = std::numbers::pi;

TEST(CapsuleSkin, OfASphereIsTheSphere) {
  const std::vector<Capsule> ball{{Vec3(0.1, 0.2, -0.3), Vec3(0.1, 0.2, -0.3), 0.1}};
  const TriangleMesh mesh = vdb::skin_capsules(ball, 0.01, 0);
  EXPECT_EQ(test::open_edges(mesh.triangles), 0);
  EXPECT_NEAR(test::volume(mesh.vertices, mesh.triangles), 4 * pi / 3 * 1e-3, 3e-5);
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    EXPECT_NEAR(signed_distance(ball[0], mesh.vertices.row(v).matrix()), 0, 1e-5);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices.row(t[0]).matrix();
    const Vec3 b = mesh.vertices.row(t[1]).matrix();
    const Vec3 c = mesh.vertices.row(t[2]).matrix();
    EXPECT_GT((b - a).cross(c - a).dot(a - ball[0].a), 0) << "inside out";
  }
}

TEST(CapsuleSkin, OfACapsuleHasItsVolume) {
  const std::vector<Capsule> capsule{{Vec3(0, 0, 0), Vec3(0.3, 0.1, 0.2), 0.05}};
  const double length = (capsule[0].b - capsule[0].a).norm();
  const TriangleMesh mesh = vdb::skin_capsules(capsule, 0.006, 0.02);
  EXPECT_EQ(test::open_edges(mesh.triangles), 0);
  const double expected = pi * 0.0025 * length + 4 * pi / 3 * 0.000125;
  EXPECT_NEAR(test::volume(mesh.vertices, mesh.triangles), expected, 0.02 * expected);
}

TEST(CapsuleSkin, BlendFillsTheCreaseButNeverMoreThanHalfTheRadius) {
  const std::vector<Capsule> elbow{{Vec3(-0.3, 0, 0), Vec3(0, 0, 0), 0.05}, {Vec3(0, 0, 0), Vec3(0, 0.3, 0), 0.05}};
  const double k = 0.04;
  const TriangleMesh mesh = vdb::skin_capsules(elbow, 0.008, k);
  EXPECT_EQ(test::open_edges(mesh.triangles), 0);
  double outside = 0;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Vec3 x = mesh.vertices.row(v).matrix();
    EXPECT_NEAR(vdb::smooth_union_distance(elbow, k, x), 0, 2e-4);
    outside = std::max(outside, std::min(signed_distance(elbow[0], x), signed_distance(elbow[1], x)));
  }
  EXPECT_GT(outside, 0.8 * k / 4);
  EXPECT_LT(outside, 1.05 * k / 4);
}

TEST(CapsuleSkin, FarCapsulesDoNotTouchEachOther) {
  const std::vector<Capsule> two{{Vec3(0, 0, 0), Vec3(0, 0.2, 0), 0.04}, {Vec3(0.2, 0, 0), Vec3(0.2, 0.2, 0), 0.04}};
  const TriangleMesh mesh = vdb::skin_capsules(two, 0.01, 0.05);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Vec3 x = mesh.vertices.row(v).matrix();
    EXPECT_LT(std::min(signed_distance(two[0], x), signed_distance(two[1], x)), 1e-3);
  }
}

TEST(SmoothUnion, DoesNotDependOnTheOrder) {
  const std::vector<Capsule> one{
      {Vec3(0, 0, 0), Vec3(1, 0, 0), 0.1}, {Vec3(0, 0, 0), Vec3(0, 1, 0), 0.1}, {Vec3(0, 0, 0), Vec3(0, 0, 1), 0.1}};
  const std::vector<Capsule> other{one[2], one[0], one[1]};
  const Vec3 x(0.12, 0.13, 0.14);
  EXPECT_EQ(vdb::smooth_union_distance(one, 0.1, x), vdb::smooth_union_distance(other, 0.1, x));
  EXPECT_LT(vdb::smooth_union_distance(one, 0.1, x), vdb::smooth_union_distance(one, 0, x));
}

TEST(CapsuleSkin, RefusesSenselessArguments) {
  const std::vector<Capsule> good{{Vec3(0, 0, 0), Vec3(1, 0, 0), 0.1}};
  EXPECT_THROW(vdb::skin_capsules({}, 0.01, 0), std::invalid_argument);
  EXPECT_THROW(vdb::skin_capsules(good, 0, 0), std::invalid_argument);
  EXPECT_THROW(vdb::skin_capsules(good, -0.01, 0), std::invalid_argument);
  EXPECT_THROW(vdb::skin_capsules(good, 0.01, -1), std::invalid_argument);
  EXPECT_THROW(vdb::skin_capsules(good, 1e-6, 0), std::invalid_argument);
  EXPECT_THROW(vdb::skin_capsules(good, 0.3, 0), std::invalid_argument);
  std::vector<Capsule> bad = good;
  bad[0].radius = -0.1;
  EXPECT_THROW(vdb::skin_capsules(bad, 0.01, 0), std::invalid_argument);
  bad = good;
  bad[0].b.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(vdb::skin_capsules(bad, 0.01, 0), std::invalid_argument);
}

}  // namespace
