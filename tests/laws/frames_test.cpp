// However frames are cut, the physics is the same: fixed ticks, pushes as a bank of impulse,
// damping per second, scenes that time alone drives.
#include "core/problems.hpp"

#include <hooke/softbody/soft_body.hpp>

#include <map>

namespace hooke::test {
namespace {

constexpr double kTick = 240;

TEST(GlobalDamping, LosesItsShareEachSecondAtAnyFrameAndTickRate) {
  for (const Method* method : methods())
    for (const double tick_rate : {60.0, 240.0, 1000.0})
      for (const double frame_rate : {30.0, 60.0}) {
        SCOPED_TRACE(std::string(method->name) + " at " + std::to_string(tick_rate) + "/s in frames of " +
                     std::to_string(frame_rate) + "/s");
        World world(tick_rate);
        world.enable_gravity(false);
        world.set_damping(0.3);
        auto& body = world.add(body_of(point<double>({0, 0, 0}, {4, 0, 0}), motion(*method)));
        for (int frame = 0; frame < 2 * frame_rate; ++frame) ASSERT_TRUE(world.update(1 / frame_rate).good());
        ASSERT_EQ(world.clock().ticks(), std::int64_t(2 * tick_rate));
        EXPECT_NEAR(body.speed(0), 4 * 0.7 * 0.7, 1e-11);
      }
}

TEST(GlobalDamping, CanBeSetWhileRunning) {
  World world(kTick);
  world.enable_gravity(false);
  auto& body = world.add(body_of(point<double>({0, 0, 0}, {4, 0, 0}), {}));
  ASSERT_TRUE(world.update(1).good());
  EXPECT_EQ(body.speed(0), 4);
  world.set_damping(0.5);
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.speed(0), 2, 1e-12);
  EXPECT_THROW(world.set_damping(1), std::invalid_argument);
  EXPECT_THROW(world.set_damping(-0.1), std::invalid_argument);
}

TEST(Gravity, CanBeSetAndToggledWhileRunning) {
  World world(kTick);
  auto& body = world.add(body_of(point<double>({0, 0, 0}, {0, 0, 0}), {}));
  world.enable_gravity(false);
  ASSERT_TRUE(world.update(1).good());
  EXPECT_EQ(body.speed(0), 0);
  world.enable_gravity(true);
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.velocities()(0, 1), -9.81, 1e-11);
  world.set_gravity({0, 0, 1});
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.velocities()(0, 2), 1, 1e-12);
  world.enable_gravity(false);
  EXPECT_EQ(world.gravity(), Vec3(0, 0, 0));
}

TEST(Push, OfOneSecondMovesAMassTheSameAtAnyFrameRate) {
  for (const Method* method : methods()) {
    std::map<double, Vec3> place, speed;
    for (const double frame_rate : {30.0, 60.0, 144.0, 240.0}) {
      World world(kTick);
      world.enable_gravity(false);
      Values<double> mass(1);
      mass << 2.5;
      auto& body = world.add(
          body_of(points<double>(Points<double>::Zero(1, 3), Points<double>::Zero(1, 3), mass), motion(*method)));
      for (int frame = 0; frame < frame_rate; ++frame) {
        body.add_force(0, {7, -2, 1});
        ASSERT_TRUE(world.update(1 / frame_rate).good());
      }
      // Coasting must not depend on it either.
      for (int frame = 0; frame < frame_rate; ++frame) ASSERT_TRUE(world.update(1 / frame_rate).good());
      ASSERT_EQ(world.clock().ticks(), 480);
      place[frame_rate] = row(body.positions(), 0);
      speed[frame_rate] = row(body.velocities(), 0);
    }
    for (const auto& [rate, x] : place) {
      SCOPED_TRACE(std::string(method->name) + " at " + std::to_string(rate) + " frames a second");
      EXPECT_LT((x - place[240]).norm(), 1e-12 * x.norm());
      EXPECT_LT((speed[rate] - Vec3(7, -2, 1) / 2.5).norm(), 1e-12 * speed[rate].norm());
    }
  }
}

TEST(Push, ActsForItsFrameAndIsThenForgotten) {
  World world(kTick);
  world.enable_gravity(false);
  auto& body = world.add(body_of(point<double>({0, 0, 0}, {0, 0, 0}), {}));
  body.add_force(0, {60, 0, 0});
  ASSERT_TRUE(world.update(1.0 / 60).good());
  EXPECT_NEAR(body.speed(0), 1, 1e-12);
  ASSERT_TRUE(world.update(1.0 / 60).good());
  EXPECT_NEAR(body.speed(0), 1, 1e-12);
  body.add_force(0, {60, 0, 0});
  world.clear_forces();
  ASSERT_TRUE(world.update(1.0 / 60).good());
  EXPECT_NEAR(body.speed(0), 1, 1e-12);
}

TEST(Push, InAFrameWithoutATickArrivesWithTheNext) {
  World world(60);
  world.enable_gravity(false);
  auto& body = world.add(body_of(point<double>({0, 0, 0}, {0, 0, 0}), {}));
  body.add_force(0, {300, 0, 0});
  ASSERT_TRUE(world.update(1.0 / 300).good());
  EXPECT_EQ(body.speed(0), 0);
  for (int frame = 0; frame < 4; ++frame) ASSERT_TRUE(world.update(1.0 / 300).good());
  ASSERT_EQ(world.clock().ticks(), 1);
  EXPECT_NEAR(body.speed(0), 1, 1e-12);
}

TEST(Push, OfRandomFramesGivesItsWholeImpulse) {
  Random random;
  SCOPED_TRACE(random.trace());
  World world(kTick);
  world.enable_gravity(false);
  auto& body = world.add(body_of(point<double>({0, 0, 0}, {0, 0, 0}), {}));
  double impulse = 0;
  for (int frame = 0; frame < 1000; ++frame) {
    const double seconds = random.uniform(0, 0.05), force = random.uniform(-5, 10);
    body.add_force(0, {force, 0, 0});
    impulse += force * seconds;
    ASSERT_TRUE(world.update(seconds).good());
  }
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.velocities()(0, 0), impulse, 1e-10);
}

// Cloth with gusts, driven pins and a moving ball: driven by time alone.
std::unique_ptr<World> windy_scene(softbody::Precision precision) {
  auto world = std::make_unique<World>(kTick);
  auto settings = softbody::settings_of(softbody::cloth_from_grid(0.6, 0.8, 8, 10, Vec3::UnitX(), -Vec3::UnitY(), {}));
  settings.name = "flag";
  settings.precision = precision;
  softbody::Wind wind;
  wind.velocity = {0, 0, 6};
  wind.gust = 0.5, wind.swing = 0.4;
  settings.wind = wind;
  settings.motion.thickness = 0.005;
  Body& cloth = world->add(softbody::make_soft_body(settings));
  cloth.drive_pins({0, 7}, [](double t, Points<double>& p) {
    p.row(0) << -0.3, 0.1 * std::sin(3 * t), 0;
    p.row(1) << 0.3, 0.1 * std::sin(3 * t), 0.05 * (1 - std::cos(t));
  });
  Collider ball{"ball", {Sphere{}}, {}, {}, 0.3, 0};
  ball.motion = [](double t, std::span<Shape> shapes) { shapes[0] = Sphere{{0, -0.4, 0.5 * std::cos(2 * t)}, 0.15}; };
  world->add_collider(ball);
  return world;
}

TEST(Frames, OfAnyLengthGiveBitwiseTheSameTicks) {
  Random random;
  SCOPED_TRACE(random.trace());
  for (const auto precision : {softbody::Precision::Float, softbody::Precision::Double}) {
    // Every tick of the reference, one frame each.
    auto reference = windy_scene(precision);
    std::vector<Points<double>> ticks{reference->find("flag")->positions()};
    for (int i = 0; i < 2 * kTick + 24; ++i) {
      ASSERT_TRUE(reference->update(1 / kTick).good());
      ticks.push_back(reference->find("flag")->positions());
    }
    EXPECT_GT(reference->find("flag")->displacement().norm(), 0.02);
    for (const double rate : {30.0, 60.0, 144.0, 240.0, 0.0}) {
      SCOPED_TRACE(rate);
      auto world = windy_scene(precision);
      while (world->time() < 2) {
        ASSERT_TRUE(world->update(rate > 0 ? 1 / rate : random.uniform(0, 0.05)).good());
        const auto tick = std::size_t(world->clock().ticks());
        ASSERT_TRUE((world->find("flag")->positions() == ticks.at(tick)).all()) << "tick " << tick;
      }
    }
  }
}

TEST(Bodies, WithoutPhysicsAreSkipped) {
  World world(kTick);
  auto& still = world.add(body_of(point<double>({1, 2, 3}, {4, 0, 0}), {}, "still"));
  auto& falling = world.add(body_of(point<double>({1, 2, 3}, {4, 0, 0}), {}, "falling"));
  still.set_physics(false);
  still.add_force(0, {100, 0, 0});
  ASSERT_TRUE(world.update(0.5).good());
  EXPECT_EQ(row(still.positions(), 0), Vec3(1, 2, 3));
  EXPECT_EQ(row(still.velocities(), 0), Vec3(4, 0, 0));
  EXPECT_GT(falling.displacement().norm(), 1);
  still.set_physics(true);
  ASSERT_TRUE(world.update(0.5).good());
  EXPECT_NEAR(still.positions()(0, 0), 1 + 0.5 * 4, 1e-12);  // the push of then is forgotten
}

TEST(World, GivesTheSameBitsWhoeverRunsItsBodies) {
  const auto run_with = [](const ParallelFor& parallel) {
    World world(kTick);
    world.set_parallel_for(parallel);
    for (int i = 0; i < 5; ++i)
      world.add(body_of(point<float>({double(i), 0, 0}, {0.1 * i, 1, 0}), {}, "point " + std::to_string(i)));
    EXPECT_TRUE(world.update(1).good());
    Points<double> out(5, 3);
    for (int i = 0; i < 5; ++i) out.row(i) = world.bodies()[std::size_t(i)]->positions().row(0);
    return out;
  };
  const auto backwards = [](Index n, const std::function<void(Index)>& work) {
    for (Index i = n; i-- > 0;) work(i);
  };
  EXPECT_TRUE((run_with({}) == run_with(backwards)).all());
}

}  // namespace
}  // namespace hooke::test
