// Throws, drag, chains, orbits, strings and membranes whose answers are known to many digits.
#include "core/problems.hpp"

#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <Eigen/Geometry>
#include <numbers>

namespace hooke::test {
namespace {

using softbody::Family;
using softbody::SpringField;
using softbody::SpringNetwork;

const Vec3 kGravity{0, -9.81, 0};

void give_springs(PointBody<double>& body, SpringNetwork network) {
  auto shared = std::make_shared<const SpringNetwork>(std::move(network));
  body.add_field(std::make_unique<SpringField<double>>(shared, body.state().position));
}

// RK4, dt = 1 ms.
template <class Field>
std::unique_ptr<PointBody<double>> thrown(const Vec3& velocity, double coefficient, double seconds) {
  auto body = body_of(point<double>({0, 0, 0}, velocity), motion(rk4(), 1e-3));
  body->add_field(std::make_unique<Field>(coefficient));
  EXPECT_TRUE(run(*body, 1e-3, int(std::lround(seconds * 1000)), kGravity).good());
  return body;
}

TEST(Throw, WithLinearDragIsTheClosedForm) {
  const Vec3 x = row(thrown<LinearDrag<double>>({30, 30, 0}, 0.1, 3)->positions(), 0);
  EXPECT_NEAR(x.x(), 77.754533795, 5e-10);
  EXPECT_NEAR(x.y(), 37.711859307, 5e-10);
}

TEST(Throw, WithQuadraticDragFromRestIsTheClosedForm) {
  const auto body = thrown<QuadraticDrag<double>>({0, 0, 0}, 0.01, 3);
  EXPECT_NEAR(body->velocities()(0, 1), -23.022476383, 5e-10);
  EXPECT_NEAR(body->positions()(0, 1), -38.859071980, 5e-10);
}

TEST(Throw, UpwardWithQuadraticDragTurnsAtTheKnownTimeAndHeight) {
  // The apex by one Newton step from the last millisecond: v = -g t there to second order.
  auto body = thrown<QuadraticDrag<double>>({0, 30, 0}, 0.01, 2.438);
  const double v = body->velocities()(0, 1), y = body->positions()(0, 1);
  const double decay = 9.81 + 0.01 * v * v;
  EXPECT_NEAR(2.438 + v / decay, 2.438818574, 5e-9);
  EXPECT_NEAR(y + v * v / (2 * decay), 32.549318487, 5e-9);
}

TEST(Throw, InTheOpenWithQuadraticDragAgreesToTenDigits) {
  const auto body = thrown<QuadraticDrag<double>>({30, 30, 0}, 0.01, 3);
  EXPECT_NEAR(body->positions()(0, 0), 60.7605452585, 5e-10);
  EXPECT_NEAR(body->positions()(0, 1), 24.9712406124, 5e-10);
  EXPECT_NEAR(body->velocities()(0, 0), 14.8542630734, 5e-10);
  EXPECT_NEAR(body->velocities()(0, 1), -7.5607911442, 5e-10);
}

TEST(Throw, EndsAtItsTerminalSpeedWithEveryMethod) {
  for (const Method* method : damped_methods()) {
    SCOPED_TRACE(method->name);
    auto body = body_of(point<double>({0, 0, 0}, {0, 0, 0}), motion(*method, 0.01));
    body->add_field(std::make_unique<QuadraticDrag<double>>(0.01));
    ASSERT_TRUE(run(*body, 0.01, 6000, kGravity).good());
    // A solve stops at 1e-12 of the speed a step θh, which drag at the rate 2 g / v takes away.
    const auto* implicit = std::get_if<Implicit>(&method->scheme);
    const auto solver = [&](double speed, double rate) {
      return implicit ? 1e-12 * speed / (implicit->theta * 0.01 * rate) : 0;
    };
    EXPECT_NEAR(body->speed(0), 31.320919527, 1e-8 + solver(31.3, 2 * 9.81 / 31.3));
    auto linear = body_of(point<double>({0, 0, 0}, {0, 0, 0}), motion(*method, 0.01));
    linear->add_field(std::make_unique<LinearDrag<double>>(0.5));
    ASSERT_TRUE(run(*linear, 0.01, 6000, kGravity).good());
    EXPECT_NEAR(linear->speed(0), 9.81 / 0.5, 5e-9 + solver(9.81 / 0.5, 0.5));
  }
}

TEST(HangingChain, SettlesAtItsStaticLengths) {
  const int n = 10;
  const double k = 500, m = 0.1, length = 0.1;
  Points<double> x = Points<double>::Zero(n + 1, 3);
  SpringNetwork network;
  for (int i = 0; i <= n; ++i) x(i, 1) = -length * i;
  for (int i = 0; i < n; ++i) network.springs.push_back({i, i + 1, k, 0, length, Family::Raw});
  // Huge steps of implicit Euler: any oscillation is gone after a few.
  auto body = body_of(points<double>(x, Points<double>::Zero(n + 1, 3), Values<double>::Constant(n + 1, m)),
                      motion(implicit_euler(), 1));
  body->pin(0);
  give_springs(*body, std::move(network));
  ASSERT_TRUE(run(*body, 1, 200, kGravity).good());
  const Points<double> settled = body->positions();
  for (int j = 1; j <= n; ++j) {
    const double known = j * length + m * 9.81 / k * (j * n - j * (j - 1) / 2.0);
    EXPECT_NEAR(-settled(j, 1), known, 1e-10);
  }
  EXPECT_NEAR(-settled(10, 1), 1.10791, 5e-6);
  EXPECT_NEAR(-settled(5, 1), 0.57848, 5e-6);
}

TEST(HangingCloth, WithoutShearStretchesByHalfItsWeightAtAnyResolution) {
  const double width = 0.2, height = 1;
  softbody::ClothMaterial material;
  material.shear = 0, material.bend = 0;
  const double extension = material.density * width * height * 9.81 / (2 * material.stretch * width / height);
  for (const int rows_count : {3, 6, 11, 41}) {
    SCOPED_TRACE(rows_count);
    const auto cloth = softbody::cloth_from_grid(width, height, 3, rows_count, Vec3::UnitX(), -Vec3::UnitY(), material);
    const Index n = cloth.positions.rows();
    auto body =
        body_of(points<double>(cloth.positions, Points<double>::Zero(n, 3), cloth.masses), motion(implicit_euler(), 1));
    for (Index i = 0; i < 3; ++i) body->pin(i);
    give_springs(*body, *cloth.network);
    ASSERT_TRUE(run(*body, 1, 100, kGravity).good());
    for (Index i = n - 3; i < n; ++i) EXPECT_NEAR(-body->positions()(i, 1) - height, extension, 1e-8);
  }
}

// Two points of 1 kg that circle each other at ω = 2 on a spring of 100 N/m and 1 m.
std::unique_ptr<PointBody<double>> orbit(const Method& method, double dt, double length, double omega) {
  auto body =
      body_of(points<double>(rows({{-length / 2, 0, 0}, {length / 2, 0, 0}}),
                             rows({{0, -omega * length / 2, 0}, {0, omega * length / 2, 0}}), Values<double>::Ones(2)),
              motion(method, dt));
  SpringNetwork network;
  network.springs.push_back({0, 1, 100, 0, 1, Family::Raw});
  give_springs(*body, std::move(network));
  return body;
}

double distance(const PointBody<double>& body) {
  const Points<double> x = body.positions();
  return (row(x, 1) - row(x, 0)).norm();
}

double angular_momentum(const PointBody<double>& body) {
  const Points<double> x = body.positions(), v = body.velocities();
  return (row(x, 0).cross(row(v, 0)) + row(x, 1).cross(row(v, 1))).z();
}

TEST(Orbit, OfTwoPointsKeepsItsDistance) {
  const double r0 = 100.0 / (100 - 0.5 * 4);
  EXPECT_NEAR(r0, 1.020408163, 5e-10);
  auto body = orbit(rk4(), 1e-3, r0, 2);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(run(*body, 1e-3, 100).good());
    EXPECT_NEAR(distance(*body), r0, 1e-10);
  }
}

TEST(Orbit, BreathesAtItsFrequency) {
  // Slightly too wide at the same angular momentum; the time of 20 breaths between maxima.
  const double r0 = 100.0 / 98, r = r0 * (1 + 1e-5);
  const double dt = 2e-4;
  auto body = orbit(rk4(), dt, r, 2 * (r0 / r) * (r0 / r));
  std::vector<double> crossings;
  double before = distance(*body) - r0;
  for (int i = 1; crossings.size() < 21 && i < 200000; ++i) {
    ASSERT_TRUE(run(*body, dt, 1).good());
    const double now = distance(*body) - r0;
    if (before > 0 && now <= 0) crossings.push_back(dt * (i - 1 + before / (before - now)));
    before = now;
  }
  ASSERT_EQ(crossings.size(), 21u);
  const double omega = 20 * 2 * std::numbers::pi / (crossings.back() - crossings.front());
  EXPECT_NEAR(omega, 14.560220, 2e-6);
}

TEST(Orbit, KeepsAngularMomentumToRoundingWithSymplecticMethods) {
  for (const Method* method : {&semi_implicit_euler(), &verlet(), &velocity_verlet()}) {
    SCOPED_TRACE(method->name);
    auto body = orbit(*method, 0.01, 1.3, 2);
    const double before = angular_momentum(*body);
    for (int i = 0; i < 100; ++i) {
      ASSERT_TRUE(run(*body, 0.01, 100).good());
      EXPECT_NEAR(angular_momentum(*body), before, 1e-12);
    }
  }
  // The test can fail: explicit Euler spins up.
  auto body = orbit(explicit_euler(), 0.01, 1.3, 2);
  const double before = angular_momentum(*body);
  ASSERT_TRUE(run(*body, 0.01, 100).good());
  EXPECT_GT(std::abs(angular_momentum(*body) / before - 1), 0.01);
}

// Angular frequency of a motion that starts as a pure mode: x(t + T) + x(t - T) = 2 cos(ωT) x(t).
double frequency(PointBody<double>& body, Index point, int axis, double offset, double dt, int stride, int count) {
  double before = body.positions()(point, axis) - offset;
  run(body, dt, stride);
  double now = body.positions()(point, axis) - offset, sum = 0, square = 0;
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(run(body, dt, stride).good());
    const double next = body.positions()(point, axis) - offset;
    sum += (next + before) * now, square += 2 * now * now;
    before = now, now = next;
  }
  return std::acos(sum / square) / (dt * stride);
}

TEST(String, VibratesAcrossAtItsFrequencies) {
  // T = 1 N, m = 1 kg, a = 1 m: springs of 2 N/m that are 0.5 m too short.
  const int n = 9;
  const double known[] = {0.312868930, 0.618033989, 0.907980999};
  for (int mode = 1; mode <= 3; ++mode) {
    SCOPED_TRACE(mode);
    Points<double> x = Points<double>::Zero(n + 2, 3);
    SpringNetwork network;
    for (int i = 0; i < n + 2; ++i) {
      x(i, 0) = i;
      x(i, 1) = 1e-5 * std::sin(mode * std::numbers::pi * i / (n + 1));
    }
    x(n + 1, 1) = 0;
    for (int i = 0; i <= n; ++i) network.springs.push_back({i, i + 1, 2, 0, 0.5, Family::Raw});
    auto body =
        body_of(points<double>(x, Points<double>::Zero(n + 2, 3), Values<double>::Ones(n + 2)), motion(rk4(), 0.01));
    body->pin(0), body->pin(n + 1);
    give_springs(*body, std::move(network));
    EXPECT_NEAR(frequency(*body, 2, 1, 0, 0.01, 50, 40), known[mode - 1], 1e-9);
  }
}

TEST(String, VibratesAlongAtTheStiffnessInPlaceOfTheTension) {
  const int n = 9;
  const double k = 2;
  Points<double> x = Points<double>::Zero(n + 2, 3);
  SpringNetwork network;
  for (int i = 0; i < n + 2; ++i) x(i, 0) = i + 1e-5 * std::sin(std::numbers::pi * i / (n + 1));
  x(n + 1, 0) = n + 1;
  for (int i = 0; i <= n; ++i) network.springs.push_back({i, i + 1, k, 0, 0.5, Family::Raw});
  auto body =
      body_of(points<double>(x, Points<double>::Zero(n + 2, 3), Values<double>::Ones(n + 2)), motion(rk4(), 0.01));
  body->pin(0), body->pin(n + 1);
  give_springs(*body, std::move(network));
  EXPECT_NEAR(frequency(*body, 5, 0, 5, 0.01, 50, 40), 2 * std::sqrt(k) * std::sin(std::numbers::pi / 20), 1e-9);
}

TEST(Membrane, VibratesAtItsFirstFrequency) {
  const int n = 5, side = n + 2;
  Points<double> x(side * side, 3);
  SpringNetwork network;
  for (int r = 0; r < side; ++r)
    for (int c = 0; c < side; ++c) {
      const bool edge = r == 0 || c == 0 || r == side - 1 || c == side - 1;
      const double up = std::sin(std::numbers::pi * r / (n + 1)) * std::sin(std::numbers::pi * c / (n + 1));
      x.row(r * side + c) << c, edge ? 0 : 1e-5 * up, r;
      if (c + 1 < side) network.springs.push_back({r * side + c, r * side + c + 1, 10, 0, 0.5, Family::Raw});
      if (r + 1 < side) network.springs.push_back({r * side + c, (r + 1) * side + c, 10, 0, 0.5, Family::Raw});
    }
  auto body = body_of(points<double>(x, Points<double>::Zero(side * side, 3), Values<double>::Ones(side * side)),
                      motion(rk4(), 0.01));
  for (int i = 0; i < side * side; ++i)
    if (x(i, 0) == 0 || x(i, 0) == side - 1 || x(i, 2) == 0 || x(i, 2) == side - 1) body->pin(i);
  give_springs(*body, std::move(network));
  const double measured = frequency(*body, 3 * side + 3, 1, 0, 0.01, 20, 60);
  EXPECT_NEAR(measured, 1.636915, 5e-7);
}

// x'' = -xλ, y'' = -yλ - 1 from (1, 0) at rest, k = 1000.
TEST(StiffPendulum, AgreesWithTheLiteratureToTenDigits) {
  struct Known {
    double t, x, y;
  };
  constexpr Known kTable[] = {
      {1, 0.8810851673, -0.4759648786}, {5, -0.6934743662, -0.7234815533}, {10, -0.8013293243, -0.6012191973}};
  struct Case {
    const Method& method;
    double dt;
  };
  for (const Case& c : {Case{rk4(), 5e-5}, Case{pefrl(), 1e-4}, Case{blanes_moan_4(), 2.5e-4},
                        Case{blanes_moan_6(), 1e-3}, Case{dormand_prince(), 2e-4}}) {
    SCOPED_TRACE(c.method.name);
    auto body = body_of(
        points<double>(rows({{0, 0, 0}, {1, 0, 0}}), rows({Vec3::Zero(), Vec3::Zero()}), Values<double>::Ones(2)),
        motion(c.method, c.dt));
    body->pin(0);
    SpringNetwork network;
    network.springs.push_back({0, 1, 1000, 0, 1, Family::Raw});
    give_springs(*body, std::move(network));
    const Vec3 gravity{0, -1, 0};
    double t = 0;
    for (const Known& known : kTable) {
      ASSERT_TRUE(run(*body, c.dt, int(std::lround((known.t - t) / c.dt)), gravity, t, 100).good());
      t = known.t;
      EXPECT_NEAR(body->positions()(1, 0), known.x, 5.1e-11);
      EXPECT_NEAR(body->positions()(1, 1), known.y, 5.1e-11);
      EXPECT_NEAR(body->energy(gravity).total(), 0, 1e-12);
    }
  }
}

}  // namespace
}  // namespace hooke::test
