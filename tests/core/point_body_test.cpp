// What can be asked of a body, what it refuses, and how methods and clocks introduce themselves.
#include "core/problems.hpp"

#include <gmock/gmock.h>

#include <numeric>

namespace hooke::test {
namespace {

using ::testing::HasSubstr;

template <class F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Body, TellsEnergyMomentumDisplacementWeightAndSpeed) {
  Values<double> mass(2);
  mass << 2, 3;
  auto masses = points<double>(rows({{1, 2, 0}, {0, 4, 0}}), rows({{3, 0, 4}, {0, -1, 0}}), mass);
  masses.origin = {10, 0, 0};
  auto body = body_of(std::move(masses), {});
  const Vec3 gravity{0, -10, 0};
  EXPECT_EQ(row(body->positions(), 0), Vec3(11, 2, 0));
  EXPECT_DOUBLE_EQ(body->energy(gravity).kinetic, 0.5 * 2 * 25 + 0.5 * 3);
  EXPECT_DOUBLE_EQ(body->energy(gravity).gravitational, 2 * 10 * 2 + 3 * 10 * 4);
  EXPECT_EQ(body->energy(gravity).elastic, 0);
  EXPECT_EQ(body->momentum(), Vec3(6, -3, 8));
  EXPECT_EQ(body->speed(0), 5);
  EXPECT_DOUBLE_EQ(body->weight(1, gravity), 30);
  EXPECT_EQ(body->total_mass(), 5);
  body->set_position(0, {12, 2, 0});
  EXPECT_EQ(body->displacement(0), Vec3(1, 0, 0));
  EXPECT_LT((body->displacement() - Vec3(0.4, 0, 0)).norm(), 1e-15);
  // A pinned point counts neither in energy nor in momentum, but weighs what it did.
  body->pin(0);
  EXPECT_DOUBLE_EQ(body->energy(gravity).kinetic, 1.5);
  EXPECT_EQ(body->momentum(), Vec3(0, -3, 0));
  EXPECT_EQ(body->total_mass(), 5);
}

TEST(Body, FarFromTheOriginMovesBitwiseTheSame) {
  const auto fall = [](double offset) {
    auto masses = point<float>({0.3, 0.2, 0.1}, {1, 2, 3});
    masses.origin = {offset, -offset, offset};
    World world(240);
    world.add_collider({"floor", {HalfSpace{{0, 1, 0}, -offset}}, {}, {}, 0.2, 0.5});
    auto& body = world.add(body_of(std::move(masses), {}));
    EXPECT_TRUE(world.update(2).good());
    return Points<float>(body.state().position);
  };
  const Points<float> here = fall(0);
  for (const double offset : {1.0, 10.0, 100.0, 1000.0, 1e6}) EXPECT_TRUE((fall(offset) == here).all()) << offset;
}

TEST(Body, ItsOriginFollowsItUnlessItIsPlainFloat) {
  for (const bool compensated : {true, false}) {
    MotionSettings settings;
    settings.compensated = compensated;
    World world(60);
    world.enable_gravity(false);
    auto& body = world.add(body_of(point<float>({1000.25, 0, 0}, {64, 0, 0}), settings));
    ASSERT_TRUE(world.update(1).good());
    EXPECT_NEAR(body.positions()(0, 0), 1064.25, 0.01);
    EXPECT_EQ(body.state().origin.x() > 1000, compensated);
  }
}

TEST(Body, BetweenTicksIsOnTheLineBetweenThem) {
  World world(10);
  world.enable_gravity(false);
  auto& body = world.add(body_of(point<double>({0, 0, 0}, {1, 0, 0}), {}));
  ASSERT_TRUE(world.update(0.125).good());
  EXPECT_NEAR(world.fraction(), 0.25, 1e-12);
  EXPECT_NEAR(body.positions_between(world.fraction())(0, 0), 0.025, 1e-15);
  EXPECT_EQ(body.positions_between(0)(0, 0), 0);
  EXPECT_EQ(body.positions_between(1)(0, 0), body.positions()(0, 0));
}

TEST(Body, ChoosesItsSubstepBelowTheStableOne) {
  for (const Method* method : damped_methods()) {
    SCOPED_TRACE(method->name);
    auto body = body_of(point<double>({1, 0, 0}, {0, 0, 0}), motion(*method));
    body->add_field(std::make_unique<Anchor<double>>(1e4, 0, 1));  // ω = 100, ζ = 0.005
    const double tick = 1.0 / 30;
    ASSERT_TRUE(body->advance({0, tick, Vec3::Zero(), {}}).good());
    const double substep = tick / double(body->substeps());
    if (std::isinf(method->stability_limit)) {
      EXPECT_EQ(body->substeps(), 1);
    } else if (method->adaptive()) {
      EXPECT_GE(body->substeps(), 1);  // by error, see tests/convergence
    } else {
      EXPECT_LE(substep, method->stability_limit > 0 ? 0.9001 * body->stable_step() : 0.05001 / 100);
    }
  }
}

TEST(Body, UnderHeavyDragAloneIsStableWithEveryMethod) {
  for (const Method* method : damped_methods()) {
    SCOPED_TRACE(method->name);
    auto body = body_of(point<double>({1, 0, 0}, {1, 0, 0}), motion(*method));
    body->add_field(std::make_unique<Anchor<double>>(1e-4, 0, 2000));  // ω = 0.01, damping rate 2000
    for (int tick = 0; tick < 30; ++tick)
      ASSERT_TRUE(body->advance({tick / 30.0, (tick + 1) / 30.0, Vec3::Zero(), {}}).good());
    const auto* implicit = std::get_if<Implicit>(&method->scheme);
    if (implicit && implicit->theta == 0.5) {
      // Stable, but what is far too fast for the step swings: × (1 - γh/2)/(1 + γh/2).
      const double half = 2000 / 60.0;
      EXPECT_NEAR(body->speed(0), std::pow((half - 1) / (half + 1), 30), 1e-6);
      continue;
    }
    EXPECT_LT(body->speed(0), 0.01);
    EXPECT_NEAR(body->positions()(0, 0), 1, 0.01);
  }
}

TEST(Body, RefusesBadInputAndNamesIt) {
  const auto make = [](auto change) {
    return message_of([&] {
      auto masses = point<double>({0, 0, 0}, {0, 0, 0});
      MotionSettings settings;
      change(masses, settings);
      body_of(std::move(masses), settings, "cape");
    });
  };
  EXPECT_THAT(make([](auto& p, auto&) { p.mass[0] = 0; }), HasSubstr("\"cape\": masses must be positive"));
  EXPECT_THAT(make([](auto& p, auto&) { p.mass[0] = std::nan(""); }), HasSubstr("masses must be positive"));
  EXPECT_THAT(make([](auto& p, auto&) { p.inverse_mass[0] = -1; }), HasSubstr("inverse masses"));
  EXPECT_THAT(make([](auto& p, auto&) { p.position(0, 0) = INFINITY; }), HasSubstr("finite"));
  EXPECT_THAT(make([](auto& p, auto&) { p.velocity.resize(0, 3); }), HasSubstr("same length"));
  EXPECT_THAT(make([](auto&, auto& s) { s.dt = -1; }), HasSubstr("dt must not be negative"));
  EXPECT_THAT(make([](auto&, auto& s) { s.thickness = -1; }), HasSubstr("thickness"));
  EXPECT_THAT(make([](auto&, auto& s) { s.tolerance = 0; }), HasSubstr("tolerance must be positive"));
  EXPECT_THROW(LinearDrag<double>(-1), std::invalid_argument);
  EXPECT_THROW(QuadraticDrag<float>(NAN), std::invalid_argument);
}

TEST(Body, TellsHowItIsMoved) {
  EXPECT_EQ(body_of(point<float>({1, 0, 0}, {0, 0, 0}), motion(rk4()))->motion_facts().precision, "float");
  auto body = body_of(point<double>({1, 0, 0}, {0, 0, 0}), motion(implicit_midpoint(), 0.005));
  body->add_field(std::make_unique<Anchor<double>>(1e4));  // ω = 100
  ASSERT_TRUE(body->advance({0, 0.02, Vec3::Zero(), {}}).good());
  const Body& seen = *body;
  const MotionFacts facts = seen.motion_facts();
  EXPECT_EQ(facts.method, "implicit-midpoint");
  EXPECT_EQ(facts.precision, "double");
  EXPECT_EQ(facts.substeps, 4);
  EXPECT_EQ(facts.wanted_dt, 0.005);
  EXPECT_TRUE(std::isinf(facts.stable_step));
  EXPECT_FALSE(facts.velocity_forces);
  EXPECT_GE(facts.evaluations, 8);
  EXPECT_GE(facts.products, 4);
  for (const Method* method : methods())
    EXPECT_EQ(seen.stable_step(*method), largest_stable_step(*method, 100, 0)) << method->name;
  body->add_field(std::make_unique<LinearDrag<double>>(1));
  EXPECT_TRUE(seen.motion_facts().velocity_forces);
}

TEST(Body, RefusesForcesOfVelocityWhereItsMethodDoes) {
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    auto body = body_of(point<double>({1, 0, 0}, {0, 0, 0}), motion(*method), "cape");
    const std::string message = message_of([&] { body->add_field(std::make_unique<LinearDrag<double>>(1)); });
    if (method->accepts_velocity_forces) {
      EXPECT_EQ(message, "nothing was thrown");
      continue;
    }
    EXPECT_EQ(message, "body \"cape\": method " + std::string(method->name) +
                           " accepts no forces of velocity (drag, dampers, wind)");
  }
}

// Counts how often its rates are asked for.
class CountedRates final : public ForceField<double> {
 public:
  explicit CountedRates(int& count) : count_(count) {}
  bool uses_velocity() const override { return false; }
  void add_force(const Points<double>&, const Points<double>&, double, Points<double>&) const override {}
  Rates rate_bounds(const Points<double>&, const Points<double>&, const Values<double>&) const override {
    ++count_;
    return {1, 0};
  }

 private:
  int& count_;
};

TEST(Body, LooksOnceForEachAutomaticStep) {
  for (const Method* method : {&velocity_verlet(), &rk2(), &explicit_euler()}) {
    SCOPED_TRACE(method->name);
    auto body = body_of(point<double>({1, 0, 0}, {0, 0, 0}), motion(*method));
    int count = 0;
    body->add_field(std::make_unique<CountedRates>(count));
    ASSERT_TRUE(body->advance({0, 0.02, Vec3::Zero(), {}}).good());
    EXPECT_EQ(count, 1);
  }
}

TEST(Methods, AreFoundByNameAndOthersAreListed) {
  for (const Method* method : methods()) EXPECT_EQ(&method_named(method->name), method);
  EXPECT_THAT(message_of([] { method_named("euler"); }), HasSubstr("semi-implicit-euler, implicit-euler, verlet"));
}

TEST(Methods, HaveTablesThatAddUp) {
  for (const Method* method : methods()) {
    SCOPED_TRACE(method->name);
    if (const auto* table = std::get_if<Splitting>(&method->scheme)) {
      EXPECT_EQ(table->kick.size(), table->drift.size());
      EXPECT_NEAR(std::accumulate(table->kick.begin(), table->kick.end(), 0.0), 1, 1e-15);
      EXPECT_NEAR(std::accumulate(table->drift.begin(), table->drift.end(), 0.0), 1, 1e-15);
    } else if (const auto* rk = std::get_if<RungeKutta>(&method->scheme)) {
      EXPECT_EQ(rk->stage.size(), rk->weight.size());
      EXPECT_EQ(int(rk->weight.size()) - rk->first_same_as_last, method->evaluations);
      EXPECT_NEAR(std::accumulate(rk->weight.begin(), rk->weight.end(), 0.0), 1, 1e-15);
      EXPECT_NEAR(std::accumulate(rk->error.begin(), rk->error.end(), 0.0), 0, 1e-15);
    } else if (const auto* rkn = std::get_if<Nystrom>(&method->scheme)) {
      EXPECT_EQ(int(rkn->node.size()), method->evaluations);
      EXPECT_NEAR(std::accumulate(rkn->position.begin(), rkn->position.end(), 0.0), 0.5, 1e-15);
      EXPECT_NEAR(std::accumulate(rkn->velocity.begin(), rkn->velocity.end(), 0.0), 1, 1e-15);
    }
  }
}

// Counts how often it is asked.
class Counter final : public ForceField<double> {
 public:
  explicit Counter(int& count) : count_(count) {}
  bool uses_velocity() const override { return false; }
  void add_force(const Points<double>&, const Points<double>&, double, Points<double>&) const override { ++count_; }

 private:
  int& count_;
};

TEST(Methods, EvaluateForcesAsOftenAsTheySay) {
  for (const Method* method : methods()) {
    if (solves(*method) && !std::get<Implicit>(method->scheme).linearised) continue;  // as the solve needs
    SCOPED_TRACE(method->name);
    auto body = body_of(point<double>({1, 0, 0}, {0, 0, 0}), motion(*method, 0.01));
    int count = 0;
    body->add_field(std::make_unique<Counter>(count));
    run(*body, 0.01, 100, Vec3::Zero(), 0, 100);
    EXPECT_EQ(count, body->motion_facts().evaluations);
    EXPECT_NEAR(count, 100 * method->evaluations, 1);  // one more where the first is not the last's last
  }
}

TEST(Clock, CutsFramesIntoWholeTicks) {
  Clock clock(60);
  EXPECT_EQ(clock.bank(1.0 / 300), 0);
  EXPECT_EQ(clock.bank(4.0 / 300), 1);
  EXPECT_NEAR(clock.remainder(), 0, 1e-9);
  EXPECT_THROW(clock.bank(-1), std::invalid_argument);
  EXPECT_THROW(clock.bank(NAN), std::invalid_argument);
  EXPECT_THROW(Clock(0), std::invalid_argument);
  EXPECT_THROW(Clock(-5), std::invalid_argument);
}

TEST(Clock, LosesNoTickToRounding) {
  for (const double rate : {24.0, 25.0, 30.0, 50.0, 60.0, 90.0, 120.0, 144.0, 240.0}) {
    Clock clock(240);
    std::int64_t ticks = 0;
    for (int frame = 0; frame < 3600 * rate; ++frame) ticks += clock.bank(1 / rate);
    EXPECT_EQ(ticks, 3600 * 240) << rate;
  }
}

TEST(World, RefusesTwoBodiesOfOneName) {
  World world;
  world.add(body_of(point<double>({0, 0, 0}, {0, 0, 0}), {}, "a"));
  EXPECT_THROW(world.add(body_of(point<double>({0, 0, 0}, {0, 0, 0}), {}, "a")), std::invalid_argument);
  EXPECT_NE(world.find("a"), nullptr);
  EXPECT_EQ(world.find("b"), nullptr);
  EXPECT_THROW(world.set_gravity({0, NAN, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::test
