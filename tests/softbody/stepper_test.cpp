// The fused kernels against the general integrator: the same method, to rounding.
#include "core/problems.hpp"

#include <hooke/softbody/filtered_grid.hpp>
#include <hooke/softbody/grid_order.hpp>
#include <hooke/softbody/soft_body.hpp>
#include <hooke/world.hpp>

#include <numeric>
#include <random>

#ifdef HOOKE_TEST_HAS_HIGHWAY
#include <hwy/targets.h>
#endif

namespace hooke::test {
namespace {

using softbody::Cloth;
using softbody::SoftBodySettings;
using softbody::Spring;
using softbody::SpringNetwork;

// Undamped cloth whose points and springs have no order: what a mesh file may hold.
SoftBodySettings sheet(int columns, int rows, bool shuffled = false) {
  softbody::ClothMaterial material;
  material.damping_ratio = {0, 0, 0};
  const Cloth cloth = softbody::cloth_from_grid(1, 0.8, columns, rows, {1, 0, 0}, {0, -1, 0.7}, material);
  SoftBodySettings settings = softbody::settings_of(cloth);
  settings.triangles.clear();
  settings.pins = {0, 3, Index(columns) - 1};
  if (shuffled) {
    std::vector<int> place(std::size_t(columns * rows));
    std::iota(place.begin(), place.end(), 0);
    std::mt19937 random(5);
    std::shuffle(place.begin(), place.end(), random);
    SpringNetwork network = *settings.network;
    for (Spring& spring : network.springs)
      spring.a = place[std::size_t(spring.a)], spring.b = place[std::size_t(spring.b)];
    std::shuffle(network.springs.begin(), network.springs.end(), random);
    settings.network = std::make_shared<const SpringNetwork>(std::move(network));
    const Points<double> x = settings.positions;
    const Values<double> m = settings.masses;
    for (Index i = 0; i < x.rows(); ++i) {
      settings.positions.row(place[std::size_t(i)]) = x.row(i);
      settings.masses[place[std::size_t(i)]] = m[i];
    }
    for (Index& pin : settings.pins) pin = place[std::size_t(pin)];
  }
  settings.velocities = Points<double>::Zero(settings.positions.rows(), 3);
  for (Index i = 0; i < settings.velocities.rows(); ++i)
    settings.velocities.row(i) << 0.1 * settings.positions(i, 1), 0.3 * settings.positions(i, 0), 0.05;
  for (const Index pin : settings.pins) settings.velocities.row(pin).setZero();
  return settings;
}

// The same with a spring of no stiffness across, which leaves no grid to be found.
SoftBodySettings without_rows(SoftBodySettings settings) {
  SpringNetwork network = *settings.network;
  network.springs.push_back({0, int(settings.positions.rows()) - 1, 0});
  network.springs.push_back({1, int(settings.positions.rows()) / 2, 0});
  settings.network = std::make_shared<const SpringNetwork>(std::move(network));
  return settings;
}

// A network without any order, in three dimensions.
SoftBodySettings tangle(int points, int springs) {
  SoftBodySettings settings;
  std::mt19937 random(11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  settings.positions.resize(points, 3);
  settings.masses.resize(points);
  for (Index i = 0; i < points; ++i) {
    settings.positions.row(i) << uniform(-1, 1), uniform(-1, 1), uniform(-1, 1);
    settings.masses[i] = uniform(0.01, 0.1);
  }
  SpringNetwork network;
  for (int i = 0; i < springs; ++i) {
    const int a = below(points), b = (a + 1 + below(points - 1)) % points;
    network.springs.push_back({a, b, uniform(1, 300), 0, i % 3 ? Spring::kFromStart : uniform(0, 1)});
  }
  settings.network = std::make_shared<const SpringNetwork>(std::move(network));
  settings.pins = {1, 7};
  return settings;
}

struct Run {
  Points<double> position, velocity;
};

// `general` adds a force of zero, which no fused kernel knows.
template <class S>
Run run(SoftBodySettings settings, const Method& method, bool general, int threads = 1, double seconds = 0.05) {
  settings.precision = std::is_same_v<S, float> ? softbody::Precision::Float : softbody::Precision::Double;
  settings.motion.method = &method;
  World world;
  world.set_threads(threads);
  Body& body = world.add(softbody::make_soft_body(settings));
  auto& points = dynamic_cast<PointBody<S>&>(body);
  if (general) points.add_field(std::make_unique<TimeForce<S>>([](double) { return Vec3(0, 0, 0); }));
  EXPECT_EQ(points.fused(), !general);
  for (int frame = 0; frame < int(seconds * 60 + 0.5); ++frame) {
    body.add_force(5, {0.02, 0.01, -0.3});
    EXPECT_TRUE(world.update(1.0 / 60).good());
  }
  return {body.positions(), body.velocities()};
}

template <class S>
class Stepper : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Stepper, Scalars);

template <class S>
void expect_same_method(const SoftBodySettings& settings, const Method& method) {
  const Run fused = run<S>(settings, method, false), general = run<S>(settings, method, true);
  const double rounding = std::is_same_v<S, float> ? 2e-5 : 1e-12;
  const double moved = (general.position - settings.positions).abs().maxCoeff();
  EXPECT_GT(moved, 0.005);
  EXPECT_LE((fused.position - general.position).abs().maxCoeff(), rounding) << method.name;
  EXPECT_LE((fused.velocity - general.velocity).abs().maxCoeff(), 1e3 * rounding) << method.name;
  for (const Index pin : settings.pins)
    for (int k = 0; k < 3; ++k) EXPECT_EQ(fused.position(pin, k), double(S(settings.positions(pin, k))));
}

TYPED_TEST(Stepper, IsTheGeneralMethodOnGridsOfAnySize) {
  for (const auto& [columns, rows] : {std::pair{2, 9}, {3, 3}, {8, 5}, {16, 4}, {17, 12}, {33, 20}, {40, 2}})
    expect_same_method<TypeParam>(sheet(columns, rows), velocity_verlet());
}

// Springs that are far from their rest lengths take another way than those that are near, neighbours of either kind.
TYPED_TEST(Stepper, IsTheGeneralMethodFarFromRest) {
  SoftBodySettings settings = sheet(33, 20);
  SpringNetwork network = *settings.network;
  for (std::size_t i = 0; i < network.springs.size(); ++i) {
    Spring& spring = network.springs[i];
    const double length = (settings.positions.row(spring.a) - settings.positions.row(spring.b)).matrix().norm();
    spring.stiffness *= 0.0001;  // they buckle: slow enough for rounding to stay small
    spring.rest_length = i % 5 ? length * (0.85 + 0.05 * double(i % 7)) : i % 3 ? 0 : 2 * length;
  }
  settings.network = std::make_shared<const SpringNetwork>(std::move(network));
  expect_same_method<TypeParam>(settings, velocity_verlet());
}

TYPED_TEST(Stepper, IsTheGeneralMethodForEverySplitting) {
  for (const Method* method : methods())
    if (std::holds_alternative<Splitting>(method->scheme)) expect_same_method<TypeParam>(sheet(17, 12), *method);
}

TYPED_TEST(Stepper, IsTheGeneralMethodOnMeshesInAnyOrder) {
  for (const SoftBodySettings& settings : {sheet(17, 12, true), without_rows(sheet(17, 12, true))})
    expect_same_method<TypeParam>(settings, velocity_verlet());
  for (const SoftBodySettings& settings : {sheet(33, 20, true), without_rows(sheet(33, 20, true))})
    expect_same_method<TypeParam>(settings, semi_implicit_euler());
  expect_same_method<TypeParam>(tangle(70, 400), velocity_verlet());
  expect_same_method<TypeParam>(tangle(9, 20), velocity_verlet());
}

// A stage goes from band to band with its sums; stages without a kick, pushes and uneven bands included. Short: threads
// that outnumber the processors wait for each other's turn.
TYPED_TEST(Stepper, HasTheSameBitsAtAnyThreadCount) {
  // Plain float as well as what is stepped in double.
  for (const bool compensated : {true, false}) {
    SoftBodySettings settings = sheet(90, 71);
    settings.motion.compensated = compensated;
    for (const Method* method : {&velocity_verlet(), &pefrl()}) {
      const Run one = run<TypeParam>(settings, *method, false, 1, 1.0 / 60);
      for (const int threads : {2, 3, 4}) {
        const Run many = run<TypeParam>(settings, *method, false, threads, 1.0 / 60);
        EXPECT_TRUE((one.position == many.position).all()) << threads << " threads, " << method->name;
        EXPECT_TRUE((one.velocity == many.velocity).all()) << threads << " threads, " << method->name;
      }
    }
  }
}

// Points that became infinite leave nothing in the stepper: the same tick goes well with more substeps. Columns that
// fill vectors, and such that do not.
TYPED_TEST(Stepper, ForgetsWhatBlewUp) {
  for (const int columns : {16, 17, 33})
    for (const bool rows : {true, false}) {
      SoftBodySettings settings = rows ? sheet(columns, 12) : without_rows(sheet(columns, 12));
      settings.precision = std::is_same_v<TypeParam, float> ? softbody::Precision::Float : softbody::Precision::Double;
      settings.motion.dt = 12 * softbody::make_soft_body(settings)->stable_step(velocity_verlet());
      settings.motion.retries = 6;
      World world(1 / (200 * settings.motion.dt));
      Body& body = world.add(softbody::make_soft_body(settings));
      const StepReport report = world.update(2 * world.clock().tick());
      EXPECT_TRUE(report.good()) << columns << " columns: " << report.text();
      EXPECT_GT(body.motion_facts().substeps, 200);
      settings.motion.retries = 0;
      World once(world.clock().tick_rate());
      once.add(softbody::make_soft_body(settings));
      EXPECT_FALSE(once.update(2 * world.clock().tick()).good());
    }
}

// Large grids run several stages down their rows at once; one band a thread does not.
TYPED_TEST(Stepper, HasTheSameBitsWhereStagesFollowEachOther) {
  for (const bool compensated : {true, false}) {
    SoftBodySettings settings = sheet(300, 150);
    settings.motion.compensated = compensated;
    const Run one = run<TypeParam>(settings, velocity_verlet(), false, 1, 1.0 / 60);
    const Run two = run<TypeParam>(settings, velocity_verlet(), false, 2, 1.0 / 60);
    EXPECT_TRUE((one.position == two.position).all());
  }
}

#ifdef HOOKE_TEST_HAS_HIGHWAY
// Instruction sets with multiply-add agree in every bit, and so do those without: springs near their rest lengths and
// far from them, in every precision.
TEST(InstructionSets, AgreeInEveryBitWithTheirKind) {
  std::vector<SoftBodySettings> bodies{sheet(37, 20), sheet(37, 20, true), without_rows(sheet(17, 12, true))};
  SpringNetwork odd = *bodies[0].network;
  for (std::size_t i = 0; i < odd.springs.size(); i += 7) odd.springs[i].rest_length = i % 2 ? 0 : 0.1;
  bodies.push_back(bodies[0]);
  bodies.back().network = std::make_shared<const SpringNetwork>(std::move(odd));
  using softbody::Precision;
  const auto ends = [&](std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    std::vector<Points<double>> out;
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (const Precision precision : {Precision::Float, Precision::Double, Precision::DoubleFloat}) {
        if (i == 2 && precision == Precision::DoubleFloat) continue;  // grids only
        SoftBodySettings settings = bodies[i];
        settings.precision = precision;
        World world;
        Body& body = world.add(softbody::make_soft_body(settings));
        EXPECT_TRUE(world.update(0.05).good());
        out.push_back(body.positions());
        out.push_back(body.velocities());
      }
    hwy::SetSupportedTargetsForTest(0);
    return out;
  };
  const std::int64_t all = hwy::SupportedTargets() & HWY_TARGETS;  // that kernels are compiled for
  constexpr std::int64_t kWithout = HWY_SSE4 | HWY_SSSE3 | HWY_SCALAR;
  std::vector<std::vector<Points<double>>> kinds;
  int compared = 0;
  for (const std::int64_t kind : {~kWithout, kWithout}) {
    std::vector<Points<double>> first;
    for (std::int64_t rest = all & kind & (HWY_AVX3 | HWY_AVX2 | kWithout); rest != 0; rest &= rest - 1) {
      const std::int64_t target = rest & -rest;
      auto end = ends(target);
      if (first.empty()) {
        first = std::move(end);
        continue;
      }
      ++compared;
      for (std::size_t i = 0; i < end.size(); ++i)
        EXPECT_TRUE((end[i] == first[i]).all()) << "result " << i << " with " << hwy::TargetName(target);
    }
    if (!first.empty()) kinds.push_back(std::move(first));
  }
  if (compared == 0) GTEST_SKIP() << "one instruction set of a kind here";
  // They are really switched: with multiply-add and without, results differ by rounding.
  if (kinds.size() == 2) {
    EXPECT_FALSE((kinds[0][0] == kinds[1][0]).all());
  }
}
#endif

// Where rounding shows a body in float is stepped in double: what its float places drop is kept from tick to tick.
class FineStepper : public testing::Test {
 protected:
  // Velocities after 0.1 s at a share of the largest stable step.
  static Points<double> end(SoftBodySettings settings, double share, softbody::Precision precision, bool compensated) {
    settings.motion.dt = share * softbody::make_soft_body(settings)->stable_step(velocity_verlet());
    settings.precision = precision;
    settings.motion.compensated = compensated;
    settings.motion.watches_energy = false;  // which plain float gains
    World world;
    Body& body = world.add(softbody::make_soft_body(settings));
    EXPECT_TRUE(world.update(0.1).good());
    return body.velocities();
  }

  static void expect_less_error(SoftBodySettings settings, double share, double times) {
    // Places and masses that both precisions have.
    settings.positions = settings.positions.cast<float>().cast<double>();
    settings.masses = settings.masses.cast<float>().cast<double>();
    settings.velocities.setZero();
    const Points<double> exact = end(settings, share, softbody::Precision::Double, true);
    const double fine = (end(settings, share, softbody::Precision::Float, true) - exact).abs().maxCoeff();
    const double plain = (end(settings, share, softbody::Precision::Float, false) - exact).abs().maxCoeff();
    EXPECT_GT(fine, 0);
    EXPECT_LT(fine, plain / times) << plain << " m/s without";
  }
};

TEST_F(FineStepper, KeepsWhatFloatDrops) {
  for (SoftBodySettings settings : {sheet(17, 12), sheet(17, 12, true), without_rows(sheet(17, 12, true))}) {
    SpringNetwork stiff = *settings.network;
    for (Spring& spring : stiff.springs) spring.stiffness *= 3e4;
    settings.network = std::make_shared<const SpringNetwork>(std::move(stiff));
    expect_less_error(settings, 0.5, 100);
  }
}

// Steps far below the stable one ask for accuracy, whatever the speed.
TEST_F(FineStepper, IsTakenForFineSteps) { expect_less_error(sheet(17, 12), 0.05, 20); }

// Two floats are nearer to double than one, at the same steps.
TEST(TwoFloats, LoseFarLessThanOne) {
  SoftBodySettings settings = sheet(33, 20);
  const auto end = [&](softbody::Precision precision) {
    settings.precision = precision;
    World world;
    Body& body = world.add(softbody::make_soft_body(settings));
    EXPECT_TRUE(world.update(0.1).good());
    EXPECT_EQ(body.motion_facts().precision, softbody::precision_name(precision));
    return body.positions();
  };
  const Points<double> exact = end(softbody::Precision::Double);
  const double one = (end(softbody::Precision::Float) - exact).abs().maxCoeff();
  const double two = (end(softbody::Precision::DoubleFloat) - exact).abs().maxCoeff();
  EXPECT_GT(two, 0);
  EXPECT_LT(two, one / 10) << one << " in one float";
}

// Increments far below a float's last place add up; what is left is the rounding of forces.
TEST(TwoFloats, KeepTinySteps) {
  SoftBodySettings settings = sheet(9, 9);
  settings.positions.col(0) += 100;
  settings.pins.clear();
  settings.motion.dt = 1e-6;
  settings.velocities = Points<double>::Constant(81, 3, 0.01);
  const auto error = [&](softbody::Precision precision) {
    settings.precision = precision;
    World world;
    world.enable_gravity(false);
    Body& body = world.add(softbody::make_soft_body(settings));
    EXPECT_TRUE(world.update(0.05).good());
    return (body.positions() - settings.positions - 0.05 * 0.01).abs().maxCoeff();
  };
  EXPECT_LT(error(softbody::Precision::DoubleFloat), 1e-7);
  // One float keeps them where its sums are compensated, to its place's rounding.
  EXPECT_LT(error(softbody::Precision::Float), 5e-6);
  settings.motion.compensated = false;
  EXPECT_GT(error(softbody::Precision::Float), 1e-4);
}

TEST(TwoFloats, SayWhatTheyTake) {
  SoftBodySettings settings = sheet(9, 9);
  settings.precision = softbody::Precision::DoubleFloat;
  settings.motion.method = &rk4();
  EXPECT_THROW(softbody::make_soft_body(settings), std::invalid_argument);
  settings = sheet(9, 9, true);
  settings.precision = softbody::Precision::DoubleFloat;
  EXPECT_NO_THROW(softbody::make_soft_body(settings));
  settings = without_rows(settings);
  EXPECT_THROW(softbody::make_soft_body(settings), std::invalid_argument);
}

// Rest is bitwise rest: the kernel's forces at rest lengths are exactly zero.
TYPED_TEST(Stepper, KeepsRest) {
  for (SoftBodySettings settings : {sheet(19, 13), sheet(19, 13, true), without_rows(sheet(19, 13)), tangle(50, 200)}) {
    if (settings.positions.rows() == 50) {
      SpringNetwork network = *settings.network;
      for (Spring& spring : network.springs) spring.rest_length = Spring::kFromStart;
      settings.network = std::make_shared<const SpringNetwork>(std::move(network));
    }
    settings.velocities.setZero();
    settings.pins.clear();
    settings.precision = std::is_same_v<TypeParam, float> ? softbody::Precision::Float : softbody::Precision::Double;
    World world;
    world.enable_gravity(false);
    Body& body = world.add(softbody::make_soft_body(settings));
    EXPECT_TRUE(dynamic_cast<PointBody<TypeParam>&>(body).fused());
    const Points<double> start = body.positions();
    EXPECT_TRUE(world.update(0.5).good());
    EXPECT_TRUE((body.positions() == start).all());
    EXPECT_TRUE((body.velocities() == 0).all());
  }
}

// The kernel of grids finds the rows of a grid in any numbering, and one of its points is where it says.
TEST(GridOrder, FindsRowsInAnyNumbering) {
  for (const auto& [columns, rows] : {std::pair{2, 2}, {2, 9}, {5, 3}, {9, 9}, {40, 17}}) {
    SoftBodySettings settings = sheet(columns, rows, true);
    // Rolled up by 17 degrees a column, or to three quarters of a turn, narrower downwards.
    const double turn = std::min(4.7, 0.3 * (columns - 1));
    for (Index i = 0; i < settings.positions.rows(); ++i) {
      const double angle = turn * settings.positions(i, 0), r = (1 + 0.2 * settings.positions(i, 1)) / turn;
      settings.positions.row(i) << r * std::sin(angle), settings.positions(i, 1), r * std::cos(angle);
    }
    const std::vector<int> order = softbody::grid_order(*settings.network, settings.positions);
    ASSERT_EQ(Index(order.size()), settings.positions.rows()) << columns << " × " << rows;
    std::vector<int> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], int(i));
    const SpringNetwork network = softbody::renumbered(*settings.network, order);
    const softbody::SpringGrid grid = softbody::SpringGrid::of(network, settings.positions.rows());
    EXPECT_EQ(std::max(grid.rows, grid.columns), std::max(columns, rows));
    const Points<double> x = softbody::renumbered(settings.positions, order);
    for (std::size_t i = 0; i < network.springs.size(); ++i) {
      const Spring &now = network.springs[i], &before = settings.network->springs[i];
      EXPECT_TRUE((x.row(now.a) == settings.positions.row(before.a)).all());
      EXPECT_TRUE((x.row(now.b) == settings.positions.row(before.b)).all());
    }
  }
}

TEST(GridOrder, IsEmptyWhereThereAreNoRows) {
  SoftBodySettings torn = sheet(9, 9, true);
  SpringNetwork network = *torn.network;
  std::erase_if(network.springs, [](const Spring& spring) { return spring.a == 40 || spring.b == 40; });
  for (const SoftBodySettings& settings : {tangle(70, 400), tangle(9, 20), without_rows(sheet(9, 9))})
    EXPECT_TRUE(softbody::grid_order(*settings.network, settings.positions).empty());
  EXPECT_TRUE(softbody::grid_order(network, torn.positions).empty());
  torn.positions.setZero();
  EXPECT_TRUE(softbody::grid_order(*torn.network, torn.positions).empty());
  torn.positions.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(softbody::grid_order(*torn.network, torn.positions).empty());
}

// Springs that share a place, and springs of no length, pull nowhere and spoil nothing.
TYPED_TEST(Stepper, SurvivesPointsAtOnePlace) {
  for (SoftBodySettings settings : {sheet(9, 9), sheet(9, 9, true), without_rows(sheet(9, 9))}) {
    settings.positions.row(40) = settings.positions.row(41);
    const Run fused = run<TypeParam>(settings, velocity_verlet(), false);
    EXPECT_TRUE(fused.position.allFinite());
  }
}

}  // namespace
}  // namespace hooke::test
