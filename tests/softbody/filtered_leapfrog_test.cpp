// Filtered leapfrog against velocity Verlet with small steps, against dense algebra, and against what
// leapfrog with another inertia must keep.
#include "core/problems.hpp"
#include "softbody/sheet.hpp"

#include <hooke/softbody/filtered_grid.hpp>
#include <hooke/softbody/soft_body.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <Eigen/Cholesky>

namespace hooke::test {
namespace {

using namespace softbody;

using test::sheet;

const Vec3 kGravity{0, -9.81, 0};

template <class S>
constexpr Precision kPrecision = std::is_same_v<S, float> ? Precision::Float : Precision::Double;

SoftBodySettings filtered(SoftBodySettings settings, double dt) {
  settings.motion.method = &filtered_leapfrog();
  settings.motion.dt = dt;
  return settings;
}

struct Play {
  std::unique_ptr<Body> body;
  double time = 0;

  explicit Play(const SoftBodySettings& settings) : body(make_soft_body(settings)) {}
  StepReport tick(double seconds, const Vec3& gravity = kGravity, std::span<const Collider> colliders = {}) {
    body->begin_frame(seconds, 0, time, time + seconds);
    StepReport report = body->advance({time, time + seconds, gravity, colliders});
    time += seconds;
    return report;
  }
  void ticks(int count, double seconds, const Vec3& gravity = kGravity) {
    for (int i = 0; i < count; ++i) {
      const StepReport report = tick(seconds, gravity);
      ASSERT_TRUE(report.good()) << report.text();
    }
  }
};

double rms(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().rowwise().sum().mean());
}

// Half a second of the sheet, velocity Verlet at 0.45 of the automatic step: below 1e-6 m from the limit.
Points<double> fine(const SoftBodySettings& settings) {
  SoftBodySettings verlet = settings;
  const double n = std::sqrt(double(settings.masses.size()));
  verlet.motion.dt = 0.4 * 2 / std::sqrt((4 * 500 + 8 * 100 + 4 * 5) * n * n / 0.3);
  Play run(verlet);
  run.ticks(10, 0.05);
  return run.body->positions();
}

template <class S>
class Filtered : public ::testing::Test {};
TYPED_TEST_SUITE(Filtered, Scalars);

TYPED_TEST(Filtered, HangsWithinItsExpectedErrorAtAnyResolution) {
  for (const int n : {32, 64}) {
    SCOPED_TRACE(n);
    SoftBodySettings settings = sheet(n);
    const Points<double> exact = fine(settings);
    settings.precision = kPrecision<TypeParam>;
    for (const double dt : {1.0 / 128, 1.0 / 320, 1.0 / 500}) {
      Play run(filtered(settings, dt));
      run.ticks(int(std::lround(0.5 / dt)), dt);
      const FilteredFacts facts = *filtered_facts(*run.body);
      ASSERT_TRUE(facts.filtered);
      const double error = rms(run.body->positions(), exact);
      EXPECT_LT(error, 1.15 * facts.expected_error);
      EXPECT_GT(error, 0.8 * facts.expected_error);
    }
  }
}

TYPED_TEST(Filtered, NeedsNoMoreStepsForMorePoints) {
  // At four times the points, the same step and error.
  double errors[2];
  int i = 0;
  for (const int n : {32, 64}) {
    SoftBodySettings settings = sheet(n);
    const Points<double> exact = fine(settings);
    settings.precision = kPrecision<TypeParam>;
    Play run(filtered(settings, 1.0 / 320));
    run.ticks(160, 1.0 / 320);
    errors[i++] = rms(run.body->positions(), exact);
  }
  EXPECT_LT(errors[1], 1.05 * errors[0]);
}

TEST(FilteredLeapfrog, ErrorFallsWithTheStepToTheLimitOfLeapfrog) {
  const SoftBodySettings settings = sheet(32);
  const Points<double> exact = fine(settings);
  double last = 1;
  for (const double dt : {8e-3, 4e-3, 2e-3, 1e-3}) {
    Play run(filtered(settings, dt * (1 + 1e-9)));
    run.ticks(5, 0.1);
    ASSERT_TRUE(filtered_facts(*run.body)->filtered);
    const double error = rms(run.body->positions(), exact);
    EXPECT_LT(error, last / 2);
    last = error;
  }
  Play plain(filtered(settings, 5e-4));
  plain.ticks(5, 0.1);
  EXPECT_FALSE(filtered_facts(*plain.body)->filtered);
  EXPECT_LT(rms(plain.body->positions(), exact), 1e-5);
}

TYPED_TEST(Filtered, IsVelocityVerletBelowItsLimit) {
  using S = TypeParam;
  SoftBodySettings settings = sheet(16);
  for (Spring& spring : const_cast<SpringNetwork&>(*settings.network).springs) spring.damping = 1e-3;
  settings.linear_drag = 1e-4;
  settings.precision = kPrecision<S>;
  settings.motion.dt = 5e-4;
  Play verlet(settings), own(filtered(settings, 5e-4));
  verlet.ticks(20, 5e-3), own.ticks(20, 5e-3);
  EXPECT_FALSE(filtered_facts(*own.body)->filtered);
  EXPECT_LT(rms(own.body->positions(), verlet.body->positions()), 2e3 * kUnit<S>);
  EXPECT_LT(rms(own.body->velocities(), verlet.body->velocities()), 2e5 * kUnit<S>);
}

// Cloth with its light border, held in its first row and elsewhere, with points of odd mass.
SoftBodySettings odd_cloth() {
  ClothMaterial material;
  material.damping_ratio = {0, 0, 0};
  SoftBodySettings settings = settings_of(cloth_from_grid(1, 1.3, 11, 13, {1, 0.2, 0}, {0, -1, 0.3}, material));
  settings.precision = Precision::Double;
  return settings;
}

// The inertia that the body must have: unit (Py ⊗ Px) + odd masses, at free points.
Eigen::MatrixXd inertia(const SoftBodySettings& settings, const std::vector<bool>& held, double a_x, double a_y) {
  const SpringGrid grid = SpringGrid::of(*settings.network, settings.masses.size());
  const MassModel model(grid, settings.masses);
  std::vector<bool> rows(std::size_t(grid.rows), true), columns(std::size_t(grid.columns), true);
  const Index n = settings.masses.size();
  for (Index i = 0; i < n; ++i)
    if (!held[std::size_t(i)]) rows[std::size_t(i / grid.columns)] = columns[std::size_t(i % grid.columns)] = false;
  const auto dense = [](const Values<double>& mass, const std::vector<bool>& is_held, double a) {
    // Held places leave K, which is squared afterwards.
    const Index size = mass.size();
    Eigen::MatrixXd k = Eigen::MatrixXd::Zero(size, size);
    for (Index i = 0; i < size; ++i)
      for (const Index j : {i - 1, i + 1})
        if (j >= 0 && j < size) k(i, i) += 1, k(i, j) -= 1;
    for (Index i = 0; i < size; ++i)
      if (is_held[std::size_t(i)]) k.row(i).setZero(), k.col(i).setZero();
    Eigen::MatrixXd out = a * a * k.transpose() * mass.inverse().matrix().asDiagonal() * k;
    out.diagonal() += mass.matrix();
    return out;
  };
  const Eigen::MatrixXd px = dense(model.column, columns, a_x), py = dense(model.row, rows, a_y);
  Eigen::MatrixXd out(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      out(i, j) = model.unit * py(i / grid.columns, j / grid.columns) * px(i % grid.columns, j % grid.columns);
  for (Index i = 0; i < n; ++i)
    out(i, i) += settings.masses[i] - model.unit * model.row[i / grid.columns] * model.column[i % grid.columns];
  return out;
}

TEST(FilteredLeapfrog, KickIsTheForceOverTheModifiedInertia) {
  // Springs far from their rest length, and all of them near it, where their forces are a series.
  for (int i = 0; i < 8; ++i) {
    const int variant = i % 4;
    const double displacement = i < 4 ? 0.02 : 0.001;
    SCOPED_TRACE(i);
    SoftBodySettings settings = odd_cloth();
    const Index n = settings.masses.size(), columns = 11;
    std::vector<bool> held(std::size_t(n), false);
    const auto hold = [&](Index p) {
      if (!held[std::size_t(p)]) settings.pins.push_back(p);
      held[std::size_t(p)] = true;
    };
    if (variant & 1)
      for (Index c = 0; c < columns; ++c) hold(c);
    if (variant == 1)
      for (Index r = 0; r < 13; ++r) hold(r * columns + 10);
    if (variant & 2) {
      hold(5 * columns + 4), hold(5 * columns + 5), hold(n - 1);
      settings.masses[3 * columns + 3] *= 300, settings.masses[8 * columns] *= 2;
    }
    Random random;
    SCOPED_TRACE(random.trace());
    Play run(filtered(settings, 0.01));
    for (Index p = 0; p < n; ++p)
      if (!held[std::size_t(p)]) run.body->set_position(p, row(settings.positions, p) + random.vector(displacement));
    const Points<double> start = run.body->positions();
    ASSERT_TRUE(run.tick(0.01).good());
    // Half a kick from rest, then a drift.
    const Points<double> kick = (run.body->positions() - start) / (0.5 * 0.01);

    const double share = 0.55 * 1e-4 / 4, dx = 0.1, dy = 1.3 / 12;
    const double diagonal = 100 * (dx * dx + dy * dy) / (2 * dx * dy), unit = 0.25 * dx * dy;
    const double a_x = share * ((1000 + 4 * 5 / 2.0) * dy / dx + 2 * diagonal) / unit;
    const double a_y = share * ((1000 + 4 * 5 / 2.0) * dx / dy + 2 * diagonal) / unit;
    Points<double> force = Points<double>::Zero(n, 3);
    SpringField<double>(settings.network, settings.positions).add_force(start, force, 0, force);
    for (Index p = 0; p < n; ++p) force.row(p) += settings.masses[p] * kGravity.transpose().array();
    Eigen::MatrixXd matrix = inertia(settings, held, a_x, a_y);
    for (Index p = 0; p < n; ++p)
      if (held[std::size_t(p)]) matrix.row(p).setZero(), matrix.col(p).setZero(), matrix(p, p) = 1, force.row(p) = 0;
    const Eigen::MatrixXd known = 0.01 * matrix.llt().solve(force.matrix());
    EXPECT_LT((kick.matrix() - known).cwiseAbs().maxCoeff(), 1e-7 * known.cwiseAbs().maxCoeff());
    for (Index p = 0; p < n; ++p)
      if (held[std::size_t(p)]) {
        EXPECT_TRUE((run.body->positions().row(p) == start.row(p)).all());
        EXPECT_EQ(run.body->speed(p), 0);
      }
  }
}

TEST(FilteredLeapfrog, KeepsItsEnergy) {
  const SoftBodySettings settings = sheet(24);
  Play run(filtered(settings, 5e-3));
  const double start = filtered_energy(*run.body, kGravity);
  double physical = 0, worst = 0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_TRUE(run.tick(5e-3).good());
    const double error = std::abs(filtered_energy(*run.body, kGravity) - start);
    physical = std::max(physical, std::abs(run.body->energy(kGravity).total() - start));
    worst = std::max(worst, error);
  }
  ASSERT_TRUE(filtered_facts(*run.body)->filtered);
  const double released = 0.3 * 9.81 * 0.5 / std::sqrt(2.0);
  EXPECT_LT(worst, 2e-3 * released);
  EXPECT_GT(physical, 10 * worst);  // the physical energy is not what it keeps
}

TEST(FilteredLeapfrog, RunsBackwards) {
  SoftBodySettings settings = sheet(20);
  settings.pins.push_back(20 * 19);
  settings.masses[399] *= 50;
  Play run(filtered(settings, 5e-3));
  run.ticks(40, 5e-3);
  const Points<double> v = run.body->velocities();
  EXPECT_GT(rms(run.body->positions(), settings.positions), 0.05);
  for (Index i = 0; i < v.rows(); ++i) run.body->set_velocity(i, -row(v, i));
  run.ticks(40, 5e-3);
  EXPECT_LT(rms(run.body->positions(), settings.positions), 1e-9);
}

TYPED_TEST(Filtered, StaysBitwiseAtRest) {
  SoftBodySettings settings = filtered(sheet(33), 5e-3);
  settings.precision = kPrecision<TypeParam>;
  settings.origin = {1000, 3, 0};
  settings.pins.push_back(500);
  settings.masses[600] *= 7;
  Play run(settings);
  const Points<double> start = run.body->positions();
  run.ticks(20, 1e-2, Vec3::Zero());
  EXPECT_TRUE((run.body->positions() == start).all());
  EXPECT_TRUE((run.body->velocities() == 0).all());
}

TYPED_TEST(Filtered, HoldsAHeavyCorner) {
  const int n = 32;
  SoftBodySettings settings = sheet(n);
  settings.precision = kPrecision<TypeParam>;
  settings.masses[n * n - 1] *= 300 * n;  // 2.8 kg on a sheet of 0.3 kg
  Play run(filtered(settings, 1.0 / 240));
  const double start = filtered_energy(*run.body, kGravity);
  for (int i = 0; i < 480; ++i) {
    ASSERT_TRUE(run.tick(1.0 / 240).good());
    ASSERT_LT(run.body->positions().abs().maxCoeff(), 3);
  }
  EXPECT_NEAR(filtered_energy(*run.body, kGravity), start, 0.02);  // of the 28 J that its fall exchanges
}

TYPED_TEST(Filtered, ShrugsOffTicksAndPushes) {
  // A push of the whole weight holds a free sheet in the air, whatever the ticks.
  SoftBodySettings settings = sheet(20);
  settings.precision = kPrecision<TypeParam>;
  settings.pins.clear();
  Play run(filtered(settings, 2e-3));
  for (int i = 0; i < 20; ++i) {
    for (Index p = 0; p < 400; ++p) run.body->add_force(p, -settings.masses[p] * kGravity);
    ASSERT_TRUE(run.tick(i % 2 ? 4e-3 : 6e-3).good());
    run.body->clear_forces();
  }
  EXPECT_LT(rms(run.body->positions(), settings.positions), 1e3 * kUnit<TypeParam>);
}

TEST(FilteredLeapfrog, FallsAlikeInALiftAndOnEarth) {
  // Pins that accelerate upward are the same as more gravity.
  for (const bool corners : {false, true}) {
    SCOPED_TRACE(corners);
    SoftBodySettings settings = filtered(sheet(24), 4e-3);
    if (corners) settings.pins = {0, 11, 23};
    const double lift = 5;
    Play still(settings), driven(settings);
    const Points<double> start = settings.positions;
    driven.body->drive_pins(settings.pins, [&](double t, Points<double>& places) {
      for (std::size_t i = 0; i < settings.pins.size(); ++i)
        places.row(Index(i)) = start.row(settings.pins[i]) + Eigen::Array<double, 1, 3>(0, 0.5 * lift * t * t, 0);
    });
    still.ticks(25, 8e-3, kGravity - Vec3(0, lift, 0)), driven.ticks(25, 8e-3);
    Points<double> lifted = still.body->positions();
    lifted.col(1) += 0.5 * lift * 0.2 * 0.2;
    EXPECT_LT(rms(driven.body->positions(), lifted), 1e-8);
    for (const Index pin : settings.pins)
      EXPECT_NEAR(driven.body->positions()(pin, 1), start(pin, 1) + 0.5 * lift * 0.04, 1e-12);
  }
}

TYPED_TEST(Filtered, RestsOnASphere) {
  const int n = 32;
  ClothMaterial material;
  SoftBodySettings settings = settings_of(cloth_from_grid(1, 1, n, n, {1, 0, 0}, {0, 0, 1}, material));
  settings.precision = kPrecision<TypeParam>;
  settings.origin = {0, 0.35, -0.5};
  settings.linear_drag = 1e-4;
  settings = filtered(settings, 1.0 / 480);
  const std::vector<Collider> ball{{"ball", {Sphere{{0, 0, 0}, 0.3}}, {}, {}, 0.5, 0},
                                   {"floor", {HalfSpace{{0, 1, 0}, -0.4}}, {}, {}, 0.5, 0}};
  Play run(settings);
  double deepest = 0;
  for (int i = 0; i < 720; ++i) {
    const StepReport report = run.tick(1.0 / 240, kGravity, ball);
    ASSERT_TRUE(report.good()) << report.text();
    const Points<double> x = run.body->positions();
    deepest = std::max({deepest, 0.3 - std::sqrt(x.square().rowwise().sum().minCoeff()), -0.4 - x.col(1).minCoeff()});
    ASSERT_LT(run.body->velocities().abs().maxCoeff(), 20);
  }
  EXPECT_LT(deepest, 0.02);
  EXPECT_GT(deepest, 0);
  // It drapes: something lies on the ball, and nothing went through it.
  EXPECT_GT(run.body->positions().col(1).maxCoeff(), 0.28);
}

TYPED_TEST(Filtered, KeepsTheFilterWhereSpringsAreAdded) {
  using S = TypeParam;
  SoftBodySettings settings = filtered(sheet(24), 5e-3);
  settings.precision = kPrecision<S>;
  Play alone(settings), more(settings);
  auto& body = dynamic_cast<PointBody<S>&>(*more.body);
  const SoftBodySettings faint = sheet(24, true, 1e-9);
  body.add_field(std::make_unique<SpringField<S>>(faint.network, body.state().position));
  alone.ticks(10, 1e-2), more.ticks(10, 1e-2);
  EXPECT_LT(rms(more.body->positions(), alone.body->positions()), 1e-6);
  EXPECT_GT(rms(more.body->positions(), settings.positions), 1e-2);
}

TEST(FilteredLeapfrog, TellsWhatAWantedErrorChanges) {
  SoftBodySettings settings = filtered(sheet(64, true, 1000), 0);
  settings.wanted_error = 1e-2;
  Play run(settings);
  const FilteredFacts facts = *filtered_facts(*run.body);
  EXPECT_LT(facts.stiffness_scale, 0.01);
  EXPECT_NEAR(facts.expected_error, 1e-2, 1e-4);
  EXPECT_NE(facts.text().find("stiffness lowered"), std::string::npos);
  SoftBodySettings stiff = sheet(64);
  stiff.motion.dt = 0;
  const Points<double> exact = fine(sheet(64));  // of the soft one
  Play soft([&] {
    SoftBodySettings s = filtered(sheet(64), 0);
    s.wanted_error = 1e-2;
    return s;
  }());
  soft.ticks(100, 5e-3);
  EXPECT_LT(rms(soft.body->positions(), exact), 1.2e-2);
  // Without a wanted error nothing is lowered.
  Play kept(filtered(sheet(64, true, 1000), 0));
  EXPECT_EQ(filtered_facts(*kept.body)->stiffness_scale, 1);
  EXPECT_NEAR(filtered_facts(*kept.body)->expected_error, 1e-2, 1e-6);
}

TEST(FilteredLeapfrog, WarnsWhereTheMotionFreezes) {
  Play coarse(filtered(sheet(32), 1.0 / 40)), fine(filtered(sheet(32), 1.0 / 80));
  coarse.tick(1.0 / 40), fine.tick(1.0 / 40);
  EXPECT_TRUE(filtered_facts(*coarse.body)->freezes());
  EXPECT_NE(filtered_facts(*coarse.body)->text().find("freezes"), std::string::npos);
  EXPECT_FALSE(filtered_facts(*fine.body)->freezes());
}

template <class Work>
std::string complaint(const Work& work) {
  try {
    work();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(FilteredLeapfrog, RefusesWhatIsNoGrid) {
  SoftBodySettings settings = filtered(sheet(8), 0);
  auto network = std::make_shared<SpringNetwork>(*settings.network);
  network->springs.push_back({3, 40, 5, 0});
  settings.network = network;
  EXPECT_NE(complaint([&] { make_soft_body(settings); }).find("body \"soft body\": filtered-leapfrog needs a grid"),
            std::string::npos);
  settings.network = nullptr;
  EXPECT_NE(complaint([&] { make_soft_body(settings); }).find("needs springs"), std::string::npos);
  settings = filtered(sheet(8), 1e-3);
  settings.wanted_error = 1e-3;
  EXPECT_NE(complaint([&] { make_soft_body(settings); }).find("not both"), std::string::npos);
  settings.motion.method = &velocity_verlet();
  EXPECT_NE(complaint([&] { make_soft_body(settings); }).find("only filtered-leapfrog"), std::string::npos);
  EXPECT_FALSE(filtered_facts(*make_soft_body(sheet(8))));
}

}  // namespace
}  // namespace hooke::test
