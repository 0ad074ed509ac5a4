// Implicit methods find their step from anywhere, and rest where contact and friction hold.
#include "core/problems.hpp"

#include <hooke/softbody/spring_field.hpp>

namespace hooke::test {
namespace {

using softbody::Spring;
using softbody::SpringField;
using softbody::SpringNetwork;

constexpr double kFrame = 1.0 / 60;

template <class S>
std::unique_ptr<PointBody<S>> with_springs(PointMasses<S> masses, const SpringNetwork& network, const Points<double>& x,
                                           const MotionSettings& settings) {
  auto body = body_of(std::move(masses), settings);
  body->add_field(std::make_unique<SpringField<S>>(std::make_shared<const SpringNetwork>(network), x.cast<S>()));
  return body;
}

// A hanging sheet of n × n points, 1 m and 0.3 kg, pinned along its first row.
struct Sheet {
  explicit Sheet(int size, double stiffness)
      : n(size), x(n * n, 3), mass(Values<double>::Constant(n * n, 0.3 / (n * n))) {
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c) {
        const int i = r * n + c;
        x.row(i) << double(c) / (n - 1), -double(r) / (n - 1) * std::sqrt(0.5), double(r) / (n - 1) * std::sqrt(0.5);
        const auto join = [&](int r2, int c2, double k) {
          if (r2 < n && c2 >= 0 && c2 < n)
            network.springs.push_back({i, r2 * n + c2, k * stiffness, 0, Spring::kFromStart});
        };
        join(r, c + 1, 500), join(r + 1, c, 500), join(r + 1, c + 1, 100), join(r + 1, c - 1, 100);
        join(r, c + 2, 5), join(r + 2, c, 5);
      }
  }
  template <class S>
  std::unique_ptr<PointBody<S>> body(const Points<double>& start, double dt) const {
    auto out = with_springs<S>(points<S>(start, Points<double>::Zero(n * n, 3), mass), network, x,
                               motion(implicit_euler(), dt));
    for (int c = 0; c < n; ++c) out->pin(c);
    return out;
  }
  int n;
  Points<double> x;
  Values<double> mass;
  SpringNetwork network;
};

template <class S>
class Implicitly : public ::testing::Test {};
TYPED_TEST_SUITE(Implicitly, Scalars);

// From `start`, with a step a frame and with four: every step is solved, and the sheet never has more energy than it
// began with.
template <class S>
void falls(const Sheet& sheet, const Points<double>& start) {
  for (const double ticks : {60.0, 240.0}) {
    SCOPED_TRACE(ticks);
    auto body = sheet.body<S>(start, 1 / ticks);
    const Vec3 gravity(0, -9.81, 0);
    const double first = body->energy(gravity).total();
    for (int step = 0; step < 12; ++step) {
      const StepReport report = body->advance({step / ticks, (step + 1) / ticks, gravity, {}});
      ASSERT_TRUE(report.good()) << report.text() << " at step " << step;
    }
    EXPECT_LT(body->energy(gravity).total(), first + 1e-3 * (1 + std::abs(first)));
  }
}

TYPED_TEST(Implicitly, SolvesASheetOfAnyStiffness) {
  for (const double factor : {1.0, 1e2, 1e4, 1e6}) {
    SCOPED_TRACE(factor);
    Sheet sheet(10, factor);
    falls<TypeParam>(sheet, sheet.x);
    sheet.mass[99] *= 3000;
    falls<TypeParam>(sheet, sheet.x);
  }
}

TYPED_TEST(Implicitly, SolvesASheetFromAnywhere) {
  Random random;
  SCOPED_TRACE(random.trace());
  const Sheet sheet(10, 1);
  const auto start = [&](auto place) {
    Points<double> x = sheet.x;
    for (Index i = sheet.n; i < x.rows(); ++i) x.row(i) = place(row(sheet.x, i)).transpose().array();
    return x;
  };
  falls<TypeParam>(sheet, start([](const Vec3& x) { return Vec3(10 * x); }));
  falls<TypeParam>(sheet, start([&](const Vec3&) { return random.vector(0.5); }));
  falls<TypeParam>(sheet, start([&](const Vec3&) { return Vec3(random.uniform(0, 1), -0.3, random.uniform(0, 1)); }));
  falls<TypeParam>(sheet, start([](const Vec3&) { return Vec3(0.5, -0.5, 0.2); }));
  Points<double> two = sheet.x;
  two.row(54) = two.row(55);
  falls<TypeParam>(sheet, two);
}

TYPED_TEST(Implicitly, SolvesAChainOfMassesFromATenThousandthToOne) {
  using S = TypeParam;
  const int n = 20;
  Points<double> x = Points<double>::Zero(n, 3);
  Values<double> mass(n);
  SpringNetwork network;
  for (int i = 0; i < n; ++i) x(i, 0) = 0.1 * i, mass[i] = i % 2 ? 1e-4 : 1;
  for (int i = 0; i + 1 < n; ++i) network.springs.push_back({i, i + 1, 1e4, 0, Spring::kFromStart});
  auto body =
      with_springs<S>(points<S>(x, Points<double>::Zero(n, 3), mass), network, x, motion(implicit_euler(), kFrame));
  body->pin(0);
  for (int step = 0; step < 300; ++step) {
    const StepReport report = body->advance({kFrame * step, kFrame * (step + 1), {0, -9.81, 0}, {}});
    ASSERT_TRUE(report.good()) << report.text() << " at step " << step;
  }
  // As long as its tension by the weight below makes it, within what still swings.
  const double length = (body->positions().row(n - 1) - body->positions().row(0)).matrix().norm();
  EXPECT_GT(length, 1.9);
  EXPECT_LT(length, 2.2);
}

// A cube of 4³ points on a floor, with gravity turned by a slope.
template <class S>
struct Cube {
  Cube(const Method& method, double dt, double slope, double friction)
      : world(std::round(1 / std::max(dt, 1.0 / 240))) {
    const int n = 4;
    Points<double> x(n * n * n, 3);
    SpringNetwork network;
    for (int i = 0; i < n * n * n; ++i) x.row(i) << 0.05 * (i / 16), 0.05 * (i / 4 % 4), 0.05 * (i % 4);
    for (int i = 0; i < n * n * n; ++i)
      for (int j = i + 1; j < n * n * n; ++j)
        if ((x.row(i) - x.row(j)).abs().maxCoeff() < 0.051)
          network.springs.push_back({i, j, 200, 0.2, Spring::kFromStart});
    auto made = with_springs<S>(points<S>(x, Points<double>::Zero(64, 3), Values<double>::Constant(64, 1.0 / 64)),
                                network, x, motion(method, dt));
    body = &world.add(std::move(made));
    const double angle = std::atan(slope);
    world.set_gravity({9.81 * std::sin(angle), -9.81 * std::cos(angle), 0});
    Collider floor;
    floor.shapes = {HalfSpace{{0, 1, 0}, 0}};
    floor.friction = friction;
    world.add_collider(floor);
  }
  void go(double seconds) {
    for (int i = 0; i < int(60 * seconds); ++i) {
      const StepReport report = world.update(kFrame);
      ASSERT_TRUE(report.good()) << report.text();
    }
  }
  double height() const { return body->positions().col(1).mean(); }
  World world;
  PointBody<S>* body;
};

// Without friction, which would hold any of many shapes.
TYPED_TEST(Implicitly, SagsOnAFloorAsVelocityVerletDoesAndStaysThere) {
  Cube<double> other(velocity_verlet(), 1.0 / 3840, 0, 0);
  other.go(4);
  const double sag = 0.075 - other.height();
  ASSERT_GT(sag, 2e-4);
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    SCOPED_TRACE(dt);
    Cube<TypeParam> cube(implicit_euler(), dt, 0, 0);
    cube.go(4);
    EXPECT_NEAR(0.075 - cube.height(), sag, 0.01 * sag);
    const Points<double> before = cube.body->positions();
    cube.go(1);
    EXPECT_LT((cube.body->positions() - before).abs().maxCoeff(), 10 * kUnit<TypeParam>);
    EXPECT_LT(cube.body->velocities().abs().maxCoeff(), 1e3 * kUnit<TypeParam>);
  }
}

TYPED_TEST(Implicitly, SticksOnASlopeThatFrictionHoldsAndSlidesOnASteeperOne) {
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    SCOPED_TRACE(dt);
    Cube<TypeParam> still(implicit_euler(), dt, 0.4, 0.5);
    still.go(6);
    const Points<double> before = still.body->positions();
    still.go(10);
    EXPECT_LT((still.body->positions() - before).abs().maxCoeff(), std::max(100 * kUnit<TypeParam>, 1e-8));

    Cube<TypeParam> slides(implicit_euler(), dt, 0.8, 0.5);
    slides.go(1);
    const double speed = slides.body->velocities().col(0).mean();
    const double angle = std::atan(0.8);
    EXPECT_NEAR(speed, 9.81 * (std::sin(angle) - 0.5 * std::cos(angle)), 0.1);
  }
}

}  // namespace
}  // namespace hooke::test
