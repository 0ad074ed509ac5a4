// Small-step XPBD: stiffness in N/m whatever the iterations, nothing lost to float, rest that is rest, and
// bounded where others break.
#include "core/problems.hpp"
#include "softbody/sheet.hpp"

#include <hooke/softbody/lattice.hpp>
#include <hooke/softbody/soft_body.hpp>

#include <Eigen/Geometry>
#include <sstream>

namespace hooke::test {
namespace {

using namespace softbody;

using test::sheet;

const Vec3 kGravity{0, -9.81, 0};
constexpr double kFrame = 1.0 / 60;

template <class S>
constexpr Precision kPrecision = std::is_same_v<S, float> ? Precision::Float : Precision::Double;

// A chain that hangs from point 0, which is held; the last mass may be another.
SoftBodySettings chain(int links, double stiffness, double mass, double length, double last) {
  SoftBodySettings settings;
  auto network = std::make_shared<SpringNetwork>();
  settings.positions.setZero(links + 1, 3);
  settings.masses.setConstant(links + 1, mass);
  for (int i = 0; i <= links; ++i) settings.positions(i, 1) = -i * length;
  for (int i = 0; i < links; ++i) network->springs.push_back({i, i + 1, stiffness, 0, length});
  settings.masses[links] = last;
  settings.network = std::move(network);
  settings.pins = {0};
  settings.precision = Precision::Double;
  return settings;
}

// A cube of points joined along edges, faces and diagonals, its lowest corner at the origin.
SoftBodySettings cube(int n, double size, double mass, double stiffness, double damping) {
  SoftBodySettings settings;
  auto network = std::make_shared<SpringNetwork>();
  settings.positions.resize(n * n * n, 3);
  settings.masses.setConstant(n * n * n, mass / (n * n * n));
  const auto at = [n](int i, int j, int k) { return (i * n + j) * n + k; };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        settings.positions.row(at(i, j, k)) << i * size / (n - 1), j * size / (n - 1), k * size / (n - 1);
        for (int step = 14; step < 27; ++step) {
          const int u = i + step / 9 - 1, v = j + step / 3 % 3 - 1, w = k + step % 3 - 1;
          if (std::min({u, v, w}) >= 0 && std::max({u, v, w}) < n)
            network->springs.push_back({at(i, j, k), at(u, v, w), stiffness, damping});
        }
      }
  settings.network = std::move(network);
  settings.precision = Precision::Double;
  return settings;
}

SoftBodySettings projected(SoftBodySettings settings, double dt = 0, int iterations = 0) {
  settings.motion.method = &xpbd();
  settings.motion.dt = dt;
  settings.motion.iterations = iterations;
  return settings;
}

struct Play {
  std::unique_ptr<Body> body;
  std::vector<Collider> colliders;
  Vec3 gravity = kGravity;
  double lost_a_second = 0;  // global damping
  double time = 0;

  explicit Play(const SoftBodySettings& settings) : body(make_soft_body(settings)) {}
  StepReport tick(double seconds) {
    body->begin_frame(seconds, 0, time, time + seconds);
    StepReport report = body->advance({time, time + seconds, gravity, colliders});
    if (lost_a_second > 0) body->damp(std::pow(1 - lost_a_second, seconds));
    time += seconds;
    return report;
  }
  void run(double seconds, double tick_length = 1.0 / 240) {
    const int ticks = int(std::lround(seconds / tick_length));
    for (int i = 0; i < ticks; ++i) {
      const StepReport report = tick(tick_length);
      ASSERT_TRUE(report.good()) << report.text();
    }
  }
  double fastest() const { return std::sqrt(body->velocities().square().rowwise().sum().maxCoeff()); }
};

double rms(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().rowwise().sum().mean());
}

SoftBodySettings in(Precision precision, SoftBodySettings settings) {
  settings.precision = precision;
  return settings;
}

Collider floor_at(const Vec3& normal, double friction) {
  return {"floor", {HalfSpace{normal.normalized(), 0}}, {}, {}, friction, 0};
}

template <class S>
class Xpbd : public ::testing::Test {};
TYPED_TEST_SUITE(Xpbd, Scalars);

double hang(const SoftBodySettings& settings, double seconds) {
  Play play(settings);
  play.lost_a_second = 0.9;
  play.run(seconds);
  EXPECT_LT(play.fastest(), 1e-4);
  return -play.body->positions().col(1).minCoeff() - 1;
}

TYPED_TEST(Xpbd, StiffnessMeansTheSameAtAnyIterationCountAndSubstep) {
  const SoftBodySettings settings = in(kPrecision<TypeParam>, sheet(8, false));
  const double extension = hang(sheet(8, false), 6);  // by velocity Verlet in double
  for (const int iterations : {1, 4, 16})
    for (const int substeps : {20, 80}) {
      if (iterations == 16 && substeps == 80) continue;  // the dearest
      SCOPED_TRACE(std::to_string(iterations) + " iterations, " + std::to_string(substeps) + " substeps");
      EXPECT_NEAR(hang(projected(settings, kFrame / substeps, iterations), 6), extension, 0.01 * extension);
    }
}

TYPED_TEST(Xpbd, FreeFallLosesNothingToSpringsAndDampers) {
  SoftBodySettings settings = in(kPrecision<TypeParam>, cube(4, 0.2, 1, 2000, 5));
  settings.velocities.setConstant(64, 3, 0.5);
  Play play(projected(settings));
  const Points<double> start = play.body->positions();
  play.run(1);
  for (Index i = 0; i < 64; ++i) {
    EXPECT_NEAR(play.body->velocities()(i, 1), 0.5 - 9.81, 2000 * kUnit<TypeParam> * 9.81);
    EXPECT_NEAR(play.body->positions()(i, 0) - start(i, 0), 0.5, 1e4 * kUnit<TypeParam>);
  }
  // Semi-implicit Euler's fall: g t (t + h) / 2.
  EXPECT_NEAR(play.body->displacement()[1], 0.5 - 9.81 * (1 + 1.0 / 1200) / 2, 1e4 * kUnit<TypeParam>);
}

TYPED_TEST(Xpbd, MomentumIsKeptToRounding) {
  SoftBodySettings settings = in(kPrecision<TypeParam>, cube(4, 0.2, 1, 2000, 1));
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  settings.velocities.resize(64, 3);
  for (Index i = 0; i < 64; ++i)
    for (int k = 0; k < 3; ++k) settings.velocities(i, k) = normal(random);
  Play play(projected(settings));
  play.gravity.setZero();
  const Vec3 before = play.body->momentum();
  const auto spin = [&] {
    Vec3 sum = Vec3::Zero();
    const Points<double> x = play.body->positions(), v = play.body->velocities();
    for (Index i = 0; i < 64; ++i) sum += play.body->masses()[i] * row(x, i).cross(row(v, i));
    return sum;
  };
  const Vec3 spin_before = spin();
  play.run(0.5);
  EXPECT_LT((play.body->momentum() - before).norm(), 2000 * kUnit<TypeParam>);
  // Springs push along where they were a moment ago: angular momentum is kept to first order.
  EXPECT_LT((spin() - spin_before).norm(), 0.2 * spin_before.norm());
}

TEST(XpbdBody, ConvergesAtFirstOrder) {
  const SoftBodySettings settings = sheet(8, true);
  SoftBodySettings exact = settings;
  exact.motion.dt = 2e-5;
  Play fine(exact);
  fine.run(0.25);
  double last = 0;
  for (const double dt : {1.0 / 7680, 1.0 / 15360, 1.0 / 30720}) {
    Play play(projected(settings, dt, 4));
    play.run(0.25);
    const double error = rms(play.body->positions(), fine.body->positions());
    if (last > 0) {
      EXPECT_GT(last / error, 1.7) << dt;
      EXPECT_LT(last / error, 2.5) << dt;
    }
    last = error;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(XpbdBody, FloatDoesNotGetWorseAsStepsShrink) {
  for (const double dt : {1e-3, 1e-4, 1e-5}) {
    Play rough(projected(in(Precision::Float, sheet(8, true)), dt, 2)), fine(projected(sheet(8, true), dt, 2));
    rough.run(0.1);
    fine.run(0.1);
    EXPECT_LT(rms(rough.body->positions(), fine.body->positions()), 3e-6) << dt;
  }
}

TEST(XpbdBody, WaysBelowTheRoundingOfPositionsAreNotLost) {
  SoftBodySettings settings = chain(1, 100, 1, 0.1, 1);
  settings.pins.clear();
  settings.positions.col(0).setConstant(1);
  settings.velocities.setZero(2, 3);
  settings.velocities.col(0).setConstant(1e-3);
  Play play(projected(in(Precision::Float, settings), 1e-5, 1));
  play.gravity.setZero();
  play.run(1);  // 100,000 ways of 1e-8 m, a twelfth of the spacing of floats at 1
  EXPECT_NEAR(play.body->displacement()[0], 1e-3, 2e-7);
  play.body->set_position(0, {1, 0, 0});
  EXPECT_EQ(play.body->positions()(0, 0), 1);
}

TYPED_TEST(Xpbd, RestWithoutForcesStaysBitwiseAtRest) {
  Play play(projected(in(kPrecision<TypeParam>, cube(4, 0.2, 1, 2000, 1))));
  play.gravity.setZero();
  const Points<double> start = play.body->positions();
  play.run(1);
  EXPECT_TRUE((play.body->positions() == start).all());
  EXPECT_EQ(play.fastest(), 0);
}

TYPED_TEST(Xpbd, HangingAtRestStaysThere) {
  Play play(projected(in(kPrecision<TypeParam>, chain(10, 500, 0.1, 0.1, 0.1)), 0, 1));
  play.lost_a_second = 0.99;
  play.run(30);
  for (Index j = 1; j <= 10; ++j) {
    const double sag = 0.1 * 9.81 / 500 * double(j * 10 - j * (j - 1) / 2);
    EXPECT_NEAR(play.body->displacement(j)[1], -sag, 1e-3 * sag);
  }
  EXPECT_LT(play.fastest(), 1e-5);
  play.lost_a_second = 0;  // and stays so undamped
  play.run(10);
  EXPECT_LT(play.fastest(), 1e-5);
}

TYPED_TEST(Xpbd, SticksToASlopeBelowTheAngleOfFriction) {
  for (const double slope : {0.25, 0.5}) {
    Play play(projected(in(kPrecision<TypeParam>, cube(4, 0.2, 1, 2000, 1))));
    play.gravity = 9.81 / std::hypot(1, slope) * Vec3(slope, -1, 0);  // down a slope on which x and y stay
    play.colliders = {floor_at({0, 1, 0}, 0.3)};
    play.run(3);
    const Vec3 before = play.body->displacement();
    play.run(3);
    const double way = (play.body->displacement() - before).norm();
    if (slope < 0.3) {
      EXPECT_LT(way, 1e-6);
      EXPECT_LT(play.fastest(), 1e-4);
    } else {
      EXPECT_GT(way, 1);
    }
  }
}

TYPED_TEST(Xpbd, SagOnAFloorIsTheStaticOne) {
  // On a floor that nothing slides on, the lowest points are as good as held.
  SoftBodySettings held = cube(4, 0.2, 1, 500, 1);
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k) held.pins.push_back(16 * i + k);
  const auto sag = [](const SoftBodySettings& settings, bool on_floor) {
    Play play(settings);
    if (on_floor) play.colliders = {floor_at({0, 1, 0}, 10)};
    play.lost_a_second = 0.9;
    play.run(6);
    EXPECT_LT(play.fastest(), 1e-4);
    return -play.body->displacement()[1];
  };
  const double wanted = sag(held, false);
  EXPECT_GT(wanted, 1e-4);
  const SoftBodySettings settings = in(kPrecision<TypeParam>, cube(4, 0.2, 1, 500, 1));
  EXPECT_NEAR(sag(projected(settings, 0, 1), true), wanted, 0.01 * wanted);
  EXPECT_NEAR(sag(projected(settings), true), wanted, 0.01 * wanted);
}

TYPED_TEST(Xpbd, IsBoundedAtAnyStiffness) {
  for (const double stiffness : {1e2, 1e4, 1e6})
    for (const int iterations : {1, 4}) {
      SCOPED_TRACE(std::to_string(stiffness) + ", " + std::to_string(iterations));
      Play play(projected(in(kPrecision<TypeParam>, sheet(10, true, stiffness)), kFrame, iterations));
      const Energy start = play.body->energy(kGravity);
      play.run(5, kFrame);
      const Points<double> x = play.body->positions();
      EXPECT_LT(x.abs().maxCoeff(), 2.5);
      EXPECT_LT(play.body->energy(kGravity).kinetic, start.gravitational + 0.3 * 9.81 * 1.2);
    }
}

TYPED_TEST(Xpbd, IsBoundedWhenOverstretched) {
  SoftBodySettings settings = in(kPrecision<TypeParam>, sheet(10, true));
  auto network = std::make_shared<SpringNetwork>(*settings.network);
  const std::vector<double> rest = rest_lengths(*network, settings.positions);
  for (std::size_t i = 0; i < rest.size(); ++i) network->springs[i].rest_length = 0.1 * rest[i];
  settings.network = network;
  for (const double dt : {kFrame, 1.0 / 1200}) {
    Play play(projected(settings, dt, 1));
    const double start = play.body->energy(kGravity).elastic;
    play.run(4, kFrame);
    const Energy energy = play.body->energy(kGravity);
    EXPECT_LT(energy.kinetic, start);
    EXPECT_LT(play.body->positions().abs().maxCoeff(), 3);
  }
}

TYPED_TEST(Xpbd, HeavyEndHangsWhereItShould) {
  const double g = 9.81, mass = 1e-3, stiffness = 10;
  for (const double ratio : {1e2, 1e4}) {
    const SoftBodySettings settings = in(kPrecision<TypeParam>, chain(10, stiffness * ratio, mass, 0.1, ratio * mass));
    Play play(projected(settings));
    play.lost_a_second = 0.63;
    play.run(5);
    EXPECT_LT(play.fastest(), 10);
    play.run(25);
    const double wanted = g * mass / (stiffness * ratio) * (10 * ratio + 45);
    EXPECT_NEAR(-play.body->displacement(10)[1], wanted, 0.01 * wanted) << ratio;
  }
}

TYPED_TEST(Xpbd, PinsAreExactlyAtTheirTarget) {
  Play play(projected(in(kPrecision<TypeParam>, sheet(6, true))));
  play.body->move_pin(0, {0.25, 0.5, -0.125});
  ASSERT_TRUE(play.tick(kFrame).good());
  EXPECT_EQ(row(play.body->positions(), 0), Vec3(0.25, 0.5, -0.125));
  EXPECT_EQ(play.body->velocities().row(0).matrix().norm(), 0);
  play.body->drive_pins({5}, [](double t, Points<double>& out) { out.row(0) << 20 * t, 0, 0; });
  ASSERT_TRUE(play.tick(0.25).good());
  EXPECT_EQ(play.body->positions()(5, 0), double(TypeParam(20 * play.time)));
  EXPECT_NEAR(play.body->velocities()(5, 0), 20, 1e-2);
}

TYPED_TEST(Xpbd, CoincidentPointsAndZeroLengthsStayFinite) {
  SoftBodySettings settings = in(kPrecision<TypeParam>, chain(3, 1e5, 0.1, 0.1, 0.1));
  settings.positions.row(2) = settings.positions.row(1);
  auto network = std::make_shared<SpringNetwork>(*settings.network);
  network->springs[1].rest_length = 0;
  network->springs.push_back({1, 2, 1e3, 0, 0.05});
  network->springs.push_back({1, 3, 0, 2, 0.1});  // a damper alone
  settings.network = network;
  Play play(projected(settings, 0, 1));
  play.run(2);
  EXPECT_LT(play.body->positions().abs().maxCoeff(), 1);
}

TEST(XpbdBody, GoesOnFromACheckpointWithTheSameBits) {
  const auto make = [](World& world) -> Body& {
    world.add_collider(floor_at({0, 1, 0}, 0.3));
    SoftBodySettings settings = projected(in(Precision::Float, cube(4, 0.2, 1, 2000, 1)), 0, 2);
    settings.positions.col(1) += 0.01;
    return world.add(make_soft_body(settings));
  };
  World whole(240), resumed(240);
  const Body &one = make(whole), &other = make(resumed);
  const auto run = [](World& world) {
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(world.update(kFrame).good());
  };
  run(whole);
  std::stringstream file;
  whole.save(file);
  resumed.load(file);
  run(whole);
  run(resumed);
  EXPECT_TRUE((one.positions() == other.positions()).all());
  EXPECT_TRUE((one.velocities() == other.velocities()).all());
}

TEST(XpbdBody, TellsWhatWasUsedAndRefusesWhatItCannot) {
  Play play(projected(sheet(4, true)));
  play.run(1.0 / 240);
  const MotionFacts facts = play.body->motion_facts();
  EXPECT_EQ(facts.method, "xpbd");
  EXPECT_EQ(facts.substeps, 5);
  EXPECT_EQ(facts.wanted_dt, 0);
  EXPECT_EQ(facts.stable_step, std::numeric_limits<double>::infinity());
  SoftBodySettings verlet = sheet(4, true);
  verlet.motion.iterations = 3;
  EXPECT_THROW(make_soft_body(verlet), std::invalid_argument);
  EXPECT_THROW(make_soft_body(projected(sheet(4, true), 0, -1)), std::invalid_argument);
  SoftBodySettings voluminous = projected(sheet(4, true));
  voluminous.volume_stiffness = 1;
  EXPECT_THROW(make_soft_body(voluminous), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::test
