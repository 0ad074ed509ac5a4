// Ballistics and drag against the closed forms, with every method; float keeps its digits anywhere.
#include "scene.hpp"

namespace hooke::particles {
namespace {

struct State {
  Vec3 x, v;
};

// One particle from the origin at v0, through `seconds` at 240 ticks a second.
template <class S>
State fly(const Method& method, double dt, const Vec3& v0, double seconds, std::unique_ptr<Force<S>> force,
          const Vec3& gravity = Vec3(0, -9.81, 0), double tick_rate = 240) {
  ParticleSettings settings;
  settings.method = &method, settings.dt = dt, settings.capacity = 8;
  World world(tick_rate);
  world.set_gravity(gravity);
  auto& system = world.add(std::make_unique<ParticleSystem<S>>(settings));
  if (force) system.add_force(std::move(force));
  system.add(thrown(Vec3::Zero(), v0));
  EXPECT_TRUE(world.update(seconds).good());
  return {system.positions().row(0).matrix().transpose(), system.velocities().row(0).matrix().transpose()};
}

template <class S>
class Ballistics : public testing::Test {
 public:
  // Methods that solve with forces of velocity, and a step small enough for the precision.
  static constexpr double tolerance() { return sizeof(S) == 4 ? 1e-5 : 2e-9; }
};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Ballistics, Scalars);

// problems.md: γ = 0.1, v0 = (30, 30), t = 3.
TYPED_TEST(Ballistics, LinearDragIsTheClosedForm) {
  const auto drag = [] { return std::make_unique<LinearDrag<TypeParam>>(0.1); };
  for (const Method* method : {&verlet(), &rk4()}) {
    // Drag is exact in a kick; what is left is the splitting's h².
    const double dt = method == &rk4() ? 1.0 / 480 : sizeof(TypeParam) == 4 ? 1.0 / 480 : 1.0 / 200'000;
    const State end = fly<TypeParam>(*method, dt, Vec3(30, 30, 0), 3, drag());
    EXPECT_NEAR(end.x.x(), 77.754533795, 77.75 * this->tolerance()) << method->name;
    EXPECT_NEAR(end.x.y(), 37.711859307, 37.71 * this->tolerance()) << method->name;
  }
}

TYPED_TEST(Ballistics, QuadraticDragIsTheReference) {
  const auto drag = [] { return std::make_unique<QuadraticDrag<TypeParam>>(0.01); };
  const double tolerance = sizeof(TypeParam) == 4 ? 1e-5 : 1e-11;
  const double dt = sizeof(TypeParam) == 4 ? 1.0 / 480 : 1.0 / 2400;
  const State fallen = fly<TypeParam>(rk4(), dt, Vec3::Zero(), 3, drag());
  EXPECT_NEAR(fallen.v.y(), -23.022476383, 23 * tolerance + 1e-9);
  EXPECT_NEAR(fallen.x.y(), -38.859071980, 38.9 * tolerance + 1e-9);
  const State thrown = fly<TypeParam>(rk4(), dt, Vec3(30, 30, 0), 3, drag());
  EXPECT_NEAR(thrown.x.x(), 60.7605452585, 60.8 * tolerance);
  EXPECT_NEAR(thrown.x.y(), 24.9712406124, 25.0 * tolerance * 2);
  EXPECT_NEAR(thrown.v.x(), 14.8542630734, 14.9 * tolerance);
  EXPECT_NEAR(thrown.v.y(), -7.5607911442, 7.6 * tolerance * 2);
  // The apex is between ticks: height is flat there.
  const State apex = fly<TypeParam>(rk4(), dt, Vec3(0, 30, 0), 2.438818574, drag(), Vec3(0, -9.81, 0), 1 / 2.438818574);
  EXPECT_NEAR(apex.x.y(), 32.549318487, 32.5 * tolerance + 1e-9);
  EXPECT_NEAR(apex.v.y(), 0, 30 * tolerance + 2e-8);
}

// With steps so long that float's rounding of a kick is small beside what drag takes back.
TYPED_TEST(Ballistics, TerminalSpeedIsReached) {
  const Vec3 down(0, -9.81, 0);
  const State quadratic =
      fly<TypeParam>(rk4(), 0, Vec3::Zero(), 30, std::make_unique<QuadraticDrag<TypeParam>>(0.01), down, 20);
  EXPECT_NEAR(quadratic.v.y(), -31.320919527, 31 * (sizeof(TypeParam) == 4 ? 1e-5 : 1e-7));
  const State linear =
      fly<TypeParam>(verlet(), 0, Vec3::Zero(), 60, std::make_unique<LinearDrag<TypeParam>>(0.5), down, 20);
  EXPECT_NEAR(linear.v.y(), -19.62, 19.6 * (sizeof(TypeParam) == 4 ? 1e-5 : 1e-9));
}

// Every method that takes drag, at its order: halving dt divides the error by 2^order.
TEST(Flight, OrdersHold) {
  const auto error = [](const Method& method, double dt) {
    const State end = fly<double>(method, dt, Vec3(30, 30, 0), 3, std::make_unique<QuadraticDrag<double>>(0.01),
                                  Vec3(0, -9.81, 0), 2);
    return (end.x - Vec3(60.7605452585, 24.9712406124, 0)).norm();
  };
  for (const Method* method : methods()) {
    if (!method->accepts_velocity_forces || method->order > 4) continue;
    const double coarse = method->order == 4 ? 0.25 : 0.02;
    const double order = std::log2(error(*method, coarse) / error(*method, coarse / 2));
    EXPECT_NEAR(order, method->order, 0.35) << method->name;
  }
}

// Without drag all methods of order 2 and above are exact for a constant acceleration; the fast loop and the core
// agree.
TEST(Flight, EveryMethodFliesTheParabola) {
  for (const Method* method : methods()) {
    if (method->order < 2) continue;
    const State end = fly<double>(*method, 1.0 / 480, Vec3(3, 4, 5), 2, nullptr);
    EXPECT_NEAR((end.x - Vec3(6, 8 - 0.5 * 9.81 * 4, 10)).norm(), 0, 1e-9) << method->name;
    EXPECT_NEAR((end.v - Vec3(3, 4 - 9.81 * 2, 5)).norm(), 0, 1e-9) << method->name;
  }
}

TEST(Flight, NoForceMeansNoChange) {
  const State end = fly<float>(verlet(), 0, Vec3(0.1, 0.2, 0.3), 1, nullptr, Vec3::Zero());
  EXPECT_EQ(end.v, Vec3(0.1f, 0.2f, 0.3f));
  const State rest = fly<float>(verlet(), 0, Vec3::Zero(), 10, nullptr, Vec3::Zero());
  EXPECT_EQ(rest.x, Vec3::Zero());
}

TEST(Flight, FarFromTheOriginNothingChanges) {
  const auto run = [](double offset) {
    ParticleSettings settings;
    settings.origin = Vec3(offset, 0, -offset);
    World world;
    world.add_collider(floor_at(0, 0.5, 0.3));
    auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
    EmitterSettings emitter;
    emitter.position = settings.origin + Vec3(0, 1, 0), emitter.spread = 1, emitter.rate = 500, emitter.speed = {1, 4};
    system.add_emitter(emitter);
    EXPECT_TRUE(world.update(2).good());
    return bytes(system);
  };
  const std::string here = run(0);
  EXPECT_NE(here.substr(0, 2), "0 ");
  // Births are made in world coordinates: offsets that double holds exactly to below float's last bit.
  EXPECT_EQ(run(1024), here);
}

// Without a dt an adaptive method picks its own steps, to its tolerance.
TEST(Flight, AnAdaptiveMethodKeepsItsTolerance) {
  const auto error = [](double tolerance) {
    ParticleSettings settings;
    settings.method = &dormand_prince(), settings.tolerance = tolerance;
    World world(1);
    auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
    system.add_force(std::make_unique<QuadraticDrag<double>>(0.01));
    system.add(thrown(Vec3::Zero(), Vec3(30, 30, 0)));
    EXPECT_TRUE(world.update(3).good());
    return (Vec3(system.positions().row(0).matrix().transpose()) - Vec3(60.7605452585, 24.9712406124, 0)).norm();
  };
  EXPECT_LT(error(1e-4), 1e-2);
  EXPECT_LT(error(1e-10), 1e-8);
  EXPECT_LT(error(1e-10), 0.01 * error(1e-4));
}

TEST(Flight, RefusesDragWhereTheMethodDoes) {
  ParticleSettings settings;
  settings.method = &pefrl();
  ParticleSystem<float> system(settings);
  EXPECT_THROW(system.add_force(std::make_unique<LinearDrag<float>>(1)), std::invalid_argument);
  auto flow = std::make_unique<Vortex<float>>(Vec3::Zero(), Vec3(0, 1, 0), 1, 0.1);
  EXPECT_THROW(system.add_force(std::make_unique<FlowDrag<float>>(std::move(flow), 2)), std::invalid_argument);
  system.add_force(std::make_unique<Attractor<float>>(Vec3::Zero(), 1, 0.1));
}

}  // namespace
}  // namespace hooke::particles
