// At rest means at rest: bodies fall, settle, sleep with the state kept to the bit, and wake.
#include <hooke/softbody/lattice.hpp>
#include <hooke/softbody/soft_body.hpp>
#include <hooke/softbody/xpbd.hpp>
#include <hooke/world.hpp>

#include "softbody/sheet.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

namespace hooke::softbody {
namespace {

double rms_speed(const Body& body) { return std::sqrt(body.velocities().square().rowwise().sum().mean()); }

double residual(Body& body, const Vec3& gravity) {
  if (auto* single = dynamic_cast<PointBody<float>*>(&body)) return single->residual_force(gravity);
  return dynamic_cast<PointBody<double>&>(body).residual_force(gravity);
}

Collider floor() {
  Collider floor;
  floor.name = "floor";
  floor.shapes = {HalfSpace{}};
  floor.friction = 0.5;
  return floor;
}

// A cube of 10³ points, 0.2 m, 1 kg, all springs alike.
SoftBodySettings cube(double stiffness, Precision precision) {
  FixedLatticeMaterial material;
  material.mass = 1;
  material.stiffness = stiffness;
  SoftBodySettings settings = settings_of(lattice_from_box({0.2, 0.2, 0.2}, {10, 10, 10}, material));
  settings.name = "cube";
  settings.precision = precision;
  settings.origin = {0, 0.2, 0};
  settings.origin.y() = 0.1 - settings.positions.col(1).minCoeff();  // its lowest points are 0.1 m above the floor
  return settings;
}

struct Case {
  double stiffness;
  Precision precision;
  double within;
};

class CubeAtRest : public ::testing::TestWithParam<Case> {};

TEST_P(CubeAtRest, SettlesSleepsAndWakes) {
  World world;
  world.add_collider(floor());
  Body& body = world.add(make_soft_body(cube(GetParam().stiffness, GetParam().precision)));
  for (int frame = 0; frame < 60 * GetParam().within && !body.asleep(); ++frame)
    ASSERT_TRUE(world.update(1.0 / 60).good());
  ASSERT_TRUE(body.asleep()) << rms_speed(body) << " m/s";
  EXPECT_TRUE((body.velocities() == 0).all());
  const double weight = body.total_mass() * 9.81;
  EXPECT_LT(residual(body, world.gravity()), 0.01 * weight);

  // Ten minutes change nothing.
  const Points<double> asleep = body.positions();
  ASSERT_TRUE(world.update(600).good());
  EXPECT_TRUE(body.asleep());
  EXPECT_TRUE((body.positions() == asleep).all());

  world.set_gravity({0, -9.81 * 1.01, 0});
  ASSERT_TRUE(world.update(1.0 / 60).good());
  EXPECT_FALSE(body.asleep());
  EXPECT_FALSE((body.positions() == asleep).all());
}

INSTANTIATE_TEST_SUITE_P(Stiffness, CubeAtRest,
                         ::testing::Values(Case{2000, Precision::Float, 3}, Case{2000, Precision::Double, 3},
                                           Case{50, Precision::Float, 5}, Case{50, Precision::Double, 5}),
                         [](const auto& which) {
                           return std::to_string(int(which.param.stiffness)) +
                                  std::string(which.param.precision == Precision::Float ? "Float" : "Double");
                         });

// What wakes a small cube that sleeps on the floor.
class Sleeper : public ::testing::Test {
 protected:
  Sleeper() {
    world_.add_collider(floor());
    Collider ball;
    ball.name = "ball";
    ball.shapes = {Sphere{{0, 2, 0}, 0.1}};
    ball.motion = [this](double, std::span<Shape> shapes) { shapes[0] = Sphere{place_, 0.1}; };
    world_.add_collider(ball);
    FixedLatticeMaterial material;
    material.mass = 1;
    material.stiffness = 2000;
    SoftBodySettings settings = settings_of(lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, material));
    settings.origin.y() = 0.01 - settings.positions.col(1).minCoeff();
    body_ = &world_.add(make_soft_body(settings));
    for (int frame = 0; frame < 300 && !body_->asleep(); ++frame) EXPECT_TRUE(world_.update(1.0 / 60).good());
    EXPECT_TRUE(body_->asleep());
  }
  bool awake_after_a_frame() {
    EXPECT_TRUE(world_.update(1.0 / 60).good());
    return !body_->asleep();
  }
  World world_;
  Body* body_ = nullptr;
  Vec3 place_{0, 2, 0};
};

TEST_F(Sleeper, SleepsOnWhereNothingComesNear) {
  EXPECT_FALSE(awake_after_a_frame());
  place_ = {0, 1, 0};
  EXPECT_FALSE(awake_after_a_frame());
}

TEST_F(Sleeper, WakesFromATouch) {
  place_ = {0, 0.19, 0};
  EXPECT_TRUE(awake_after_a_frame());
}

TEST_F(Sleeper, WakesFromAForce) {
  body_->add_force(0, {0.1, 0, 0});
  EXPECT_TRUE(awake_after_a_frame());
}

TEST_F(Sleeper, WakesFromAnEdit) {
  body_->set_velocity(0, {0, 0.1, 0});
  EXPECT_TRUE(awake_after_a_frame());
}

TEST_F(Sleeper, WakesFromAPinThatIsMoved) {
  body_->pin(63);
  for (int frame = 0; frame < 300 && !body_->asleep(); ++frame) ASSERT_TRUE(world_.update(1.0 / 60).good());
  ASSERT_TRUE(body_->asleep());
  body_->move_pin(63, body_->positions().row(63).matrix().transpose() + Vec3(0, 0.01, 0));
  EXPECT_TRUE(awake_after_a_frame());
}

TEST_F(Sleeper, WakesFromAChangedSetting) {
  world_.set_damping(0.1);
  EXPECT_FALSE(body_->asleep());
}

TEST_F(Sleeper, WakesFromANewSolid) {
  world_.add_collider(floor());
  EXPECT_FALSE(body_->asleep());
}

// Without anything that takes energy nothing comes to rest, however slow it is.
TEST(Rest, IsNotForWhatLosesNoEnergy) {
  SoftBodySettings settings;
  settings.positions = Points<double>::Zero(2, 3);
  settings.positions(1, 1) = -1;
  settings.masses = Values<double>::Ones(2);
  settings.pins = {0};
  auto network = std::make_shared<SpringNetwork>();
  network->springs.push_back({0, 1, 1000, 0, 1 - 9.81 / 1000 + 1e-7});
  settings.network = network;
  World world;
  Body& body = world.add(make_soft_body(settings));
  ASSERT_TRUE(world.update(5).good());
  EXPECT_LT(rms_speed(body), 1e-4);
  EXPECT_FALSE(body.asleep());
}

// The rounding of lengths alone shook it for ever.
TEST(Rest, OfASheetInFloatIsThatInDouble) {
  SoftBodySettings settings = test::sheet(32);
  settings.precision = Precision::Float;
  World world;
  world.set_damping(0.63);
  Body& body = world.add(make_soft_body(settings));
  ASSERT_TRUE(world.update(20).good());
  EXPECT_TRUE(body.asleep()) << rms_speed(body);
  EXPECT_LT(residual(body, world.gravity()), 0.01 * body.total_mass() * 9.81);
}

// Half a kilometre away float has lost the digits that springs need, if the origin stays behind.
TEST(Origin, FollowsWhatTravels) {
  SoftBodySettings settings = test::sheet(12);
  settings.pins.clear();
  settings.precision = Precision::Float;
  const Vec3 speed(100, 3, -7), center = settings.positions.colwise().mean().matrix().transpose();
  settings.velocities = Points<double>::Zero(144, 3);
  for (Index i = 0; i < 144; ++i) {  // it turns, too
    const Vec3 arm = Vec3(settings.positions.row(i).matrix().transpose()) - center;
    settings.velocities.row(i) = (speed + Vec3(0, 1, 2).cross(arm)).transpose().array();
  }
  World world;
  world.enable_gravity(false);
  Body& body = world.add(make_soft_body(settings));
  const double energy = world.energy().total() - 0.5 * body.total_mass() * speed.squaredNorm();
  ASSERT_TRUE(world.update(5).good());
  EXPECT_LT((body.displacement() - 5 * speed).norm(), 2e-3);
  EXPECT_EQ(body.start_positions()(0, 0), double(float(settings.positions(0, 0))));
  const Vec3 now = body.momentum() / body.total_mass();
  EXPECT_NEAR(world.energy().total() - 0.5 * body.total_mass() * now.squaredNorm(), energy, 5e-3 * energy);
  const auto& state = dynamic_cast<PointBody<float>&>(body).state();
  EXPECT_LT(state.position.abs().maxCoeff(), 30);
}

// A mass that begins at full speed and a soft one far below it: at nine tenths of the largest stable step the energy
// of the fast one swings by several times itself.
TEST(AutomaticStep, KeepsTheEnergyOfWhatNothingDamps) {
  SoftBodySettings settings;
  settings.positions = Points<double>::Zero(3, 3);
  settings.positions(1, 0) = 1, settings.positions(2, 0) = 2;
  settings.velocities = Points<double>::Zero(3, 3);
  settings.velocities(1, 0) = 1;
  settings.masses = Values<double>::Ones(3);
  settings.pins = {0};
  auto network = std::make_shared<SpringNetwork>();
  network->springs.push_back({0, 1, 1e5, 0, 1});
  network->springs.push_back({1, 2, 10, 0, 1});
  settings.network = network;
  settings.precision = Precision::Double;
  World world;
  world.enable_gravity(false);
  world.add(make_soft_body(settings));
  const double start = world.energy().total();
  double most = start, least = start;
  for (int tick = 0; tick < 240; ++tick) {
    ASSERT_TRUE(world.update(world.clock().tick()).good());
    most = std::max(most, world.energy().total()), least = std::min(least, world.energy().total());
  }
  EXPECT_LT(most, (1 + 1e-3) * start);
  EXPECT_GT(least, (1 - 1e-3) * start);
}

// Rounding shakes it a little more with every substep: that is no blow-up.
TEST(Rest, OfAnUndampedSheetIsNotTakenForEnergyFromNowhere) {
  for (const Method* method : {&velocity_verlet(), &semi_implicit_euler()})
    for (const Precision precision : {Precision::Float, Precision::Double}) {
      SCOPED_TRACE(std::string(method->name) + (precision == Precision::Float ? ", float" : ", double"));
      SoftBodySettings settings = test::sheet(12);
      settings.precision = precision;
      settings.motion.method = method;
      settings.motion.compensated = false;
      settings.positions *= 1.1;  // in numbers that are not round
      auto network = std::make_shared<SpringNetwork>(*settings.network);
      for (Spring& spring : network->springs)
        spring.rest_length = (settings.positions.row(spring.a) - settings.positions.row(spring.b)).matrix().norm();
      settings.network = network;
      const double stable = make_soft_body(settings)->stable_step(*method);
      settings.motion.dt = 0.9 * stable;
      World world(1 / (500 * stable));
      world.enable_gravity(false);
      Body& body = world.add(make_soft_body(settings));
      for (int tick = 0; tick < 200; ++tick) {
        const StepReport report = world.update(world.clock().tick());
        ASSERT_TRUE(report.good()) << report.text();
      }
      EXPECT_GT(rms_speed(body), 0);
    }
}

// A block on a slope that friction holds does not creep.
TEST(Rest, HoldsOnASlopeUnderEverySolver) {
  for (const Method* method : {&velocity_verlet(), &xpbd(), &implicit_euler()}) {
    SCOPED_TRACE(method->name);
    FixedLatticeMaterial material;
    material.mass = 1;
    material.stiffness = 2000;
    SoftBodySettings settings = settings_of(lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, material));
    settings.origin.y() = 0.001 - settings.positions.col(1).minCoeff();
    settings.motion.method = method;
    World world;
    world.set_gravity({9.81 * std::sin(0.4), -9.81 * std::cos(0.4), 0});  // tan 0.4 = 0.42, friction 0.5
    world.add_collider(floor());
    Body& body = world.add(make_soft_body(settings));
    ASSERT_TRUE(world.update(5).good());
    const Vec3 place = body.displacement();
    ASSERT_TRUE(world.update(10).good());
    EXPECT_LT((body.displacement() - place).norm(), 1e-6);
    EXPECT_TRUE(body.asleep()) << rms_speed(body);
  }
}

// Float keeps increments far below its places' rounding, whichever way a body is moved.
TEST(Rest, DoesNotSwallowTinySteps) {
  SoftBodySettings settings;
  settings.positions = Points<double>::Constant(1, 3, 100);
  settings.velocities = Points<double>::Constant(1, 3, 1e-3);
  settings.masses = Values<double>::Ones(1);
  settings.motion.dt = 1e-5;
  settings.precision = Precision::Float;
  for (const Method* method : {&velocity_verlet(), &verlet(), &semi_implicit_euler(), &rk4(), &xpbd()}) {
    SCOPED_TRACE(method->name);
    settings.motion.method = method;
    World world;
    world.enable_gravity(false);
    Body& body = world.add(make_soft_body(settings));
    ASSERT_TRUE(world.update(1).good());
    EXPECT_NEAR(body.displacement().x(), 1e-3, 8e-6);  // a float's step at 100 m
  }
}

}  // namespace
}  // namespace hooke::softbody
