// Linear rigid bodies: the bouncing ball to the published digits, the snooker table, and what an
// immovable body does.
#include <hooke/linear_bodies.hpp>
#include <hooke/world.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hooke {
namespace {

Collider floor_at(double height) { return {"floor", {HalfSpace{{0, 1, 0}, height}}, {}, {}, 0, 0}; }

LinearBody ball(double radius, double mass, const Vec3& position, const Vec3& velocity, double restitution) {
  LinearBody body;
  body.shape = BallShape{radius};
  body.mass = mass;
  body.position = position;
  body.velocity = velocity;
  body.restitution = restitution;
  return body;
}

struct Bounces {
  double time = 0, path = 0;
  std::vector<double> heights;
  double y = 0, v = 0;
};

// A ball dropped from 1 m, velocity Verlet at one substep a tick of 1/240 s.
Bounces drop(double restitution, double rest_speed) {
  World world;
  world.add_collider(floor_at(0));
  auto& balls = world.add(std::make_unique<LinearBodies<double>>(
      "ball", std::vector{ball(0.1, 2, {0, 1.1, 0}, {0, 0, 0}, restitution)}, MotionSettings{}, rest_speed));
  Bounces out;
  out.path = 1;
  for (int tick = 0; tick < 6 * 240; ++tick) {
    EXPECT_TRUE(world.update(1.0 / 240).good());
    for (const Impact& impact : balls.impacts()) {
      out.time = impact.time;
      const double up = restitution * impact.approach > rest_speed ? restitution * impact.approach : 0;
      out.heights.push_back(up * up / (2 * 9.81));
      out.path += 2 * out.heights.back();
    }
  }
  out.y = balls.positions()(0, 1);
  out.v = balls.velocities()(0, 1);
  return out;
}

TEST(BouncingBall, TakesThePublishedTimeAndPath) {
  for (const auto& [e, time, path] : {std::tuple{0.5, 1.354570923, 1.666666667}, {0.8, 4.063712769, 4.555555556}}) {
    const Bounces bounces = drop(e, 1e-10);
    EXPECT_NEAR(bounces.time, time, 1e-9) << "restitution " << e;
    EXPECT_NEAR(bounces.path, path, 1e-9) << "restitution " << e;
    ASSERT_GE(bounces.heights.size(), 5u);
    for (int n = 0; n < 5; ++n) EXPECT_NEAR(bounces.heights[std::size_t(n)], std::pow(e, 2 * (n + 1)), 1e-10);
  }
}

TEST(BouncingBall, ComesToRestOnTheFloorAndStaysToTheBit) {
  const Bounces bounces = drop(0.8, 1e-3);
  EXPECT_NEAR(bounces.time, 4.06278, 1e-5);
  EXPECT_EQ(bounces.v, 0.0);
  EXPECT_NEAR(bounces.y, 0.1, 1e-12);
}

TEST(BouncingBall, WithoutLossKeepsItsHeight) {
  const Bounces bounces = drop(1, 1e-3);
  ASSERT_GE(bounces.heights.size(), 6u);
  for (const double height : bounces.heights) EXPECT_NEAR(height, 1, 1e-9);
}

TEST(Snooker, TheWholeMomentumPassesDownTheRow) {
  World world;
  world.enable_gravity(false);
  std::vector<LinearBody> row;
  for (int i = 0; i < 5; ++i) row.push_back(ball(0.026, 0.17, {0.1 * i, 0, 0}, {i == 0 ? 3.0 : 0.0, 0, 0}, 1));
  auto& balls = world.add(std::make_unique<LinearBodies<double>>("row", row));
  ASSERT_TRUE(world.update(1).good());
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(balls.velocities()(i, 0), 0, 1e-14);
  EXPECT_NEAR(balls.velocities()(4, 0), 3, 1e-14);
  EXPECT_NEAR(world.momentum().x(), 0.17 * 3, 1e-15);
}

TEST(Snooker, MomentumIsKeptToRoundingInABreak) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  World world;
  world.enable_gravity(false);
  std::vector<LinearBody> bodies;
  for (int i = 0; i < 40; ++i)
    bodies.push_back(ball(0.12, 1 + 0.9 * uniform(random), {uniform(random), uniform(random), uniform(random)},
                          {uniform(random), uniform(random), uniform(random)}, 0.9));
  auto& balls = world.add(std::make_unique<LinearBodies<double>>("break", bodies));
  const Vec3 before = world.momentum();
  int impacts = 0;
  for (int i = 0; i < 480; ++i) {
    ASSERT_TRUE(world.update(1.0 / 240).good());
    impacts += int(balls.impacts().size());
  }
  EXPECT_GT(impacts, 5) << "seed " << seed;
  EXPECT_LT((world.momentum() - before).norm(), 1e-12) << "seed " << seed;
}

TEST(LinearBodies, ImpulsesAreEqualAndOppositeAndAnImmovableBodyNeverMoves) {
  World world;
  world.enable_gravity(false);
  LinearBody wall = ball(0.5, 10, {1, 0, 0}, {0, 0, 0}, 1);
  wall.reacts = false;
  auto& bodies = world.add(
      std::make_unique<LinearBodies<double>>("two", std::vector{ball(0.1, 2, {0, 0, 0}, {3, 0, 0}, 1), wall}));
  Vec3 impulse = Vec3::Zero();
  for (int i = 0; i < 240; ++i) {
    ASSERT_TRUE(world.update(1.0 / 240).good());
    for (const Impact& impact : bodies.impacts()) impulse += impact.impulse;
  }
  EXPECT_NEAR(impulse.x(), -2 * 2 * 3, 1e-12);
  EXPECT_NEAR(bodies.velocities()(0, 0), -3, 1e-12);
  EXPECT_EQ(bodies.positions()(1, 0), 1.0);
  EXPECT_EQ(bodies.velocities()(1, 0), 0.0);
}

TEST(LinearBodies, WhatIsNotCollidableIsPassedThrough) {
  World world;
  world.enable_gravity(false);
  LinearBody ghost = ball(0.5, 1, {1, 0, 0}, {0, 0, 0}, 1);
  ghost.collidable = false;
  auto& bodies = world.add(
      std::make_unique<LinearBodies<double>>("two", std::vector{ball(0.1, 1, {0, 0, 0}, {3, 0, 0}, 1), ghost}));
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(bodies.positions()(0, 0), 3, 1e-12);
  EXPECT_EQ(bodies.positions()(1, 0), 1.0);
}

TEST(LinearBodies, ABoxLandsOnItsFaceAndAFastBallDoesNotTunnel) {
  World world(60);
  world.add_collider(floor_at(0));
  LinearBody box;
  box.shape = BoxShape{{0.2, 0.3, 0.4}};
  box.position = {0, 2, 0};
  box.restitution = 0;
  auto& bodies = world.add(std::make_unique<LinearBodies<double>>(
      "box and bullet", std::vector{box, ball(0.01, 0.1, {5, 50, 0}, {0, -1000, 0}, 0)}));
  ASSERT_TRUE(world.update(3).good());
  EXPECT_NEAR(bodies.positions()(0, 1), 0.3, 1e-12);
  EXPECT_NEAR(bodies.positions()(1, 1), 0.01, 1e-10);
}

TEST(LinearBodies, BrokenSettingsNameTheBodyAndTheRule) {
  std::vector<LinearBody> bodies{ball(0.1, 1, {0, 0, 0}, {0, 0, 0}, 1), ball(0.1, -1, {1, 0, 0}, {0, 0, 0}, 1)};
  try {
    const LinearBodies<double> broken("b", bodies);
    FAIL() << "a negative mass was taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("body 1: mass must be positive"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace hooke
