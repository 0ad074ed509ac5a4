// Air against triangles.
#include "core/problems.hpp"

#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/wind.hpp>

#include <Eigen/Geometry>

namespace hooke::test {
namespace {

using softbody::Wind;
using softbody::WindField;

// A square metre of plate whose normal is turned from z by `angle` about x, at grid resolution n.
softbody::Cloth plate(double angle, int n = 2) {
  return softbody::cloth_from_grid(1, 1, n, n, Vec3::UnitX(), {0, std::cos(angle), std::sin(angle)}, {});
}

template <class S>
Vec3 total(const Wind& wind, const softbody::Cloth& cloth, const Vec3& velocity = Vec3::Zero(), double t = 0) {
  const Index n = cloth.positions.rows();
  const WindField<S> field(wind, cloth.triangles, n);
  const Points<S> x = cloth.positions.template cast<S>();
  const Points<S> v = velocity.transpose().array().replicate(n, 1).template cast<S>();
  Points<S> f = Points<S>::Zero(n, 3);
  field.add_force(x, v, t, f);
  return f.template cast<double>().colwise().sum().matrix().transpose();
}

Wind steady(const Vec3& velocity) {
  Wind wind;
  wind.velocity = velocity;
  return wind;
}

template <class S>
class Air : public ::testing::Test {
 public:
  static constexpr double kTolerance = 1000 * kUnit<S>;
};
TYPED_TEST_SUITE(Air, Scalars);

TYPED_TEST(Air, PushesAPlateAcrossItByItsDynamicPressure) {
  const double v = 7;
  for (const int n : {2, 12}) {  // triangles one by one, and runs of them
    const Vec3 f = total<TypeParam>(steady({0, 0, v}), plate(0, n));
    EXPECT_NEAR(f.z(), 0.5 * 1.204 * 1.2 * v * v, this->kTolerance * 50);
    EXPECT_NEAR(f.x(), 0, this->kTolerance);
    EXPECT_NEAR(f.y(), 0, this->kTolerance);
  }
}

TYPED_TEST(Air, PassesAPlateEdgeOn) {
  EXPECT_LT(total<TypeParam>(steady({0, 5, 0}), plate(0)).norm(), this->kTolerance);
  EXPECT_LT(total<TypeParam>(steady({5, 0, 0}), plate(0)).norm(), this->kTolerance);
}

TYPED_TEST(Air, LiftsAPlateAtAnAngleByItsFormula) {
  const double v = 5, pressure = 0.5 * 1.204 * v * v;
  for (const double angle : {0.3, 0.8, 1.2}) {
    SCOPED_TRACE(angle);
    const Vec3 f = total<TypeParam>(steady({0, 0, v}), plate(angle));
    EXPECT_NEAR(f.z(), pressure * 1.2 * std::cos(angle), this->kTolerance * 50);
    EXPECT_NEAR(std::abs(f.y()), pressure * 0.6 * std::cos(angle) * std::sin(angle), this->kTolerance * 50);
    // To the side that the plate's leeward face shows to: away from the windward normal.
    EXPECT_LT(f.y() * Vec3(0, -std::sin(angle), std::cos(angle)).y() * -1, 0);
  }
}

TYPED_TEST(Air, PushesBothSidesTheSame) {
  auto front = plate(0.5), back = front;
  for (Triangle& t : back.triangles) std::swap(t[1], t[2]);
  const Vec3 wind{1, 2, 4};
  EXPECT_LT((total<TypeParam>(steady(wind), front) - total<TypeParam>(steady(wind), back)).norm(),
            this->kTolerance * 10);
  EXPECT_LT((total<TypeParam>(steady(wind), front) + total<TypeParam>(steady(-wind), front)).norm(),
            this->kTolerance * 10);
}

TYPED_TEST(Air, OnlyKnowsTheRelativeVelocity) {
  const Vec3 wind{1, 2, 4}, own{-3, 0.5, 1};
  EXPECT_LT((total<TypeParam>(steady(wind), plate(0.5), own) - total<TypeParam>(steady(wind - own), plate(0.5))).norm(),
            this->kTolerance * 10);
  EXPECT_LT(total<TypeParam>(steady(own), plate(0.5), own).norm(), this->kTolerance);
}

TYPED_TEST(Air, ThatIsStillTakesEnergyFromMovingCloth) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const auto cloth = plate(0, 14);
  const Index n = cloth.positions.rows();
  const WindField<S> field({}, cloth.triangles, n);
  for (int round = 0; round < 50; ++round) {
    const Points<S> x = (cloth.positions + random.points(n, 0.05)).template cast<S>();
    const Points<S> v = random.points(n, 3).template cast<S>();
    Points<S> f = Points<S>::Zero(n, 3);
    field.add_force(x, v, 0, f);
    EXPECT_LE((f * v).template cast<double>().sum(), 0);
  }
}

TYPED_TEST(Air, IsTheSameInRunsAndOneByOne) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const auto cloth = plate(0, 17);
  const Index n = cloth.positions.rows();
  const Points<S> x = (cloth.positions + random.points(n, 0.05)).template cast<S>(),
                  v = random.points(n, 2).template cast<S>();
  Points<S> together = Points<S>::Zero(n, 3), apart = together;
  WindField<S>(steady({1, 2, 3}), cloth.triangles, n).add_force(x, v, 0, together);
  for (const Triangle& t : cloth.triangles) WindField<S>(steady({1, 2, 3}), {t}, n).add_force(x, v, 0, apart);
  EXPECT_LT(double((together - apart).abs().maxCoeff()), this->kTolerance);
}

TYPED_TEST(Air, SurvivesTrianglesWithoutArea) {
  using S = TypeParam;
  const WindField<S> field(steady({1, 2, 3}), {{0, 1, 2}}, 3);
  Points<S> f = Points<S>::Zero(3, 3);
  field.add_force(Points<S>::Zero(3, 3), Points<S>::Zero(3, 3), 0, f);
  EXPECT_TRUE((f == S(0)).all());
}

TEST(Air, DampsNoLessThanItsForceChangesWithVelocity) {
  Random random;
  SCOPED_TRACE(random.trace());
  const auto cloth = plate(0, 4);
  const Index n = cloth.positions.rows();
  const WindField<double> field(steady({2, 0, 3}), cloth.triangles, n);
  for (int round = 0; round < 50; ++round) {
    const Points<double> x = cloth.positions + random.points(n, 0.1), v = random.points(n, 2), d = random.points(n, 1);
    const double h = 1e-6;
    Points<double> up = Points<double>::Zero(n, 3), down = up, bound = up;
    field.add_force(x, v + h * d, 0, up);
    field.add_force(x, v - h * d, 0, down);
    field.add_damping_times(x, v, d, bound);
    EXPECT_LE((d * (down - up)).sum() / (2 * h), (d * bound).sum());
  }
}

TEST(Wind, GustsAroundItsMeanAndStopsWhenTold) {
  Wind wind = steady({3, 0, 4});
  EXPECT_EQ(wind.velocity_at(1.7), Vec3(3, 0, 4));
  wind.gust = 0.5, wind.swing = 0.3, wind.stop = 100;
  double least = 1e9, most = 0, jump = 0;
  Vec3 before = wind.velocity_at(0);
  for (double t = 0; t < 99; t += 0.01) {
    const Vec3 now = wind.velocity_at(t);
    least = std::min(least, now.norm()), most = std::max(most, now.norm());
    jump = std::max(jump, (now - before).norm());
    EXPECT_EQ(now.y(), 0);
    EXPECT_LE(std::acos(std::min(1.0, now.normalized().dot(Vec3(0.6, 0, 0.8)))), 0.3 + 1e-9);
    before = now;
  }
  EXPECT_GE(least, 2.5 - 1e-9);
  EXPECT_LE(most, 7.5 + 1e-9);
  EXPECT_LT(least, 3.5);
  EXPECT_GT(most, 6.5);
  EXPECT_LT(jump, 0.3);
  EXPECT_EQ(wind.velocity_at(100), Vec3(0, 0, 0));
  EXPECT_LT(wind.velocity_at(99.99).norm(), 0.1);
  Wind other = wind;
  other.seed = 2;
  EXPECT_NE(other.velocity_at(3), wind.velocity_at(3));
}

TEST(Wind, RefusesBadValues) {
  const std::vector<Triangle> none;
  EXPECT_THROW(WindField<double>(steady({NAN, 0, 0}), none, 3), std::invalid_argument);
  Wind wind;
  wind.gust = -1;
  EXPECT_THROW(WindField<double>(wind, none, 3), std::invalid_argument);
  wind = {}, wind.gust_period = 0;
  EXPECT_THROW(WindField<float>(wind, none, 3), std::invalid_argument);
  wind = {}, wind.drag = -1;
  EXPECT_THROW(WindField<float>(wind, none, 3), std::invalid_argument);
  EXPECT_THROW(WindField<double>({}, {{0, 1, 3}}, 3), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::test
