// Newton's second and third laws: what springs exchange adds up to nothing.
#include "core/problems.hpp"

#include <hooke/softbody/spring_field.hpp>

#include <Eigen/Geometry>

namespace hooke::test {
namespace {

template <class S>
class Momentum : public ::testing::Test {};
TYPED_TEST_SUITE(Momentum, Scalars);

TYPED_TEST(Momentum, IsKeptByAnyNetworkWithAndWithoutDamping) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const Index n = 40;
  const Points<double> x = random.points(n, 1), v = random.points(n, 3);
  Values<double> mass(n);
  for (Index i = 0; i < n; ++i) mass[i] = random.uniform(0.1, 3);
  for (const bool damped : {false, true}) {
    auto network = std::make_shared<softbody::SpringNetwork>();
    for (int i = 0; i < 120; ++i) {
      const int a = random.below(int(n)), b = (a + 1 + random.below(int(n) - 1)) % int(n);
      network->springs.push_back(
          {a, b, random.uniform(1, 200), damped ? random.uniform(0, 2) : 0, random.uniform(0, 2)});
    }
    for (const Method* method : methods()) {
      if (damped && !method->accepts_velocity_forces) continue;
      SCOPED_TRACE(std::string(method->name) + (damped ? ", damped" : ", undamped"));
      auto body = body_of(points<S>(x, v, mass), motion(*method, 1e-3));
      body->add_field(std::make_unique<softbody::SpringField<S>>(network, body->state().position));
      const Vec3 before = body->momentum();
      const StepReport report = run(*body, 1e-3, 500);
      ASSERT_TRUE(report.good()) << report.text();
      // Sum of the sizes of what is exchanged, one rounding each.
      const double size = (mass * v.matrix().rowwise().norm().array()).sum();
      // Implicit methods keep it to their solver's tolerance, a step.
      const double solver = solves(*method) ? 500 * (std::is_same_v<S, float> ? 1e-6 : 1e-12) : 0;
      EXPECT_LT((body->momentum() - before).norm(), (40 * kUnit<S> + solver) * size);
      EXPECT_GT(body->displacement(0).norm(), 0.01);
    }
  }
}

TEST(Force, AcceleratesByTheInverseMass) {
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    World world(240);
    world.enable_gravity(false);
    Values<double> mass(2);
    mass << 2, 5;
    auto& body = world.add(
        body_of(points<double>(Points<double>::Zero(2, 3), Points<double>::Zero(2, 3), mass), motion(*method)));
    for (int frame = 0; frame < 60; ++frame) {
      body.add_force(0, {3, 0, 0});
      body.add_force(1, {0, 3, 0});
      body.add_force(1, {0, 2, 0});
      ASSERT_TRUE(world.update(1.0 / 60).good());
    }
    EXPECT_NEAR(body.velocities()(0, 0), 1.5, 1e-12);
    EXPECT_NEAR(body.velocities()(1, 1), 1.0, 1e-12);  // pushes add up
    EXPECT_LT((body.momentum() - Vec3(3, 5, 0)).norm(), 1e-11);
    EXPECT_LT((world.momentum() - body.momentum()).norm(), 1e-15);
  }
}

}  // namespace
}  // namespace hooke::test
