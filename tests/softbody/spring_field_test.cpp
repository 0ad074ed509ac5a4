// The force of springs against its own potential, derivatives, orders of summation and bounds.
#include "core/problems.hpp"

#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <Eigen/Eigenvalues>
#include <numeric>

namespace hooke::test {
namespace {

using softbody::Family;
using softbody::Spring;
using softbody::SpringField;
using softbody::SpringNetwork;

template <class S>
SpringField<S> field_of(SpringNetwork network, const Points<S>& start) {
  return SpringField<S>(std::make_shared<const SpringNetwork>(std::move(network)), start);
}

SpringNetwork random_network(Random& random, int n, int springs, bool damped = false) {
  SpringNetwork network;
  for (int i = 0; i < springs; ++i) {
    const int a = random.below(n), b = (a + 1 + random.below(n - 1)) % n;
    network.springs.push_back(
        {a, b, random.uniform(1, 500), damped ? random.uniform(0, 3) : 0, random.uniform(0, 1.5)});
  }
  return network;
}

template <class S>
Points<S> force(const SpringField<S>& field, const Points<S>& x, const Points<S>& v) {
  Points<S> f = Points<S>::Zero(x.rows(), 3);
  field.add_force(x, v, 0, f);
  return f;
}

Points<double> none(Index n) { return Points<double>::Zero(n, 3); }

// Column by column, the matrix that `apply` multiplies with. Coordinates are (n, 3) by columns.
template <class Apply>
Eigen::MatrixXd matrix_of(Index n, Apply apply) {
  Eigen::MatrixXd out(3 * n, 3 * n);
  for (Index j = 0; j < 3 * n; ++j) {
    Points<double> d = none(n), column = none(n);
    d.data()[j] = 1;
    apply(d, column);
    out.col(j) = Eigen::Map<Eigen::VectorXd>(column.data(), 3 * n);
  }
  return out;
}

TEST(SpringField, PullsAsHookeSays) {
  SpringNetwork network;
  network.springs.push_back({0, 1, 100, 2, 1, Family::Raw});
  const Points<double> x = rows({{0, 0, 0}, {0, 1.5, 0}}), v = rows({{0, 0, 0}, {4, 0.3, 0}});
  const auto f = force(field_of(network, x), x, v);
  EXPECT_NEAR(f(0, 1), 100 * 0.5 + 2 * 0.3, 1e-12);  // only what is along it damps
  EXPECT_EQ(f(0, 0), 0);
  EXPECT_EQ(row(f, 0), -row(f, 1));
  EXPECT_NEAR(field_of(network, x).potential_energy(x), 0.5 * 100 * 0.25, 1e-12);
}

TEST(SpringField, IsMinusTheSlopeOfItsPotential) {
  Random random;
  SCOPED_TRACE(random.trace());
  const Index n = 12;
  const Points<double> x = random.points(n, 1);
  const auto field = field_of(random_network(random, n, 50), x);
  const auto f = force(field, x, none(n));
  const double step = 1e-6;
  for (Index j = 0; j < 3 * n; ++j) {
    Points<double> up = x, down = x;
    up.data()[j] += step, down.data()[j] -= step;
    const double slope = (field.potential_energy(up) - field.potential_energy(down)) / (2 * step);
    EXPECT_NEAR(f.data()[j], -slope, 1e-6 * f.abs().maxCoeff());
  }
}

TEST(SpringField, StiffnessIsTheSlopeOfTheForceAndTheSafeOneIsPositive) {
  Random random;
  SCOPED_TRACE(random.trace());
  const Index n = 10;
  const Points<double> x = random.points(n, 1), v = random.points(n, 1);
  SpringNetwork network = random_network(random, n, 40, true);
  network.springs.push_back({0, 1, 500, 1, 10});  // compressed for certain
  const auto field = field_of(network, x);
  const double step = 1e-6;
  const auto differences = matrix_of(n, [&](const Points<double>& d, Points<double>& out) {
    out = (force(field, Points<double>(x - step * d), none(n)) - force(field, Points<double>(x + step * d), none(n))) /
          (2 * step);
  });
  const auto exact = matrix_of(n, [&](const auto& d, auto& out) { field.add_stiffness_times(x, d, false, out); });
  const auto safe = matrix_of(n, [&](const auto& d, auto& out) { field.add_stiffness_times(x, d, true, out); });
  const double scale = exact.cwiseAbs().maxCoeff();
  EXPECT_LT((exact - differences).cwiseAbs().maxCoeff(), 1e-6 * scale);
  EXPECT_LT((exact - exact.transpose()).cwiseAbs().maxCoeff(), 1e-12 * scale);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> of_exact(exact), of_safe(safe);
  EXPECT_LT(of_exact.eigenvalues()[0], -1e-3 * scale) << "no spring was compressed: the test shows nothing";
  EXPECT_GT(of_safe.eigenvalues()[0], -1e-10 * scale);

  const auto damping_differences = matrix_of(n, [&](const Points<double>& d, Points<double>& out) {
    out = (force(field, x, Points<double>(v - step * d)) - force(field, x, Points<double>(v + step * d))) / (2 * step);
  });
  const auto damping = matrix_of(n, [&](const auto& d, auto& out) { field.add_damping_times(x, v, d, out); });
  EXPECT_LT((damping - damping_differences).cwiseAbs().maxCoeff(), 1e-6 * damping.cwiseAbs().maxCoeff());
}

template <class S>
class Springs : public ::testing::Test {};
TYPED_TEST_SUITE(Springs, Scalars);

TYPED_TEST(Springs, PullTheSameInRunsAndShuffled) {
  using S = TypeParam;
  Random random;
  SCOPED_TRACE(random.trace());
  const auto cloth = softbody::cloth_from_grid(1, 1, 23, 31, Vec3::UnitX(), Vec3::UnitY(), {});
  const Index n = cloth.positions.rows();
  const Points<S> start = cloth.positions.template cast<S>();
  const Points<S> x = start + random.points(n, 0.01).template cast<S>(), v = random.points(n, 1).template cast<S>();
  // Relabelled at random: no two consecutive springs join consecutive points any more.
  std::vector<int> label(static_cast<std::size_t>(n));
  std::iota(label.begin(), label.end(), 0);
  for (std::size_t i = label.size(); i-- > 1;) std::swap(label[i], label[std::size_t(random.below(int(i) + 1))]);
  SpringNetwork relabelled = *cloth.network;
  for (Spring& spring : relabelled.springs)
    spring.a = label[std::size_t(spring.a)], spring.b = label[std::size_t(spring.b)];
  Points<S> start2(n, 3), x2(n, 3), v2(n, 3);
  for (Index i = 0; i < n; ++i) {
    const Index j = label[std::size_t(i)];
    start2.row(j) = start.row(i), x2.row(j) = x.row(i), v2.row(j) = v.row(i);
  }
  const Points<S> one = force(SpringField<S>(cloth.network, start), x, v);
  const Points<S> two = force(field_of<S>(relabelled, start2), x2, v2);
  Points<S> naive = Points<S>::Zero(n, 3);
  for (const Spring& s : cloth.network->springs) {
    const Vec3 d = (x.row(s.b) - x.row(s.a)).matrix().transpose().template cast<double>();
    const Vec3 rest = (start.row(s.b) - start.row(s.a)).matrix().transpose().template cast<double>();
    const Vec3 u = (v.row(s.b) - v.row(s.a)).matrix().transpose().template cast<double>();
    const Vec3 pull = (s.stiffness * (d.norm() - rest.norm()) + s.damping * u.dot(d) / d.norm()) * d / d.norm();
    naive.row(s.a) += pull.transpose().array().template cast<S>(),
        naive.row(s.b) -= pull.transpose().array().template cast<S>();
  }
  const double tolerance = 200 * kUnit<S> * double(one.abs().maxCoeff()) + (std::is_same_v<S, float> ? 1e-3 : 0);
  for (Index i = 0; i < n; ++i) {
    EXPECT_LT(double((one.row(i) - two.row(label[std::size_t(i)])).abs().maxCoeff()), tolerance);
    EXPECT_LT(double((one.row(i) - naive.row(i)).abs().maxCoeff()), tolerance);
  }
}

TYPED_TEST(Springs, WithoutLengthPullNowhere) {
  using S = TypeParam;
  SpringNetwork network;
  network.springs = {{0, 1, 1e6, 5, 0}, {0, 1, 1e6, 5, 2}, {1, 2, 1e6, 5, 0}};
  const Points<S> x = Points<S>::Constant(3, 3, S(0.3)), v = Points<S>::Random(3, 3);
  const auto field = field_of<S>(network, x);
  EXPECT_TRUE((force(field, x, v) == S(0)).all());
  Points<S> d = Points<S>::Random(3, 3), out = Points<S>::Zero(3, 3);
  field.add_stiffness_times(x, d, true, out);
  field.add_damping_times(x, v, d, out);
  EXPECT_TRUE(out.allFinite());
  const auto rates = field.rate_bounds(x, v, Values<S>::Ones(3));
  EXPECT_TRUE(std::isfinite(rates.omega_squared) && std::isfinite(rates.gamma));
  // A zero rest length is an ordinary spring as soon as it has a length.
  Points<S> moved = x;
  moved(2, 0) += S(0.5);
  EXPECT_NEAR(force(field, moved, Points<S>(Points<S>::Zero(3, 3)))(2, 0), -5e5, 1);
}

TYPED_TEST(Springs, ThatCollapseIntoOnePointStayFinite) {
  using S = TypeParam;
  for (const Method* method : {&velocity_verlet(), &semi_implicit_euler(), &implicit_euler()}) {
    SCOPED_TRACE(method->name);
    auto cloth = softbody::cloth_from_grid(0.3, 0.3, 4, 4, Vec3::UnitX(), Vec3::UnitY(), {});
    const Points<S> start = cloth.positions.template cast<S>();
    auto body = body_of(points<S>(none(16), none(16), cloth.masses), motion(*method));
    body->add_field(std::make_unique<SpringField<S>>(cloth.network, start));
    for (int tick = 0; tick < 60; ++tick) {
      const StepReport report = body->advance({tick / 60.0, (tick + 1) / 60.0, {0, -9.81, 0}, {}});
      ASSERT_TRUE(report.good()) << report.text();
    }
  }
}

double true_largest(const SpringField<double>& field, const Points<double>& x, const Values<double>& w,
                    bool of_damping) {
  const Index n = x.rows();
  Eigen::MatrixXd k = matrix_of(n, [&](const auto& d, auto& out) {
    if (of_damping)
      field.add_damping_times(x, none(n), d, out);
    else
      field.add_stiffness_times(x, d, false, out);
  });
  Eigen::VectorXd root(3 * n);
  for (int c = 0; c < 3; ++c) root.segment(c * n, n) = w.sqrt().matrix();
  k = root.asDiagonal() * k * root.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly).eigenvalues()[3 * n - 1];
}

TEST(RateBounds, AreNeverBelowTheTruth) {
  Random random;
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const int n = 3 + random.below(14);
    const Points<double> x = random.points(n, round % 3 == 0 ? 5 : 0.7);  // stretched or compressed
    Values<double> w(n);
    for (int i = 0; i < n; ++i) w[i] = random.below(5) == 0 ? 0 : std::exp(random.uniform(-4, 4));
    const auto field = field_of(random_network(random, n, 2 + random.below(3 * n), true), x);
    const auto rates = field.rate_bounds(x, none(n), w);
    EXPECT_GE(rates.omega_squared * (1 + 1e-12) + 1e-9, true_largest(field, x, w, false));
    EXPECT_GE(rates.gamma * (1 + 1e-12) + 1e-9, true_largest(field, x, w, true));
  }
}

TEST(RateBounds, AreCloseForAFlatGrid) {
  softbody::ClothMaterial threads;
  threads.shear = 0, threads.bend = 0;
  // Border points are lighter, which the bound sees from every side at once.
  for (const auto& [material, share] : {std::pair{threads, 1.26}, {softbody::ClothMaterial{}, 1.31}}) {
    const auto cloth = softbody::cloth_from_grid(1, 1, 14, 14, Vec3::UnitX(), Vec3::UnitY(), material);
    const SpringField<double> field(cloth.network, cloth.positions);
    const Values<double> w = cloth.masses.inverse();
    const double truth = true_largest(field, cloth.positions, w, false);
    const double bound = field.rate_bounds(cloth.positions, none(cloth.positions.rows()), w).omega_squared;
    EXPECT_GE(bound, truth);
    EXPECT_LE(bound, share * truth);
  }
  // Equal masses and springs: nearly exact.
  const auto cloth = softbody::cloth_from_grid(1, 1, 14, 14, Vec3::UnitX(), Vec3::UnitY(), threads);
  SpringNetwork equal = *cloth.network;
  for (Spring& spring : equal.springs) spring.stiffness = 1;
  const auto field = field_of(equal, cloth.positions);
  const Values<double> w = Values<double>::Ones(cloth.positions.rows());
  EXPECT_LE(field.rate_bounds(cloth.positions, none(w.size()), w).omega_squared,
            1.05 * true_largest(field, cloth.positions, w, false));
}

TEST(SpringNetwork, RefusesBadSprings) {
  const auto refused = [](Spring spring) {
    SpringNetwork network;
    network.springs = {{0, 1, 1, 0, 1}, spring};
    EXPECT_THROW(network.check(3), std::invalid_argument);
  };
  refused({0, 3, 1, 0, 1});
  refused({-1, 1, 1, 0, 1});
  refused({1, 1, 1, 0, 1});
  refused({0, 1, -1, 0, 1});
  refused({0, 1, NAN, 0, 1});
  refused({0, 1, 1, -1, 1});
  refused({0, 1, 1, 0, -2});
  refused({0, 1, 1, 0, INFINITY});
  try {
    SpringNetwork network;
    network.springs = {{0, 1, 1, 0, 1}, {2, 7, 1, 0, 1}};
    network.check(3);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "spring 1: points must be in [0, 3), got 7");
  }
}

TEST(SpringNetwork, TellsRestLengthsAndStrains) {
  SpringNetwork network;
  network.springs = {{0, 1, 1, 0, Spring::kFromStart, Family::Stretch},
                     {1, 2, 1, 0, 4, Family::Bend},
                     {0, 2, 1, 0, 1, Family::Stretch}};
  const Points<double> x = rows({{0, 0, 0}, {2, 0, 0}, {2, 5, 0}});
  const auto rest = softbody::rest_lengths(network, x);
  EXPECT_EQ(rest[0], 2);
  EXPECT_EQ(rest[1], 4);
  const auto bend = softbody::strains(network, rest, Family::Bend, x, {false, false, false});
  ASSERT_EQ(bend.size(), 1u);
  EXPECT_NEAR(bend[0], 0.25, 1e-15);
  EXPECT_EQ(softbody::strains(network, rest, Family::Stretch, x, {true, true, false}).size(), 1u);
}

TEST(SpringNetwork, DampingOfRatioOneIsCritical) {
  // At critical damping two points come back without crossing; below it they cross.
  const auto crossings = [](double ratio) {
    const double k = 50, ma = 0.3, mb = 0.9;
    Values<double> mass(2);
    mass << ma, mb;
    auto body = body_of(points<double>(rows({{0, 0, 0}, {1.1, 0, 0}}), none(2), mass), motion(rk4(), 1e-3));
    SpringNetwork network;
    network.springs.push_back({0, 1, k, softbody::damping_of_ratio(ratio, k, ma, mb), 1});
    body->add_field(
        std::make_unique<SpringField<double>>(std::make_shared<const SpringNetwork>(network), body->state().position));
    int count = 0;
    double before = 0.1;
    for (int i = 0; i < 2000; ++i) {
      run(*body, 1e-3, 1);
      const double now = body->positions()(1, 0) - body->positions()(0, 0) - 1;
      count += now * before < 0;
      before = now;
    }
    // Closed form at ratio 1: d0 (1 + ωt) e^-ωt.
    if (ratio == 1) {
      const double omega = std::sqrt(k * (ma + mb) / (ma * mb));
      EXPECT_NEAR(before, 0.1 * (1 + 2 * omega) * std::exp(-2 * omega), 1e-11);
    }
    return count;
  };
  EXPECT_EQ(crossings(1), 0);
  EXPECT_GE(crossings(0.7), 1);
}

}  // namespace
}  // namespace hooke::test
