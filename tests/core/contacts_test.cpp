// Points against prescribed solids: nothing passes, nothing creeps, nothing is thrown out.
#include "core/problems.hpp"

#include <Eigen/Geometry>

#include <numbers>

namespace hooke::test {
namespace {

constexpr double kTickRate = 240;

template <class S>
PointBody<S>& add_point(World& world, const Vec3& x, const Vec3& v, double thickness = 0, double dt = 0,
                        const Method& method = semi_implicit_euler()) {
  MotionSettings settings = motion(method, dt);
  settings.thickness = thickness;
  return world.add(body_of(point<S>(x, v), settings));
}

Collider solid(Shape shape, double friction = 0, double restitution = 0) {
  return {"solid", {shape}, {}, {}, friction, restitution};
}

Collider moving(std::function<Shape(double)> shape, double friction = 0) {
  return {"mover", {shape(0)}, [shape](double t, std::span<Shape> out) { out[0] = shape(t); }, {}, friction, 0};
}

// A ball of radius 0.5 sampled at `voxel`, exact at the samples.
std::shared_ptr<const DistanceGrid> ball_grid(double voxel) {
  const int n = int(std::ceil(1.3 / voxel)) + 1;
  const Vec3 lower = Vec3::Constant(-0.65);
  std::vector<float> values;
  values.reserve(std::size_t(n) * std::size_t(n) * std::size_t(n));
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) values.push_back(float((lower + voxel * Vec3(x, y, z)).norm() - 0.5));
  return std::make_shared<const DistanceGrid>(lower, voxel, std::array{n, n, n}, std::move(values));
}

Mat3 turned(double angle, const Vec3& axis) { return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(); }

template <class S>
class Contact : public ::testing::Test {
 public:
  // A point of a tick's rounding: 1e-6 m in float, 1e-12 m in double.
  static constexpr double kTolerance = 20 * kUnit<S>;
};
TYPED_TEST_SUITE(Contact, Scalars);

TYPED_TEST(Contact, KeepsTheThicknessFromEveryShape) {
  using S = TypeParam;
  for (const Method* method : methods())
    for (const Shape& shape : {Shape(HalfSpace{{0, 1, 0}, 0.3}), Shape(Sphere{{0, -0.2, 0}, 0.5}),
                               Shape(Capsule{{-1, -0.2, 0}, {1, -0.2, 0}, 0.5})}) {
      SCOPED_TRACE(std::string(method->name) + ", shape " + std::to_string(shape.index()));
      World world(kTickRate);
      world.add_collider(solid(shape));
      auto& body = add_point<S>(world, {0, 0.5, 0}, {0, 0, 0}, 0.02, 0, *method);
      for (int frame = 0; frame < 120; ++frame) {
        ASSERT_TRUE(world.update(1.0 / 60).good());
        EXPECT_GE(signed_distance(shape, row(body.positions(), 0)), 0.02 - this->kTolerance);
      }
      EXPECT_NEAR(signed_distance(shape, row(body.positions(), 0)), 0.02, this->kTolerance);
      // Methods that kick after the contact show that kick, and lose it in the next contact.
      EXPECT_LE(body.speed(0), 9.81 / kTickRate + 1e-5);
    }
}

TYPED_TEST(Contact, BouncesByTheRestitution) {
  using S = TypeParam;
  World world(kTickRate);
  world.enable_gravity(false);
  world.add_collider(solid(HalfSpace{{0, 1, 0}, 0}, 0, 0.6));
  auto& body = add_point<S>(world, {0, 0.1, 0}, {1, -2, 0});
  ASSERT_TRUE(world.update(0.5).good());
  EXPECT_NEAR(body.velocities()(0, 1), 1.2, 1e-6);
  EXPECT_NEAR(body.velocities()(0, 0), 1, 1e-6);
}

template <class S>
void shoot_at_a_thin_rod() {
  Random random;
  SCOPED_TRACE(random.trace());
  for (const double dt : {1.0 / 60, 1.0 / 240, 1e-3}) {
    for (int shot = 0; shot < 20; ++shot) {
      SCOPED_TRACE(std::to_string(dt) + " s, shot " + std::to_string(shot));
      World world(60);
      world.enable_gravity(false);
      world.add_collider(solid(Capsule{{-1, 0, 0}, {1, 0, 0}, 0.005}));
      // Straight at the axis, from wherever.
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      const Vec3 away{0, std::cos(angle), std::sin(angle)};
      double distance = random.uniform(1, 20);
      // Not to end a step within the rod: that is the next test's.
      const double step = 1000 / (60 * std::ceil(1 / (60 * dt) - 1e-9));
      while (std::abs(std::remainder(distance, step)) < 0.01) distance += 0.02;
      auto& body = add_point<S>(world, distance * away, -1000 * away, 0, dt);
      for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(world.update(1.0 / 60).good());
      // Float resolves 2e-6 m at 20 m, which turns the normal of a rod of 5 mm by a milliradian: of
      // 1000 m/s a metre a second or two is left, sideways.
      constexpr bool kFloat = std::is_same_v<S, float>;
      EXPECT_GE(row(body.positions(), 0).dot(away), 0.005 - (kFloat ? 1e-4 : 1e-9));
      EXPECT_LT(row(body.positions(), 0).norm(), kFloat ? 0.1 : 0.02);
    }
  }
}

TEST(ThinRod, StopsAPointOfAThousandMetresASecond) { shoot_at_a_thin_rod<double>(); }

// A step that ends just under the far side of the rod.
TEST(ThinRod, StopsAPointThatEndsItsStepInTheFarSide) {
  World world(60);
  world.enable_gravity(false);
  world.add_collider(solid(Capsule{{-1, 0, 0}, {1, 0, 0}, 0.005}));
  auto& body = add_point<double>(world, {0, 1000.0 / 60 - 0.0045, 0}, {0, -1000, 0}, 0, 1.0 / 60);
  ASSERT_TRUE(world.update(3.0 / 60).good());
  EXPECT_NEAR(body.positions()(0, 1), 0.005, 1e-9);
}

TEST(ThinRod, StopsAPointOfAThousandMetresASecondInFloat) { shoot_at_a_thin_rod<float>(); }

TYPED_TEST(Contact, OfAFastLimbPushesARestingPointAlong) {
  using S = TypeParam;
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    SCOPED_TRACE(dt);
    World world(60);
    world.enable_gravity(false);
    const auto limb = [](double t) { return Shape(Capsule{{-2 + 20 * t, -1, 0}, {-2 + 20 * t, 1, 0}, 0.05}); };
    world.add_collider(moving(limb));
    auto& body = add_point<S>(world, {0, 0, 0}, {0, 0, 0}, 0, dt);
    ASSERT_TRUE(world.update(0.2).good());
    // Ahead of the limb, not behind it.
    EXPECT_GE(body.positions()(0, 0), -2 + 20 * world.time() + 0.05 - 1e-3);
    EXPECT_NEAR(body.velocities()(0, 0), 20, 0.1);
  }
}

// The speed down an incline of that angle after five seconds, and how far it went.
struct Slide {
  double speed, way, lift;
};
template <class S>
Slide slide(double angle, double friction, const Method& method) {
  World world(kTickRate);
  const Vec3 normal{std::sin(angle), std::cos(angle), 0}, down{std::cos(angle), -std::sin(angle), 0};
  world.add_collider(solid(HalfSpace{normal, 0}, friction));
  auto& body = add_point<S>(world, {0, 0, 0}, {0, 0, 0}, 0, 0, method);
  for (int frame = 0; frame < 300; ++frame) EXPECT_TRUE(world.update(1.0 / 60).good());
  const Vec3 x = row(body.positions(), 0);
  return {row(body.velocities(), 0).dot(down), x.dot(down), x.dot(normal)};
}

TYPED_TEST(Contact, SticksOnAnInclineBelowTheAngleOfFriction) {
  using S = TypeParam;
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    const Slide stuck = slide<S>(0.4, 0.5, *method);  // tan 0.4 = 0.4228
    EXPECT_NEAR(stuck.way, 0, 1e-6);
    EXPECT_NEAR(stuck.speed, 0, 9.81 / kTickRate);  // at most the last kick
  }
}

TYPED_TEST(Contact, SlidesOnAnInclineAboveTheAngleOfFriction) {
  using S = TypeParam;
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    const double angle = 0.6, friction = 0.3;
    const double a = 9.81 * (std::sin(angle) - friction * std::cos(angle));
    const Slide sliding = slide<S>(angle, friction, *method);
    EXPECT_NEAR(sliding.speed, 5 * a, 0.01 * 5 * a);
    EXPECT_NEAR(sliding.way, 12.5 * a, 0.01 * 12.5 * a);
    EXPECT_NEAR(sliding.lift, 0, 1e-4);
  }
}

TYPED_TEST(Contact, WithADistanceCallbackIsThatOfTheShapeItself) {
  using S = TypeParam;
  const auto fall = [](Collider collider) {
    World world(kTickRate);
    world.add_collider(std::move(collider));
    auto& body = add_point<S>(world, {0.1, 1, 0.05}, {0, 0, 0}, 0.01);
    std::vector<Vec3> path;
    for (int frame = 0; frame < 45; ++frame) {
      EXPECT_TRUE(world.update(1.0 / 60).good());
      path.push_back(row(body.positions(), 0));
    }
    return path;
  };
  const Sphere sphere{{0, 0, 0}, 0.5};
  Collider callback{"callback", {}, {}, {}, 0.1, 0};
  callback.distance = [&](double, const Points<double>& x, Values<double>& distance, Points<double>& normal) {
    for (Index i = 0; i < x.rows(); ++i) {
      distance[i] = signed_distance(sphere, row(x, i));
      normal.row(i) = (row(x, i) - sphere.center).normalized().transpose().array();
    }
  };
  const auto built_in = fall(solid(sphere, 0.1)), called = fall(callback);
  for (std::size_t i = 0; i < built_in.size(); ++i) EXPECT_LT((built_in[i] - called[i]).norm(), 2e-3) << "frame " << i;
}

TYPED_TEST(Contact, WithASphereThatMovesCarriesAPointByFriction) {
  using S = TypeParam;
  World world(kTickRate);
  const auto ball = [](double t) { return Shape(Sphere{{0.5 * t * t, 0, 0}, 1}); };  // 1 m/s²
  world.add_collider(moving(ball, 0.8));
  auto& body = add_point<S>(world, {0, 1, 0}, {0, 0, 0});
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.positions()(0, 0), 0.5, 5e-3);
  EXPECT_NEAR(body.velocities()(0, 0), 1, 2e-2);
  // Without friction it stays behind.
  World slippery(kTickRate);
  slippery.add_collider(moving(ball, 0));
  auto& left = add_point<S>(slippery, {0, 1, 0}, {0, 0, 0});
  ASSERT_TRUE(slippery.update(0.3).good());
  EXPECT_LT(left.positions()(0, 0), 0.02);
}

TYPED_TEST(Contact, PushesAStartInsideOutAtABoundedSpeed) {
  using S = TypeParam;
  const auto grid = ball_grid(0.05);
  for (const Method* method : methods())
    for (const Shape& shape :
         {Shape(HalfSpace{{0, 1, 0}, 0.4}), Shape(Sphere{{0, -0.1, 0}, 0.5}),
          Shape(Capsule{{-1, -0.1, 0}, {1, -0.1, 0}, 0.5}),
          Shape(Box{{0.1, -0.1, 0}, {0.6, 0.5, 0.7}, Mat3::Identity()}), Shape(LevelSet{grid, {0, -0.1, 0}})}) {
      SCOPED_TRACE(std::string(method->name) + ", shape " + std::to_string(shape.index()));
      World world(kTickRate);
      world.add_collider(solid(shape));
      auto& body = add_point<S>(world, {0, 0, 0}, {0, 0, 0}, 0, 0, *method);
      Vec3 before = row(body.positions(), 0);
      for (int tick = 0; tick < kTickRate; ++tick) {
        ASSERT_TRUE(world.update(1 / kTickRate).good());
        const Vec3 now = row(body.positions(), 0);
        EXPECT_LE((now - before).norm() * kTickRate, 2 + 9.81 / kTickRate + 1e-3) << "tick " << tick;
        EXPECT_LE(body.speed(0), 2 + 9.81 / kTickRate);
        before = now;
      }
      EXPECT_NEAR(signed_distance(shape, before), 0, 1e-5);
    }
}

TYPED_TEST(Contact, IsIgnoredByABodyThatDoesNotCollide) {
  using S = TypeParam;
  World world(kTickRate);
  world.add_collider(solid(HalfSpace{}));
  MotionSettings settings;
  settings.collides = false;
  auto& body = world.add(body_of(point<S>({0, 0.1, 0}, {0, 0, 0}), settings));
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.positions()(0, 1), 0.1 - 9.81 / 2, 1e-4);
}

TYPED_TEST(Contact, OnAFloorStaysStillForMinutes) {
  using S = TypeParam;
  World world(kTickRate);
  world.add_collider(solid(HalfSpace{}, 0.3));
  auto& body = add_point<S>(world, {0.3, 0, 0.7}, {0, 0, 0});
  ASSERT_TRUE(world.update(1).good());
  const Vec3 settled = row(body.positions(), 0);
  ASSERT_TRUE(world.update(120).good());
  EXPECT_EQ(row(body.positions(), 0), settled);
}

TYPED_TEST(Contact, RestsOnABoxAtItsThickness) {
  using S = TypeParam;
  for (const Method* method : methods())
    for (const double thickness : {0.0, 0.02}) {
      SCOPED_TRACE(std::string(method->name) + ", thickness " + std::to_string(thickness));
      World world(kTickRate);
      const Box box{{0.2, -0.3, 0.1}, {0.6, 0.3, 0.4}, Mat3::Identity()};
      world.add_collider(solid(box, 0.3));
      auto& body = add_point<S>(world, {0.1, 0.2, 0}, {0, 0, 0}, thickness, 0, *method);
      for (int frame = 0; frame < 90; ++frame) {
        ASSERT_TRUE(world.update(1.0 / 60).good());
        EXPECT_GE(signed_distance(box, row(body.positions(), 0)), thickness - this->kTolerance);
      }
      EXPECT_NEAR(body.positions()(0, 1), thickness, this->kTolerance);
      EXPECT_NEAR(body.positions()(0, 0), 0.1, 1e-6);
    }
}

TYPED_TEST(Contact, SlidesAlongTheFaceOfATurnedBoxAsOnAnIncline) {
  using S = TypeParam;
  const double angle = 0.5, friction = 0.2, a = 9.81 * (std::sin(angle) - friction * std::cos(angle));
  const Mat3 axes = turned(-angle, {0, 0, 1});
  const Vec3 normal = axes.col(1), down = axes.col(0);
  World world(kTickRate);
  world.add_collider(solid(Box{-0.5 * normal, {10, 0.5, 1}, axes}, friction));
  auto& body = add_point<S>(world, {0, 0, 0}, {0, 0, 0});
  ASSERT_TRUE(world.update(1.5).good());
  const Vec3 x = row(body.positions(), 0), v = row(body.velocities(), 0);
  EXPECT_NEAR(v.dot(down), 1.5 * a, 0.02 * 1.5 * a);
  EXPECT_NEAR(x.dot(down), 1.125 * a, 0.02 * 1.125 * a);
  EXPECT_NEAR(x.dot(normal), 0, 1e-5);
}

// Beside the edge of a box, over it and down the side: it never gets faster than gravity makes it.
TYPED_TEST(Contact, OverTheEdgeOfABoxNeitherThrowsNorJitters) {
  using S = TypeParam;
  for (const double thickness : {0.0, 0.01}) {
    SCOPED_TRACE(thickness);
    World world(kTickRate);
    const Box box{{0, -0.5, 0}, {0.5, 0.5, 0.5}, Mat3::Identity()};
    world.add_collider(solid(box));
    auto& body = add_point<S>(world, {0.4, thickness, 0}, {0.3, 0, 0}, thickness);
    double highest = -1, energy = 0.5 * 0.09 + 9.81 * thickness;
    for (int tick = 0; tick < 200; ++tick) {
      ASSERT_TRUE(world.update(1 / kTickRate).good());
      const Vec3 x = row(body.positions(), 0), v = row(body.velocities(), 0);
      ASSERT_GE(signed_distance(box, x), thickness - 1e-5) << "tick " << tick;
      highest = std::max(highest, x.y());
      const double now = 0.5 * v.squaredNorm() + 9.81 * x.y();
      ASSERT_LE(now, energy + 9.81 * 9.81 / kTickRate / kTickRate + 1e-5) << "tick " << tick;
      energy = std::min(energy, now);
      ASSERT_GE(v.x(), 0.3 - 1e-5) << "tick " << tick;
    }
    EXPECT_LE(highest, thickness + 1e-5);
    EXPECT_LT(body.positions()(0, 1), -0.2);
  }
}

template <class S>
void shoot_at_a_thin_box() {
  Random random;
  SCOPED_TRACE(random.trace());
  for (const double thickness : {0.0, 0.005})
    for (const double dt : {1.0 / 60, 1.0 / 240, 1e-3})
      for (int shot = 0; shot < 30; ++shot) {
        SCOPED_TRACE(std::to_string(thickness) + " m, " + std::to_string(dt) + " s, shot " + std::to_string(shot));
        const Mat3 axes = turned(random.uniform(0, 3), random.vector(1));
        const Vec3 normal = axes.col(1), target = axes * Vec3(random.uniform(-0.4, 0.4), 0, random.uniform(-0.4, 0.4));
        World world(60);
        world.enable_gravity(false);
        world.add_collider(solid(Box{{0, 0, 0}, {0.5, 0.0005, 0.5}, axes}));
        auto& body = add_point<S>(world, target + random.uniform(0.1, 5) * normal, -1000 * normal, thickness, dt);
        for (int frame = 0; frame < 3; ++frame) {
          ASSERT_TRUE(world.update(1.0 / 60).good());
          const double height = row(body.positions(), 0).dot(normal);
          ASSERT_GE(height, 0.0005 + thickness - (std::is_same_v<S, float> ? 1e-5 : 1e-9)) << "frame " << frame;
          ASSERT_LT(height, 5);
        }
      }
}

TEST(ThinBox, StopsAPointOfAThousandMetresASecond) { shoot_at_a_thin_box<double>(); }
TEST(ThinBox, StopsAPointOfAThousandMetresASecondInFloat) { shoot_at_a_thin_box<float>(); }

// Within rounding of its surface a point is struck down: it must not come out below.
TYPED_TEST(Contact, HoldsAPointThatIsStruckWhileItRestsOnAThinBox) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  for (int place = 0; place < 20; ++place) {
    const Mat3 axes = turned(random.uniform(0, 3), random.vector(1));
    const Vec3 normal = axes.col(1), center = random.vector(5);
    World world(kTickRate);
    world.enable_gravity(false);
    world.add_collider(solid(Box{center, {1, 0.0005, 1}, axes}));
    auto& body = add_point<S>(world, center + 0.01 * normal, -normal);
    for (int blow = 0; blow < 20; ++blow) {
      ASSERT_TRUE(world.update(10 / kTickRate).good());
      // Every blow leaves the rounding of two metres of way.
      ASSERT_NEAR((row(body.positions(), 0) - center).dot(normal), 0.0005, 2000 * kUnit<S>) << "blow " << blow;
      body.set_velocity(0, -500 * normal + random.vector(0.1));
    }
  }
}

// A step that ends inside, nearer to the far side.
TYPED_TEST(Contact, HoldsAPointThatEndsItsStepInTheFarSideOfAThinBox) {
  using S = TypeParam;
  World world(60);
  world.enable_gravity(false);
  world.add_collider(solid(Box{{0, 0, 0}, {1, 0.005, 1}, Mat3::Identity()}));
  auto& body = add_point<S>(world, {0, 100.0 / 60 - 0.0045, 0}, {0, -100, 0}, 0, 1.0 / 60);
  ASSERT_TRUE(world.update(3.0 / 60).good());
  EXPECT_NEAR(body.positions()(0, 1), 0.005, 1e-6);
}

TYPED_TEST(Contact, OfAFastBoxPushesARestingPointAlong) {
  using S = TypeParam;
  World world(60);
  world.enable_gravity(false);
  world.add_collider(moving([](double t) { return Shape(Box{{-2 + 20 * t, 0, 0}, {0.05, 1, 1}, Mat3::Identity()}); }));
  auto& body = add_point<S>(world, {0, 0, 0}, {0, 0, 0}, 0, 1.0 / 60);
  ASSERT_TRUE(world.update(0.2).good());
  EXPECT_GE(body.positions()(0, 0), -2 + 20 * world.time() + 0.05 - 1e-3);
  EXPECT_NEAR(body.velocities()(0, 0), 20, 0.1);
}

// A turntable: what sticks to it goes round with it.
TYPED_TEST(Contact, WithABoxThatTurnsCarriesAPointByFriction) {
  using S = TypeParam;
  World world(kTickRate);
  world.add_collider(moving(
      [](double t) {
        return Shape(Box{{0, -0.1, 0}, {1, 0.1, 1}, turned(0.5 * t, {0, 1, 0})});
      },
      0.9));
  auto& body = add_point<S>(world, {0.5, 0, 0}, {0, 0, -0.25});
  ASSERT_TRUE(world.update(2).good());
  const Vec3 expected = turned(1, {0, 1, 0}) * Vec3(0.5, 0, 0);
  EXPECT_LT((row(body.positions(), 0) - expected).norm(), 5e-3) << row(body.positions(), 0).transpose();
}

TYPED_TEST(Contact, WithABallAsALevelSetIsThatOfTheBall) {
  using S = TypeParam;
  const auto fall = [](const Shape& shape, double thickness) {
    World world(kTickRate);
    world.add_collider(solid(shape, 0.1));
    auto& body = add_point<S>(world, {0.15, 1, 0.05}, {0, 0, 0}, thickness, 1e-3);
    std::vector<Vec3> path;
    for (int frame = 0; frame < 45; ++frame) {
      EXPECT_TRUE(world.update(1.0 / 60).good());
      path.push_back(row(body.positions(), 0));
    }
    return path;
  };
  for (const double thickness : {0.0, 0.02}) {
    const auto exact = fall(Sphere{{0, 0, 0}, 0.5}, thickness);
    double coarse = 0, fine = 0;
    const auto compare = [&](double voxel) {
      const auto path = fall(LevelSet{ball_grid(voxel), Vec3::Zero()}, thickness);
      double worst = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) worst = std::max(worst, (exact[i] - path[i]).norm());
      return worst;
    };
    coarse = compare(0.05), fine = compare(0.0125);
    EXPECT_LT(coarse, 0.05);
    EXPECT_LT(fine, 0.0125);
    EXPECT_LT(fine, coarse / 2);
  }
}

TYPED_TEST(Contact, ManyCollidersShareOneGrid) {
  using S = TypeParam;
  const auto grid = ball_grid(0.025);
  World world(kTickRate);
  for (int i = 0; i < 4; ++i) world.add_collider(solid(LevelSet{grid, {2.0 * i, 0, 0}}, 1));
  std::vector<PointBody<S>*> bodies;
  for (int i = 0; i < 4; ++i)
    bodies.push_back(&world.add(
        body_of(point<S>({2.0 * i, 0.6, 0}, {0, 0, 0}), motion(semi_implicit_euler()), "point" + std::to_string(i))));
  ASSERT_TRUE(world.update(1).good());
  for (int i = 0; i < 4; ++i)
    EXPECT_LT((row(bodies[std::size_t(i)]->positions(), 0) - Vec3(2.0 * i, 0.5, 0)).norm(), 2e-3) << i;
}

TYPED_TEST(Contact, OfALevelSetStopsAPointOfAThousandMetresASecond) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const auto grid = ball_grid(0.025);
  for (const double dt : {1.0 / 60, 1.0 / 240, 1e-3})
    for (int shot = 0; shot < 20; ++shot) {
      SCOPED_TRACE(std::to_string(dt) + " s, shot " + std::to_string(shot));
      const Vec3 away = random.vector(1).normalized(), center = random.vector(1);
      World world(60);
      world.enable_gravity(false);
      world.add_collider(solid(LevelSet{grid, center}));
      auto& body = add_point<S>(world, center + random.uniform(0.6, 20) * away, -1000 * away, 0, dt);
      for (int frame = 0; frame < 3; ++frame) {
        ASSERT_TRUE(world.update(1.0 / 60).good());
        const Vec3 x = row(body.positions(), 0) - center;
        ASSERT_GE(x.norm(), 0.5 - 1e-3) << "frame " << frame;
        ASSERT_GT(x.dot(away), -0.5) << "frame " << frame << ": behind";
      }
    }
}

TYPED_TEST(Contact, WithALevelSetThatMovesCarriesAPointByFriction) {
  using S = TypeParam;
  World world(kTickRate);
  const auto grid = ball_grid(0.025);
  world.add_collider(moving([grid](double t) { return Shape(LevelSet{grid, {0.5 * t * t, 0, 0}}); }, 0.8));
  auto& body = add_point<S>(world, {0, 0.5, 0}, {0, 0, 0});
  ASSERT_TRUE(world.update(1).good());
  EXPECT_NEAR(body.positions()(0, 0), 0.5, 1e-2);
  EXPECT_NEAR(body.velocities()(0, 0), 1, 3e-2);
}

TEST(Colliders, RefuseWhatMakesNoSense) {
  World world;
  EXPECT_THROW(world.add_collider(solid(Box{{0, 0, 0}, {1, 0, 1}, Mat3::Identity()})), std::invalid_argument);
  EXPECT_THROW(world.add_collider(solid(LevelSet{})), std::invalid_argument);
  EXPECT_THROW(world.add_collider(solid(HalfSpace{}, -1)), std::invalid_argument);
  EXPECT_THROW(world.add_collider(solid(HalfSpace{}, 0, 1.5)), std::invalid_argument);
}

// The planes of `points` between t0 and t1, as a body of that state asks for them.
template <class S>
std::vector<ContactPlane<S>> planes_of(const std::vector<Collider>& colliders, const PointMasses<S>& points, double t0,
                                       double t1, S reach) {
  Contacts<S> contacts;
  contacts.begin_tick(colliders, points, t0, t1, 0);
  std::vector<ContactPlane<S>> out;
  contacts.planes(t0, points.position, t1, reach, points.inverse_mass, out);
  return out;
}

TYPED_TEST(Contact, PlanesTellHowFarAPointMayGo) {
  using S = TypeParam;
  constexpr double kStep = 1.0 / 240;
  const PointMasses<S> points = point<S>({0.1, 0.503, 0}, {0, 0, 0});
  const auto all = [](double t, const Points<double>& x, Values<double>& distance, Points<double>& normal) {
    EXPECT_DOUBLE_EQ(t, kStep);
    distance = x.col(1) - 0.5;
    normal.col(1).setOnes();
  };
  std::vector<Collider> colliders = {solid(HalfSpace{{0, 1, 0}, 0.5}, 0.3, 0.7),
                                     solid(Box{{0, 0, 0}, {0.5, 0.5, 0.5}}),
                                     solid(LevelSet{ball_grid(0.02), {0.1, 0, 0}}),
                                     {"user's", {}, {}, all, 0.2, 0}};
  const auto planes = planes_of<S>(colliders, points, 0, kStep, S(0.05));
  ASSERT_EQ(planes.size(), 4u);
  // Between samples, trilinear interpolation is off by up to voxel² / (4 r) in a ball.
  constexpr double kSampled = 0.02 * 0.02 / (4 * 0.5);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const auto& plane = planes[i];
    EXPECT_EQ(plane.point, 0);
    EXPECT_NEAR(plane.gap, 0.003, i == 2 ? kSampled : 1e-6) << i;
    EXPECT_NEAR(plane.normal[1], 1, 1e-3);
    EXPECT_EQ(plane.carried.norm(), S(0));
  }
  EXPECT_EQ(planes[0].friction, S(0.3));
  EXPECT_EQ(planes[0].restitution, S(0.7));
  EXPECT_TRUE(planes_of<S>(colliders, points, 0, kStep, S(0.002)).empty());
}

TYPED_TEST(Contact, PlanesGoWithTheSolidAndPushOutSlowly) {
  using S = TypeParam;
  constexpr double kStep = 1.0 / 240;
  const std::vector<Collider> colliders = {moving([](double t) { return Shape(Sphere{{3 * t, 0, 0}, 0.5}); })};
  auto planes = planes_of<S>(colliders, point<S>({0, 0.5, 0}, {0, 0, 0}), 0, kStep, S(0.1));
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_NEAR(planes[0].gap, 0, 1e-6);
  EXPECT_NEAR(planes[0].carried[0], 3 * kStep, 1e-6);
  planes = planes_of<S>(colliders, point<S>({0, 0.3, 0}, {0, 0, 0}), 0, kStep, S(0.1));
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_NEAR(planes[0].gap, -Contacts<S>::kPushSpeed * kStep, 1e-6);
  PointMasses<S> held = point<S>({0, 0.5, 0}, {0, 0, 0});
  held.inverse_mass[0] = 0;
  EXPECT_TRUE(planes_of<S>(colliders, held, 0, kStep, S(0.1)).empty());
}

}  // namespace
}  // namespace hooke::test
