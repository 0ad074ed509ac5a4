// Bounces: the digits of the bouncing ball, rest, thin plates, and that no way of computing them differs.
#include "scene.hpp"

#include <Eigen/Geometry>
#include <random>

namespace hooke::particles {
namespace {

template <class S>
class Bounce : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Bounce, Scalars);

// Exact impacts, dropped from 1 m; returns when it came to rest and how far it went.
template <class S>
std::pair<double, double> drop(double e, double rest_speed, const Method& method, double dt) {
  ParticleSettings settings;
  settings.exact_impacts = true, settings.rest_speed = rest_speed, settings.method = &method, settings.dt = dt;
  World world(240);
  world.add_collider(floor_at(0, e));
  auto& system = world.add(std::make_unique<ParticleSystem<S>>(settings));
  system.add(thrown(Vec3(0, 1, 0), Vec3::Zero()));
  double last_move = 0;
  for (int i = 0; i < 240 * 6; ++i) {
    EXPECT_TRUE(world.update(1.0 / 240).good());
    if (system.velocities()(0, 1) != 0 || system.positions()(0, 1) > 1e-9) last_move = world.time();
  }
  EXPECT_EQ(system.velocities()(0, 1), 0);
  EXPECT_NEAR(system.positions()(0, 1), 0, 1e-9);
  return {last_move, 0};
}

TYPED_TEST(Bounce, ComesToRestInTheTimeOfTheSeries) {
  // Within the tick in which the last bounce ends.
  for (const auto& [e, total] : {std::pair(0.5, 1.354570923), std::pair(0.8, 4.063712769)}) {
    const double last = drop<TypeParam>(e, sizeof(TypeParam) == 4 ? 1e-5 : 1e-10, verlet(), 0).first;
    EXPECT_NEAR(last, total, 1.0 / 240 + 1e-6) << e;
  }
}

// The ball after a time that is not a multiple of anything: ticks are cut to end there.
template <class S>
struct Ball {
  double height, speed;
  Ball(double e, double time, double rest_speed) {
    ParticleSettings settings;
    settings.exact_impacts = true, settings.rest_speed = rest_speed;
    World world(64 / time);
    world.add_collider(floor_at(0, e));
    auto& system = world.add(std::make_unique<ParticleSystem<S>>(settings));
    system.add(thrown(Vec3(0, 1, 0), Vec3::Zero()));
    EXPECT_TRUE(world.update(time).good());
    height = system.positions()(0, 1), speed = system.velocities()(0, 1);
  }
};

// The n-th flight is highest at a known time, with height e^2n; the sum of all ways is the series' length.
TYPED_TEST(Bounce, TimesHeightsAndLengthAreTheSeries) {
  const bool single = sizeof(TypeParam) == 4;
  for (const auto& [e, length] : {std::pair(0.5, 1.666666667), std::pair(0.8, 4.555555556)}) {
    double time = std::sqrt(2 / 9.81), flight = 2 * e * time, way = 1;
    for (int n = 1; n <= (single ? 6 : 60); ++n) {
      const Ball<TypeParam> ball(e, time + flight / 2, 1e-10);
      const double height = std::pow(e, 2 * n);
      EXPECT_NEAR(ball.height, height, single ? 1e-5 : 1e-9) << e << " bounce " << n;
      EXPECT_NEAR(ball.speed, 0, single ? 1e-4 : 1e-8) << e << " bounce " << n;
      way += 2 * ball.height;
      time += flight, flight *= e;
    }
    // Float's six flights leave the rest of the series out.
    const double rest = 2 * std::pow(e, 14) / (1 - e * e);
    EXPECT_NEAR(way + (single ? rest : 0), length, single ? 5e-5 : 1e-9) << e;
  }
}

TEST(ExactBounce, RestsAtTheSeriesTimeToItsDigits) {
  for (const auto& [e, total] : {std::pair(0.5, 1.354570923), std::pair(0.8, 4.063712769)}) {
    const Ball<double> before(e, total - 1e-7, 1e-10), after(e, total + 2e-9, 1e-10);
    EXPECT_NE(before.speed, 0) << e;
    EXPECT_EQ(after.speed, 0) << e;
    EXPECT_NEAR(after.height, 0, 1e-12) << e;
  }
}

TYPED_TEST(Bounce, ADefaultBallComesToRestAndStaysBitwise) {
  ParticleSettings settings;
  World world;
  world.add_collider(floor_at(0, 0.7, 0.4));
  auto& system = world.add(std::make_unique<ParticleSystem<TypeParam>>(settings));
  system.add(thrown(Vec3(0, 1, 0), Vec3(2, 0, 1)));
  EXPECT_TRUE(world.update(8).good());
  EXPECT_EQ(system.velocities().row(0).matrix().norm(), 0);
  EXPECT_EQ(system.positions()(0, 1), 0);
  const std::string still = bytes(system);
  EXPECT_TRUE(world.update(60).good());
  EXPECT_EQ(bytes(system), still);
}

TYPED_TEST(Bounce, RestsOnASlopeOnlyWhereFrictionHolds) {
  for (const double friction : {0.2, 0.7}) {
    ParticleSettings settings;
    World world;
    Collider slope;
    slope.shapes = {HalfSpace{Vec3(0.5, std::sqrt(0.75), 0), 0}};  // 30 degrees: holds from 0.577 on
    slope.friction = friction;
    world.add_collider(slope);
    auto& system = world.add(std::make_unique<ParticleSystem<TypeParam>>(settings));
    system.add(thrown(Vec3::Zero(), Vec3::Zero()));
    EXPECT_TRUE(world.update(1).good());
    const double moved = system.positions().row(0).matrix().norm();
    if (friction > 0.577)
      EXPECT_LT(moved, 1e-4);
    else  // ½ g (sin 30° - μ cos 30°) t²
      EXPECT_NEAR(moved, 0.5 * 9.81 * (0.5 - friction * std::sqrt(0.75)), 0.03);
  }
}

TEST(ExactBounce, WithoutLossEnergyStays) {
  ParticleSettings settings;
  World world;
  world.add_collider(floor_at(0, 1));
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  system.add(thrown(Vec3(0, 1, 0), Vec3(0.3, 0, 0)));
  const double start = world.energy().total();
  double worst = 0;
  for (int i = 0; i < 240 * 60; ++i) {
    EXPECT_TRUE(world.update(1.0 / 240).good());
    worst = std::max(worst, std::abs(world.energy().total() - start));
  }
  EXPECT_LT(worst, 0.01 * start);
}

// A plate of 1 mm, 30 frames a second, 100 m/s: at one substep a tick a spark goes 0.42 m.
TEST(Plate, NoSparkPassesAThinPlate) {
  constexpr Index n = 1'000'000;
  ParticleSettings settings;
  settings.capacity = n, settings.keeps_previous = false;
  World world;
  world.set_gravity(Vec3::Zero());
  Collider plate;
  plate.shapes = {Box{Vec3(0, 0, 0), Vec3(0.0005, 50, 50), Mat3::Identity()}};
  plate.restitution = 0.5;
  world.add_collider(plate);
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  EmitterSettings emitter;
  emitter.position = Vec3(-3, 0, 0), emitter.axis = Vec3(1, 0, 0), emitter.spread = 1;
  emitter.speed = 100, emitter.bursts = {{0, n, 0}};
  system.add_emitter(emitter);
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(world.update(1.0 / 30).good());
  ASSERT_EQ(system.size(), n);
  const auto x = system.state_positions();
  const auto v = system.state_velocities();
  Index passed = 0, bounced = 0;
  for (Index i = 0; i < n; ++i) {
    passed += x(i, 0) > -0.00049f && std::abs(x(i, 1)) < 49 && std::abs(x(i, 2)) < 49;
    bounced += v(i, 0) < 0;
  }
  EXPECT_EQ(passed, 0);
  EXPECT_GT(bounced, n * 9 / 10);
}

struct Form {
  const char* name;
  Shape shape;
};

class OnEverySolid : public testing::TestWithParam<Form> {};

// Rain on a solid: nobody is ever inside, and what comes back is slower.
TEST_P(OnEverySolid, NobodyGetsIn) {
  ParticleSettings settings;
  settings.capacity = 3000;
  World world;
  Collider solid;
  solid.shapes = {GetParam().shape};
  solid.restitution = 0.4, solid.friction = 0.2;
  world.add_collider(solid);
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  EmitterSettings emitter;
  emitter.source = BoxSource{Vec3(0.8, 0.1, 0.8)};
  emitter.position = Vec3(0, 2, 0), emitter.axis = Vec3(0, -1, 0), emitter.speed = {0, 60}, emitter.rate = 2000;
  emitter.lifetime = 1;
  system.add_emitter(emitter);
  double deepest = 0;
  for (int i = 0; i < 240 * 2; ++i) {
    ASSERT_TRUE(world.update(1.0 / 240).good());
    const auto x = system.positions();
    for (Index k = 0; k < system.size(); ++k)
      deepest = std::min(deepest, signed_distance(GetParam().shape, Vec3(x.row(k).matrix().transpose())));
  }
  EXPECT_GT(deepest, -1e-4) << GetParam().name;
  EXPECT_GT(system.size(), 1000);
}

DistanceGrid sampled(const Shape& shape, double voxel) {
  const int n = int(2 / voxel) + 1;
  std::vector<float> values;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        values.push_back(float(signed_distance(shape, Vec3(-1, -1, -1) + voxel * Vec3(i, j, k))));
  return DistanceGrid(Vec3(-1, -1, -1), voxel, {n, n, n}, values);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, OnEverySolid,
    testing::Values(Form{"half-space", HalfSpace{Vec3(0.6, 0.8, 0), -0.2}}, Form{"sphere", Sphere{Vec3(0, 0, 0), 0.5}},
                    Form{"capsule", Capsule{Vec3(-0.5, 0, 0), Vec3(0.5, 0.3, 0), 0.2}},
                    Form{"box", Box{Vec3(0, 0, 0), Vec3(0.5, 0.01, 0.5),
                                    Eigen::AngleAxisd(0.4, Vec3(1, 0, 1).normalized()).toRotationMatrix()}},
                    Form{"level-set",
                         LevelSet{std::make_shared<DistanceGrid>(sampled(Sphere{Vec3(0, 0, 0), 0.5}, 0.05)),
                                  Vec3(0, 0, 0)}}),
    [](const auto& form) {
      std::string name = form.param.name;
      name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
      return name;
    });

TEST(Contact, RestsOnABoxWithoutCreeping) {
  ParticleSettings settings;
  World world;
  Collider box;
  box.shapes = {Box{Vec3(0, 0.5, 0), Vec3(1, 0.5, 1), Mat3::Identity()}};
  box.friction = 0.5;
  world.add_collider(box);
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add(thrown(Vec3(0.2, 1.4, 0.1), Vec3(0.5, 0, 0)));
  ASSERT_TRUE(world.update(4).good());
  EXPECT_LT(system.velocities().row(0).matrix().norm(), 1e-4);
  const Vec3 rest = system.positions().row(0).matrix().transpose();
  EXPECT_NEAR(rest.y(), 1, 1e-4);
  ASSERT_TRUE(world.update(60).good());
  EXPECT_LT((Vec3(system.positions().row(0).matrix().transpose()) - rest).norm(), 1e-5);
}

TEST(Contact, AMovingWallPushesAndABatMeetsTheBall) {
  ParticleSettings settings;
  World world;
  world.set_gravity(Vec3::Zero());
  Collider bat;
  bat.shapes = {Box{Vec3(-1, 0, 0), Vec3(0.01, 1, 1), Mat3::Identity()}};
  bat.motion = [](double t, std::span<Shape> shapes) {
    shapes[0] = Box{Vec3(-1 + 20 * t, 0, 0), Vec3(0.01, 1, 1), Mat3::Identity()};
  };
  bat.restitution = 1, bat.friction = 0;
  world.add_collider(bat);
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  system.add(thrown(Vec3::Zero(), Vec3::Zero()));
  ASSERT_TRUE(world.update(0.2).good());
  EXPECT_NEAR(system.velocities()(0, 0), 40, 1e-6);
}

TEST(Contact, ACallbackIsASolid) {
  ParticleSettings settings;
  World world;
  Collider engine;
  engine.distance = [](double, const Points<double>& x, Values<double>& distance, Points<double>& normal) {
    distance = x.col(1);
    normal.setZero();
    normal.col(1).setOnes();
  };
  engine.friction = 1;
  world.add_collider(engine);
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add(thrown(Vec3(0, 0.5, 0), Vec3(1, 0, 0)));
  ASSERT_TRUE(world.update(3).good());
  EXPECT_NEAR(system.positions()(0, 1), 0, 1e-3);
  EXPECT_NEAR(system.velocities()(0, 0), 0, 1e-3);
}

TEST(Contact, StartsInsideArePushedOutAtABoundedSpeed) {
  ParticleSettings settings;
  World world;
  world.set_gravity(Vec3::Zero());
  Collider ball;
  ball.shapes = {Sphere{Vec3(0, 0, 0), 0.5}};
  world.add_collider(ball);
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  system.add(thrown(Vec3(0.1, 0.1, 0), Vec3::Zero()));
  for (int i = 0; i < 240; ++i) {
    const Vec3 before = system.positions().row(0).matrix().transpose();
    ASSERT_TRUE(world.update(1.0 / 240).good());
    EXPECT_LT((Vec3(system.positions().row(0).matrix().transpose()) - before).norm(), 2.0 / 240 + 1e-9);
  }
  EXPECT_NEAR(system.positions().row(0).matrix().norm(), 0.5, 1e-6);
  EXPECT_LT(system.velocities().row(0).matrix().norm(), 1e-9);
}

// A world with one collider and one particle.
template <class S>
struct Alone {
  World world{240};
  ParticleSystem<S>* system;
  Alone(Collider collider, ParticleSettings settings, const Vec3& x, const Vec3& v) {
    world.add_collider(std::move(collider));
    system = &world.add(std::make_unique<ParticleSystem<S>>(settings));
    system->add(thrown(x, v));
  }
  Vec3 x() const { return system->positions().row(0).matrix().transpose(); }
  Vec3 v() const { return system->velocities().row(0).matrix().transpose(); }
  void run(double seconds) { ASSERT_TRUE(world.update(seconds).good()); }
};

Collider solid(Shape shape, double restitution = 0, double friction = 0) {
  Collider out;
  out.shapes = {std::move(shape)};
  out.restitution = restitution, out.friction = friction;
  return out;
}

TEST(ExactBounce, RestsOnBoxesBallsAndSlopesWithoutSinkingOrCreeping) {
  ParticleSettings settings;
  settings.exact_impacts = true;
  for (const Shape& shape :
       {Shape(Box{Vec3(0, -0.5, 0), Vec3(1, 0.5, 1), Mat3::Identity()}), Shape(Sphere{Vec3(0, -0.5, 0), 0.5})}) {
    Alone<double> ball(solid(shape, 0.8), settings, Vec3(0, 0.1, 0), Vec3::Zero());
    ball.run(8);
    EXPECT_NEAR(ball.x().y(), 0, 1e-9);
    EXPECT_NEAR(ball.v().norm(), 0, 1e-9);
  }
  Alone<double> slope(solid(HalfSpace{Vec3(0.5, std::sqrt(0.75), 0), 0}, 0, 1), settings, Vec3::Zero(), Vec3::Zero());
  slope.run(2);
  EXPECT_LT(slope.x().norm(), 1e-9);
}

TEST(ExactBounce, TellsImpactsThatDoNotBounceAndMeetsCallbacks) {
  ParticleSettings settings;
  settings.exact_impacts = true, settings.dies_on_impact = true;
  Alone<double> dropped(solid(HalfSpace{}), settings, Vec3(0, 1, 0), Vec3::Zero());
  dropped.run(1);
  EXPECT_EQ(dropped.system->size(), 0);
  settings.dies_on_impact = false;
  Collider engine;
  engine.distance = [](double, const Points<double>& x, Values<double>& distance, Points<double>& normal) {
    distance = x.col(1);
    normal.setZero();
    normal.col(1).setOnes();
  };
  Alone<double> caught(engine, settings, Vec3(0, 1, 0), Vec3::Zero());
  caught.run(1);
  EXPECT_NEAR(caught.x().y(), 0, 0.01);
}

TEST(Contact, FastOnesDoNotPassSmallLevelSets) {
  std::vector<float> values;
  for (int k = 0; k < 13; ++k)
    for (int j = 0; j < 13; ++j)
      for (int i = 0; i < 13; ++i) values.push_back(float((0.025 * Vec3(i - 6, j - 6, k - 6)).norm() - 0.1));
  const auto grid =
      std::make_shared<DistanceGrid>(Vec3::Constant(-0.15), 0.025, std::array<int, 3>{13, 13, 13}, values);
  for (int i = 0; i < 40; ++i) {
    ParticleSettings settings;
    Alone<float> shot(solid(LevelSet{grid, Vec3::Zero()}, 1), settings, Vec3(-3 + 0.01 * i, 0, 0), Vec3(90, 0, 0));
    shot.world.set_gravity(Vec3::Zero());
    shot.run(0.1);
    EXPECT_LT(shot.x().x(), 0) << i;
  }
}

TEST(Contact, ATurningCapsuleHitsWithTheSpeedOfItsEnd) {
  Collider bat = solid(Capsule{Vec3(0, 0, 0), Vec3(1, 0, 0), 0.02}, 1);
  bat.motion = [](double t, std::span<Shape> shapes) {
    shapes[0] = Capsule{Vec3::Zero(), Vec3(std::cos(10 * t), std::sin(10 * t), 0), 0.02};
  };
  ParticleSettings settings;
  Alone<double> ball(bat, settings, Vec3(0.95 * std::cos(0.5), 0.95 * std::sin(0.5), 0), Vec3::Zero());
  ball.world.set_gravity(Vec3::Zero());
  ball.run(0.2);
  EXPECT_NEAR(ball.v().norm(), 2 * 9.5, 0.5);
}

TEST(Contact, EverySplittingRestsAndSoDoTopsOfBoxes) {
  for (const Method* method : {&verlet(), &semi_implicit_euler(), &pefrl(), &blanes_moan_4()}) {
    ParticleSettings settings;
    settings.method = method;
    Alone<float> ball(floor_at(0, 0.5), settings, Vec3(0, 0.3, 0), Vec3::Zero());
    ball.run(3);
    EXPECT_EQ(ball.v().norm(), 0) << method->name;
  }
  for (const double half : {0.1, 0.25, 0.3, 0.7}) {
    Alone<float> ball(solid(Box{Vec3::Zero(), Vec3::Constant(half), Mat3::Identity()}, 0.3), {}, Vec3(0, 1, 0),
                      Vec3::Zero());
    ball.run(3);
    EXPECT_LT(ball.v().norm(), 1e-6) << half;
  }
}

TEST(Contact, AFloorThatIsAlmostLevelIsNotTakenForOne) {
  ParticleSettings settings;
  World world;
  const Vec3 normal = Vec3(-2e-4, 1, 0).normalized();
  world.add_collider(solid(HalfSpace{normal, 0}, 0, 1));
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  for (int i = 0; i < 64; ++i) system.add(thrown(Vec3(50, 0.2, 0), Vec3::Zero()));
  ASSERT_TRUE(world.update(2).good());
  for (Index i = 0; i < 64; ++i) EXPECT_NEAR(system.positions().row(i).matrix().dot(normal), 0, 1e-4);
}

}  // namespace
}  // namespace hooke::particles
