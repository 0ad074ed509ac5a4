// Newton's first law, to the last bit where a computer can keep it.
#include "core/problems.hpp"

#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <Eigen/Geometry>

namespace hooke::test {
namespace {

using softbody::SpringField;

template <class S>
bool same(const Points<S>& a, const Points<S>& b) {
  return a.rows() == b.rows() && (a == b).all();
}

template <class S>
class Rest : public ::testing::Test {};
TYPED_TEST_SUITE(Rest, Scalars);

TYPED_TEST(Rest, OfFreePointsStaysBitwiseAtRest) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const Points<double> x = random.points(20, 100);
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    auto body = body_of(points<S>(x, Points<double>::Zero(20, 3), Values<double>::Ones(20)), motion(*method, 0.01));
    const Points<S> before = body->state().position;
    ASSERT_TRUE(run(*body, 0.01, 1000).good());
    EXPECT_TRUE(same(body->state().position, before));
    EXPECT_TRUE((body->state().velocity == S(0)).all());
  }
}

TYPED_TEST(Rest, OfAClothThatLiesHoweverStaysBitwiseAtRest) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  for (int turn = 0; turn < 4; ++turn) {
    // First along the axes, then turned at random and far from its own origin.
    const Eigen::Quaterniond q = turn == 0 ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond::UnitRandom();
    auto cloth = softbody::cloth_from_grid(1, 1.3, 9, 12, q * Vec3::UnitX(), q * Vec3::UnitZ(), {});
    if (turn > 0) cloth.positions.rowwise() += random.vector(3).transpose().array();
    const Index n = cloth.positions.rows();
    for (const Method* method : damped_methods()) {
      SCOPED_TRACE(method->name);
      auto body = body_of(points<S>(cloth.positions, Points<double>::Zero(n, 3), cloth.masses), motion(*method));
      body->add_field(std::make_unique<SpringField<S>>(cloth.network, body->state().position));
      const Points<S> before = body->state().position;
      for (int tick = 0; tick < 10; ++tick)
        ASSERT_TRUE(body->advance({tick / 60.0, (tick + 1) / 60.0, Vec3::Zero(), {}}).good());
      EXPECT_TRUE(same(body->state().position, before));
      EXPECT_TRUE((body->state().velocity == S(0)).all());
    }
  }
}

TYPED_TEST(Rest, OfSpringsAtTheirStartLengthsPullsExactlyZero) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const Points<S> x = random.points(200, 7).template cast<S>();
  auto network = std::make_shared<softbody::SpringNetwork>();
  for (int i = 0; i + 1 < 200; ++i) network->springs.push_back({i, i + 1, 1e5, 0, softbody::Spring::kFromStart});
  for (int i = 0; i < 500; ++i) {
    const int a = random.below(200), b = (a + 1 + random.below(199)) % 200;
    network->springs.push_back({a, b, random.uniform(1, 1e6), 0, softbody::Spring::kFromStart});
  }
  const SpringField<S> field(network, x);
  Points<S> force = Points<S>::Zero(200, 3);
  field.add_force(x, Points<S>::Zero(200, 3), 0, force);
  EXPECT_TRUE((force == S(0)).all());
}

TYPED_TEST(Rest, OfVelocityKeepsAStraightLine) {
  using S = TypeParam;
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    const Vec3 v{0.3, -1.7, 2.9};
    auto body = body_of(point<S>({1, 2, 3}, v), motion(*method, 0.01));
    ASSERT_TRUE(run(*body, 0.01, 1000).good());
    // One rounding a step, of a number of the size of the result.
    const double tolerance = 1000 * 32 * kUnit<S>;
    EXPECT_LT((row(body->positions(), 0) - Vec3(1, 2, 3) - 10 * v).norm(), tolerance);
    EXPECT_LT((row(body->velocities(), 0) - v).norm(), method == &verlet() ? 100 * kUnit<S> : 4 * kUnit<S>);
  }
}

TYPED_TEST(Rest, UnderGravityDoesNotDependOnMass) {
  using S = TypeParam;
  const Index n = 4;
  Values<double> mass(n);
  mass << 1e-3, 1, 7, 1e4;
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    auto body = body_of(points<S>(Points<double>::Zero(n, 3), Points<double>::Zero(n, 3), mass), motion(*method, 0.01));
    ASSERT_TRUE(run(*body, 0.01, 100, {0, -9.81, 0}).good());
    const Points<double> x = body->positions();
    for (Index i = 1; i < n; ++i) {
      if (solves(*method))
        EXPECT_NEAR(x(i, 1), x(0, 1), 200 * kUnit<S>);  // solved, not computed
      else
        EXPECT_EQ(x(i, 1), x(0, 1));
    }
    EXPECT_NEAR(x(0, 1), -9.81 / 2, 0.06);
    EXPECT_NEAR(body->weight(2, {0, -9.81, 0}), 7 * 9.81, 1e-12);
  }
}

TYPED_TEST(Rest, OfAnImmovablePointIsBrokenByNothing) {
  using S = TypeParam;
  for (const Method* method : damped_methods()) {
    SCOPED_TRACE(method->name);
    World world(120);
    world.set_damping(0.3);
    auto& body = world.add(body_of(
        points<S>(rows({{0, 0.1, 0}, {1, 0.2, 0}, {0.3, 1, 0.1}}), Points<double>::Zero(3, 3), Values<double>::Ones(3)),
        motion(*method)));
    auto network = std::make_shared<softbody::SpringNetwork>();
    network->springs = {{0, 1, 500, 1, 0.5}, {0, 2, 500, 1, 0.5}, {1, 2, 500, 1, 0.5}};
    body.add_field(std::make_unique<SpringField<S>>(network, body.state().position));
    body.add_field(std::make_unique<QuadraticDrag<S>>(0.1));
    body.pin(0);
    Collider ball{"ball", {Sphere{{-2, 0, 0}, 0.4}}, {}, {}, 0.5, 0};
    ball.motion = [](double t, std::span<Shape> shapes) { shapes[0] = Sphere{{-2 + 8 * t, 0, 0}, 0.4}; };
    world.add_collider(ball);
    const Points<S> before = body.state().position;
    for (int frame = 0; frame < 60; ++frame) {
      body.add_force(0, {1e4, 1e4, -1e4});
      ASSERT_TRUE(world.update(1.0 / 60).good());
      EXPECT_TRUE((body.state().position.row(0) == before.row(0)).all());
      EXPECT_TRUE((body.state().velocity.row(0) == S(0)).all());
    }
    EXPECT_GT(body.displacement(1).norm(), 0.1);
  }
}

}  // namespace
}  // namespace hooke::test
