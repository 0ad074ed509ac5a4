// Pinned points go where they are told, exactly, and cost no energy when they are declared to jump.
#include "core/problems.hpp"

#include <hooke/softbody/spring_field.hpp>

namespace hooke::test {
namespace {

/// Exactly where it was told to be, in the body's precision from its origin, which follows it.
template <class S>
bool is_at(const PointBody<S>& body, Index point, const Vec3& x) {
  bool same = true;
  for (int k = 0; k < 3; ++k) same = same && body.state().position(point, k) == S(x[k] - body.state().origin[k]);
  return same;
}

// Two points on a spring; the first is pinned.
template <class S>
std::unique_ptr<PointBody<S>> pair(const Method& method) {
  auto body =
      body_of(points<S>(rows({{0, 0, 0}, {0, -0.5, 0}}), Points<double>::Zero(2, 3), Values<double>::Constant(2, 0.7)),
              motion(method));
  auto network = std::make_shared<softbody::SpringNetwork>();
  network->springs.push_back({0, 1, 200, 1, 0.5, softbody::Family::Raw});
  body->add_field(std::make_unique<softbody::SpringField<S>>(network, body->state().position));
  body->pin(0);
  return body;
}

template <class S>
class Pin : public ::testing::Test {};
TYPED_TEST_SUITE(Pin, Scalars);

TYPED_TEST(Pin, MovedIsExactlyAtItsTargetAfterTheFrame) {
  using S = TypeParam;
  for (const Method* method : damped_methods()) {
    SCOPED_TRACE(method->name);
    World world(240);
    auto& body = world.add(pair<S>(*method));
    const Vec3 targets[] = {{0.1, 0, 0}, {0.1, 0.3, -0.2}, {10, 0, 0}, {1.0 / 3, 0.7, 0}};
    for (const Vec3& target : targets) {
      body.move_pin(0, target);
      ASSERT_TRUE(world.update(1.0 / 60).good());
      EXPECT_TRUE(is_at(body, 0, target));
      ASSERT_TRUE(world.update(1.0 / 60).good());
      EXPECT_TRUE(is_at(body, 0, target));
      EXPECT_EQ(row(body.velocities(), 0), Vec3(0, 0, 0));
    }
    EXPECT_TRUE(body.positions().allFinite());
  }
}

TYPED_TEST(Pin, MovedInAFrameWithoutATickArrivesWithTheNextThatHasOne) {
  using S = TypeParam;
  World world(60);
  auto& body = world.add(pair<S>(velocity_verlet()));
  body.move_pin(0, {0.25, 0, 0});
  ASSERT_TRUE(world.update(1.0 / 300).good());
  EXPECT_EQ(row(body.positions(), 0), Vec3(0, 0, 0));
  ASSERT_TRUE(world.update(1.0 / 60).good());
  ASSERT_EQ(world.clock().ticks(), 1);
  EXPECT_EQ(row(body.positions(), 0), Vec3(0.25, 0, 0));
}

TYPED_TEST(Pin, MovesOnAStraightLineOverTheTicksOfTheFrame) {
  using S = TypeParam;
  World world(240);
  auto& body = world.add(pair<S>(semi_implicit_euler()));
  std::vector<double> seen;
  body.drive_pins({1}, [&](double, Points<double>& p) {
    p.row(0) << 0, -0.5, 0;
    seen.push_back(body.positions()(0, 0));
  });
  body.move_pin(0, {1, 0, 0});
  ASSERT_TRUE(world.update(1.0 / 60).good());
  for (const double x : seen) EXPECT_LE(x, 1);
  EXPECT_EQ(row(body.positions(), 0), Vec3(1, 0, 0));
  // Half-way between the last two ticks: an eighth of the way before the end.
  EXPECT_NEAR(body.positions_between(0.5)(0, 0), 1 - 0.125, 1e-6);
  EXPECT_EQ(body.positions_between(1)(0, 0), 1);
  EXPECT_NEAR(body.positions_between(0)(0, 0), 0.75, 1e-6);
}

TYPED_TEST(Pin, DrivenByTimeIsExactlyThereAtEveryTick) {
  using S = TypeParam;
  const auto place = [](double t) { return Vec3(20 * t, std::sin(5 * t), 0.1); };  // 20 m/s
  for (const Method* method : damped_methods()) {
    SCOPED_TRACE(method->name);
    World world(120);
    auto& body = world.add(pair<S>(*method));
    body.drive_pins({0}, [&](double t, Points<double>& p) { p.row(0) = place(t).transpose().array(); });
    for (int frame = 0; frame < 60; ++frame) {
      ASSERT_TRUE(world.update(1.0 / 60).good());
      EXPECT_TRUE(is_at(body, 0, place(world.time())));
    }
    EXPECT_LT((row(body.positions(), 1) - row(body.positions(), 0)).norm(), 5);
  }
}

TYPED_TEST(Pin, ReleasedFallsWithTheMassItHad) {
  using S = TypeParam;
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    World world(240);
    auto& body = world.add(
        body_of(points<S>(rows({{0, 0, 0}}), rows({{0, 0, 0}}), Values<double>::Constant(1, 0.7)), motion(*method)));
    body.pin(0);
    EXPECT_TRUE(body.pinned(0));
    EXPECT_NEAR(body.masses()[0], 0.7, 1e-7);
    ASSERT_TRUE(world.update(0.5).good());
    EXPECT_EQ(body.displacement(0), Vec3(0, 0, 0));
    body.release(0);
    EXPECT_FALSE(body.pinned(0));
    body.add_force(0, {0.7, 0, 0});
    ASSERT_TRUE(world.update(1).good());
    EXPECT_NEAR(body.velocities()(0, 1), -9.81, 1e-4);
    EXPECT_NEAR(body.velocities()(0, 0), 1, 1e-5);
  }
}

TYPED_TEST(Pin, ReleasedWhileItMovesOrIsDrivenGoesItsOwnWay) {
  using S = TypeParam;
  World world(240);
  auto& body = world.add(pair<S>(velocity_verlet()));
  body.drive_pins({0}, [](double t, Points<double>& p) { p.row(0) << t, 0, 0; });
  ASSERT_TRUE(world.update(0.5).good());
  body.release(0);
  ASSERT_TRUE(world.update(1).good());
  EXPECT_LT(body.positions()(0, 1), -3);
}

TYPED_TEST(Pin, JumpThatIsDeclaredAddsNoVelocity) {
  using S = TypeParam;
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    World world(240);
    world.enable_gravity(false);
    auto& body = world.add(
        body_of(points<S>(rows({{0, 0, 0}, {1, 0, 0}}), rows({{2, 0, 0}, {0, 0, 0}}), Values<double>::Ones(2)),
                motion(*method)));
    body.pin(1);
    ASSERT_TRUE(world.update(0.1).good());
    const double before = body.energy(Vec3::Zero()).total();
    body.set_position(0, {-10, 5, 1});
    body.set_position(1, {10, 5, 1});
    ASSERT_TRUE(world.update(0.1).good());
    EXPECT_NEAR(body.energy(Vec3::Zero()).total(), before, 1e-5);
    EXPECT_EQ(row(body.positions(), 1), Vec3(10, 5, 1));
    // One rounding of the position in each move.
    EXPECT_NEAR(body.positions()(0, 0), -10 + 2 * 0.1, 1e-5 * method->evaluations);
  }
}

TEST(Pins, RefuseWhatMakesNoSense) {
  auto body = pair<double>(velocity_verlet());
  EXPECT_THROW(body->move_pin(1, {0, 0, 0}), std::invalid_argument);  // not pinned
  EXPECT_THROW(body->pin(2), std::out_of_range);
  EXPECT_THROW(body->pin(-1), std::out_of_range);
  EXPECT_THROW(body->drive_pins({0, 9}, [](double, Points<double>&) {}), std::out_of_range);
  EXPECT_THROW(body->add_force(0, {0, std::nan(""), 0}), std::invalid_argument);
  EXPECT_THROW(body->set_position(0, {INFINITY, 0, 0}), std::invalid_argument);
  EXPECT_THROW(body->set_velocity(5, {0, 0, 0}), std::out_of_range);
  EXPECT_THROW(body->speed(2), std::out_of_range);
}

}  // namespace
}  // namespace hooke::test
