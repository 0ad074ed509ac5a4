// Worlds at random: whatever springs, masses, methods and calls there are, a step ends, and either it is good and all
// is finite, or it is told and the state of before is kept. HOOKE_FUZZ=N runs N of them, HOOKE_SEED=S begins at one.
#include <hooke/softbody/soft_body.hpp>
#include <hooke/softbody/xpbd.hpp>
#include <hooke/world.hpp>

#include <fuzz.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hooke::softbody {
namespace {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  int below(int n) { return int(engine_() % std::uint64_t(n)); }
  bool one_in(int n) { return below(n) == 0; }
  double uniform(double low, double high) { return low + (high - low) * double(engine_() >> 11) * 0x1p-53; }
  /// From 10^low to 10^high, evenly in the exponent.
  double scale(double low, double high) { return std::pow(10.0, uniform(low, high)); }
  Vec3 vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

 private:
  std::mt19937_64 engine_;
};

Shape shape(Dice& dice) {
  switch (dice.below(4)) {
    case 0:
      return HalfSpace{Vec3(dice.vector(1) + Vec3(0, 2, 0)).normalized(), dice.uniform(-1, 0.2)};
    case 1:
      return Sphere{dice.vector(1), dice.scale(-2, 0)};
    case 2:
      return Capsule{dice.vector(1), dice.vector(1), dice.scale(-2, 0)};
    default:
      return Box{dice.vector(1), Vec3::Constant(dice.scale(-3, 0)), Mat3::Identity()};
  }
}

SoftBodySettings body(Dice& dice, const std::string& name) {
  SoftBodySettings s;
  s.name = name;
  const int n = 1 + dice.below(12);
  s.positions.resize(n, 3);
  s.velocities.setZero(n, 3);
  s.masses.resize(n);
  const double size = dice.scale(-3, 2), heaviest = dice.scale(-4, 4), fastest = dice.one_in(3) ? dice.scale(-2, 3) : 0;
  for (int i = 0; i < n; ++i) {
    s.positions.row(i) = dice.vector(size).transpose().array();
    if (i > 0 && dice.one_in(10)) s.positions.row(i) = s.positions.row(i - 1);  // coincident
    if (fastest > 0) s.velocities.row(i) = dice.vector(fastest).transpose().array();
    s.masses[i] = heaviest * dice.scale(dice.one_in(5) ? -4 : -1, 0);
    if (dice.one_in(6)) s.pins.push_back(i);
  }
  auto network = std::make_shared<SpringNetwork>();
  const double stiffest = dice.scale(-3, 10), damping = dice.one_in(2) ? dice.scale(-4, 3) : 0;
  for (int i = 0; n > 1 && i < dice.below(30); ++i) {
    const int a = dice.below(n), b = (a + 1 + dice.below(n - 1)) % n;
    network->springs.push_back({a, b, dice.one_in(20) ? 0 : stiffest * dice.scale(-2, 0), damping,
                                dice.one_in(3) ? Spring::kFromStart : dice.uniform(0, 2 * size)});
  }
  s.network = network;
  s.origin = dice.vector(dice.one_in(4) ? 1e6 : 1);
  if (dice.one_in(6)) s.linear_drag = dice.scale(-3, 3);
  if (dice.one_in(6)) s.quadratic_drag = dice.scale(-3, 3);
  const auto all = methods();
  s.motion.method = dice.one_in(5) ? &xpbd() : all[std::size_t(dice.below(int(all.size())))];
  s.motion.dt = dice.one_in(2) ? 0 : dice.scale(-3, -1);
  s.motion.max_substeps = 20;
  s.motion.thickness = dice.one_in(3) ? dice.scale(-4, -1) : 0;
  s.motion.retries = dice.below(3);
  s.precision = dice.one_in(3) ? Precision::Automatic : dice.one_in(2) ? Precision::Float : Precision::Double;
  return s;
}

void check_finite(const World& world, bool good, const StepReport& report) {
  for (const auto& body : world.bodies()) {
    ASSERT_TRUE(body->positions().allFinite() && body->velocities().allFinite())
        << (good ? "silently" : "after: " + report.text());
  }
  if (good) return;
  EXPECT_NE(world.find(report.body), nullptr) << report.text();
  EXPECT_FALSE(report.advice.empty());
}

void play(std::uint64_t seed) {
  Dice dice(seed);
  World world(dice.one_in(2) ? 60 : 240);
  world.set_gravity(dice.one_in(5) ? Vec3(dice.vector(100)) : Vec3(0, -9.81, 0));
  if (dice.one_in(3)) world.set_damping(dice.uniform(0, 0.99));
  for (int i = dice.below(3); i > 0; --i) {
    Collider collider;
    collider.shapes = {shape(dice)};
    collider.friction = dice.uniform(0, 2);
    collider.restitution = dice.uniform(0, 1);
    world.add_collider(collider);
  }
  for (int i = 1 + dice.below(2); i > 0; --i) {
    try {
      world.add(make_soft_body(body(dice, "body " + std::to_string(i))));
    } catch (const std::invalid_argument& refused) {  // a method that takes no drag
      EXPECT_GT(std::string(refused.what()).size(), 20u);
    }
  }
  for (int calls = 2 + dice.below(6); calls > 0; --calls) {
    for (const auto& body : world.bodies()) {
      const Index point = dice.below(int(body->size()));
      const Vec3 place = body->positions().row(point).matrix().transpose();
      switch (dice.below(8)) {
        case 0:
          body->pin(point);
          if (dice.one_in(2)) body->move_pin(point, place + dice.vector(dice.scale(-3, 1)));
          break;
        case 1:
          body->release(point);
          break;
        case 2:
          body->set_position(point, place + dice.vector(dice.scale(-3, 1)));
          break;
        case 3:
          body->set_velocity(point, dice.vector(dice.scale(-3, 3)));
          break;
        case 4:
          body->add_force(point, dice.vector(dice.scale(-3, 5)));
          break;
        case 5:
          body->wake();
          break;
        default:
          break;
      }
    }
    const StepReport report = world.update(dice.scale(-4, -1.2));
    check_finite(world, report.good(), report);
    if (!report.good() || ::testing::Test::HasFatalFailure()) return;
    world.take_warnings();
  }
}

TEST(Fuzz, OfWorldsNeverGoesWrongSilently) {
  const std::uint64_t first = test::fuzz_seed(), count = std::uint64_t(test::fuzz_rounds(2000));
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE("HOOKE_SEED=" + std::to_string(seed) + " HOOKE_FUZZ=1");
    ASSERT_NO_THROW(play(seed));
    if (::testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace hooke::softbody
