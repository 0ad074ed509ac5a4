// Lattices: a jelly weighs, yields and thins as its material says, at any resolution.
#include "core/problems.hpp"

#include <hooke/softbody/cell_volume_field.hpp>
#include <hooke/softbody/soft_body.hpp>
#include <hooke/softbody/spring_field.hpp>
#include <hooke/softbody/volume_field.hpp>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include <limits>
#include <map>

namespace hooke::test {
namespace {

using softbody::CellVolumeField;
using softbody::Family;
using softbody::FixedLatticeMaterial;
using softbody::Lattice;
using softbody::lattice_from_box;
using softbody::LatticeMaterial;
using softbody::SpringField;
using softbody::VolumeField;
using ::testing::HasSubstr;
using Count = std::array<int, 3>;

std::unique_ptr<PointBody<double>> settler(const Lattice& lattice) {
  const Index n = lattice.positions.rows();
  auto body = body_of(points<double>(lattice.positions, Points<double>::Zero(n, 3), lattice.masses),
                      motion(implicit_euler(), 1));
  body->add_field(std::make_unique<SpringField<double>>(lattice.network, lattice.positions));
  if (lattice.cell_stiffness > 0)
    body->add_field(
        std::make_unique<CellVolumeField<double>>(lattice.cell_stiffness, lattice.points, lattice.positions));
  return body;
}

double largest(const Points<double>& x) { return x.abs().maxCoeff(); }

TEST(Lattice, NumbersItsPointsWithXFastestAroundTheOrigin) {
  const Lattice lattice = lattice_from_box({2, 3, 4}, {3, 4, 5}, LatticeMaterial{});
  ASSERT_EQ(lattice.positions.rows(), 60);
  EXPECT_EQ(row(lattice.positions, 0), Vec3(-1, -1.5, -2));
  EXPECT_LT((row(lattice.positions, 1) - Vec3(0, -1.5, -2)).norm(), 1e-15);
  EXPECT_LT((row(lattice.positions, 3) - Vec3(-1, -0.5, -2)).norm(), 1e-15);
  EXPECT_LT((row(lattice.positions, 12) - Vec3(-1, -1.5, -1)).norm(), 1e-15);
  EXPECT_EQ(row(lattice.positions, 59), Vec3(1, 1.5, 2));
}

TEST(Lattice, IsTurnedAboutItsMiddle) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Lattice straight = lattice_from_box({2, 2, 4}, {3, 3, 5}, LatticeMaterial{});
  const Lattice turned = lattice_from_box({2, 2, 4}, {3, 3, 5}, LatticeMaterial{}, turn);
  EXPECT_LT(largest(turned.positions - (straight.positions.matrix() * turn.transpose()).array()), 1e-15);
}

TEST(Lattice, WeighsItsVolumeAtAnyResolution) {
  LatticeMaterial material;
  material.density = 1060;
  for (const int n : {2, 5, 11}) {
    const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {n, n, n}, material);
    EXPECT_NEAR(lattice.masses.sum(), 1.06, 1e-12) << n;
    EXPECT_NEAR(lattice.masses[0], 1.06 / std::pow(n - 1, 3) / 8, 1e-12) << n;
  }
}

TEST(Lattice, TheClassicalCubeHasEqualSpringsAndMasses) {
  const Lattice cube = lattice_from_box({0.2, 0.2, 0.2}, {10, 10, 10}, FixedLatticeMaterial{});
  EXPECT_TRUE((cube.masses == 1e-3).all());
  std::map<Family, int> count;
  for (const softbody::Spring& spring : cube.network->springs) {
    ++count[spring.family];
    EXPECT_EQ(spring.stiffness, 2000);
    EXPECT_EQ(spring.damping, softbody::damping_of_ratio(0.2, 2000, 1e-3, 1e-3));
  }
  EXPECT_EQ(count[Family::Stretch], 3 * 9 * 100);
  EXPECT_EQ(count[Family::Shear], 6 * 81 * 10);
  EXPECT_EQ(count[Family::Bend], 4 * 729);
}

TEST(Lattice, ItsSurfaceIsClosedFacesOutwardsAndHoldsTheVolume) {
  const Lattice lattice = lattice_from_box({0.1, 0.2, 0.3}, {3, 5, 7}, LatticeMaterial{});
  EXPECT_EQ(lattice.triangles.size(), 2 * 2 * std::size_t(2 * 4 + 4 * 6 + 6 * 2));
  const VolumeField<double> field(1, lattice.triangles, lattice.positions);  // refuses what is not closed
  EXPECT_NEAR(field.volume(lattice.positions), 0.006, 1e-12);
  for (const Triangle& t : lattice.triangles) {
    const Vec3 a = row(lattice.positions, t[0]), b = row(lattice.positions, t[1]), c = row(lattice.positions, t[2]);
    EXPECT_GT((b - a).cross(c - a).dot(a + b + c), 0);
  }
}

// The energy per volume of a small strain of the whole box against that of an isotropic body,
// λ/2 (tr ε)² + μ ε:ε.
TEST(Lattice, IsIsotropicInCellsThatAreNotQuiteCubes) {
  LatticeMaterial material;
  material.poisson_ratio = 0.25;
  const double shear = material.young / 2.5;
  for (const Vec3& size : {Vec3(0.1, 0.1, 0.1), Vec3(0.1, 0.11, 0.09)}) {
    const Lattice lattice = lattice_from_box(size, {4, 4, 4}, material);
    const SpringField<double> field(lattice.network, lattice.positions);
    Random random;
    SCOPED_TRACE(random.trace());
    for (int i = 0; i < 20; ++i) {
      Mat3 strain;
      for (int k = 0; k < 3; ++k) strain.col(k) = random.vector(1e-4);
      strain = (0.5 * (strain + strain.transpose())).eval();
      const Mat3 change = Mat3::Identity() + strain;
      const double energy = field.potential_energy((lattice.positions.matrix() * change).array()) / size.prod();
      const double expected = 0.5 * shear * strain.trace() * strain.trace() + shear * strain.squaredNorm();
      EXPECT_NEAR(energy, expected, 1e-3 * expected) << strain;
    }
  }
}

struct Stretched {
  double force, thinning;  // [N], share of the width lost at the middle, positive
};

// A bar along x whose ends are pulled apart by `strain`, free to thin, settled.
Stretched stretched(const Vec3& size, const Count& count, const LatticeMaterial& material, double strain) {
  const Lattice lattice = lattice_from_box(size, count, material);
  auto body = settler(lattice);
  // Ends slide in y and z: each is held in x by a stiff spring a point to a plane, so that only pins are needed.
  struct Ends final : ForceField<double> {
    Points<double> start;
    double half, shift, stiffness;
    bool uses_velocity() const override { return false; }
    double at(const Points<double>& x, Index i) const {
      if (start(i, 0) < -0.999 * half) return x(i, 0) + half + shift;
      if (start(i, 0) > 0.999 * half) return x(i, 0) - half - shift;
      return 0;
    }
    void add_force(const Points<double>& x, const Points<double>&, double, Points<double>& f) const override {
      for (Index i = 0; i < x.rows(); ++i) f(i, 0) -= stiffness * at(x, i);
    }
    void add_stiffness_times(const Points<double>&, const Points<double>& d, bool, Points<double>& out) const override {
      for (Index i = 0; i < d.rows(); ++i)
        if (std::abs(start(i, 0)) > 0.999 * half) out(i, 0) += stiffness * d(i, 0);
    }
    double pull(const Points<double>& x) const {
      double sum = 0;
      for (Index i = 0; i < x.rows(); ++i)
        if (start(i, 0) > 0) sum -= stiffness * at(x, i);
      return sum;
    }
  };
  auto ends = std::make_unique<Ends>();
  const Ends* seen = ends.get();
  ends->start = lattice.positions;
  ends->half = size.x() / 2;
  ends->shift = strain * size.x() / 2;
  ends->stiffness = 100 * material.young * size.x();
  body->add_field(std::move(ends));
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(body->advance({double(i), i + 1.0, Vec3::Zero(), {}}).good());
  const Points<double> x = body->positions();
  EXPECT_LT(largest(body->velocities()), 1e-6);
  // Of the points of the middle cross-section's top and bottom.
  double top = 0, bottom = 0;
  int tops = 0;
  for (Index i = 0; i < x.rows(); ++i)
    if (std::abs(lattice.positions(i, 0)) < 1e-9 && std::abs(std::abs(lattice.positions(i, 1)) - size.y() / 2) < 1e-9) {
      (lattice.positions(i, 1) > 0 ? top : bottom) += x(i, 1);
      ++tops;
    }
  EXPECT_GT(tops, 0);
  return {seen->pull(x), 1 - 2 * (top - bottom) / tops / size.y()};
}

TEST(Lattice, AStretchedBarPullsByItsYoungsModulusAndThinsByAQuarter) {
  const Vec3 size{0.4, 0.1, 0.1};
  LatticeMaterial material;
  material.poisson_ratio = 0.25;
  const double strain = 0.01, expected = material.young * strain * size.y() * size.z();
  for (const int n : {2, 4}) {
    const Stretched bar = stretched(size, {4 * n + 1, n + 1, n + 1}, material, strain);
    EXPECT_NEAR(bar.force, expected, 0.02 * expected) << n;
    EXPECT_NEAR(bar.thinning, 0.25 * strain, 0.02 * 0.25 * strain) << n;
  }
}

TEST(Lattice, KeepsMoreOfItsVolumeWithALargerPoissonsRatio) {
  const Vec3 size{0.4, 0.1, 0.1};
  LatticeMaterial material;
  const double strain = 0.01, expected = material.young * strain * size.y() * size.z();
  for (const double ratio : {0.35, 0.45}) {
    material.poisson_ratio = ratio;
    for (const int n : {2, 4}) {
      const Stretched bar = stretched(size, {4 * n + 1, n + 1, n + 1}, material, strain);
      EXPECT_NEAR(bar.force, expected, 0.03 * expected) << n;
      EXPECT_NEAR(bar.thinning, ratio * strain, 0.03 * ratio * strain) << n;
    }
  }
}

TEST(Lattice, RefusesWhatCannotBe) {
  const auto told = [](auto make) -> std::string {
    try {
      make();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing";
  };
  LatticeMaterial thin, dense, hard;
  thin.poisson_ratio = 0.2, dense.density = -1, hard.poisson_ratio = 0.5;
  const Vec3 size{0.1, 0.1, 0.1};
  const Count count{3, 3, 3};
  EXPECT_THAT(told([&] {
                lattice_from_box({0.1, 0, 0.1}, count, LatticeMaterial{});
              }),
              HasSubstr("size must be positive"));
  EXPECT_THAT(told([&] {
                lattice_from_box(size, {3, 1, 3}, LatticeMaterial{});
              }),
              HasSubstr("2 x 2 x 2 points, got 3 x 1 x 3"));
  EXPECT_THAT(told([&] { lattice_from_box(size, {3, 3, 5}, LatticeMaterial{}); }), HasSubstr("nearly cubes, got 0.05"));
  EXPECT_THAT(told([&] { lattice_from_box(size, count, LatticeMaterial{}, 2 * Mat3::Identity()); }), HasSubstr("turn"));
  EXPECT_THAT(told([&] { lattice_from_box(size, count, thin); }), HasSubstr("poisson_ratio must be at least 0.25"));
  EXPECT_THAT(told([&] { lattice_from_box(size, count, hard); }), HasSubstr("below 0.5"));
  EXPECT_THAT(told([&] { lattice_from_box(size, count, dense); }), HasSubstr("density must be positive, got -1"));
}

template <class S>
struct VolumeTest : testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(VolumeTest, Scalars);

// A lattice pulled out of shape.
Points<double> crumpled(const Lattice& lattice, double by, Random& random) {
  return lattice.positions + random.points(lattice.positions.rows(), by);
}

// Both forces that keep volume, by what they are made of.
struct Whole {
  template <class S>
  static VolumeField<S> of(double stiffness, const Lattice& lattice) {
    return {stiffness, lattice.triangles, lattice.positions.cast<S>()};
  }
};
struct Cells {
  template <class S>
  static CellVolumeField<S> of(double stiffness, const Lattice& lattice) {
    return {stiffness, lattice.points, lattice.positions.cast<S>()};
  }
};
template <class Kind>
struct VolumeForce : testing::Test {};
using Kinds = testing::Types<Whole, Cells>;
TYPED_TEST_SUITE(VolumeForce, Kinds);

TYPED_TEST(VolumeTest, PullsNowhereAtTheStart) {
  using S = TypeParam;
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, LatticeMaterial{});
  const Points<S> x = lattice.positions.cast<S>();
  Points<S> f = Points<S>::Zero(x.rows(), 3);
  Whole::of<S>(1e5, lattice).add_force(x, f, 0, f);
  Cells::of<S>(1e5, lattice).add_force(x, f, 0, f);
  EXPECT_TRUE((f == S(0)).all());
}

TYPED_TEST(VolumeForce, ForceAndStiffnessAreDerivativesOfTheEnergy) {
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, LatticeMaterial{});
  const auto field = TypeParam::template of<double>(1e4, lattice);
  Random random;
  SCOPED_TRACE(random.trace());
  const Points<double> x = crumpled(lattice, 0.02, random), none = Points<double>::Zero(x.rows(), 3);
  const Points<double> d = random.points(x.rows(), 1);
  const double h = 1e-6;
  Points<double> f = none, ahead = none, behind = none, product = none;
  field.add_force(x, none, 0, f);
  field.add_force(x + h * d, none, 0, ahead);
  field.add_force(x - h * d, none, 0, behind);
  field.add_stiffness_times(x, d, false, product);
  const double slope = (field.potential_energy(x + h * d) - field.potential_energy(x - h * d)) / (2 * h);
  // The slope may be small by chance, its parts are not.
  EXPECT_NEAR((f * d).sum(), -slope, 1e-7 * (f * d).abs().sum());
  EXPECT_LT(largest(product - (behind - ahead) / (2 * h)), 1e-6 * largest(product));
}

TYPED_TEST(VolumeForce, ChangesNoMomentumAndNoAngularMomentum) {
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, LatticeMaterial{});
  Random random;
  SCOPED_TRACE(random.trace());
  const Points<double> x = crumpled(lattice, 0.02, random);
  Points<double> f = Points<double>::Zero(x.rows(), 3);
  TypeParam::template of<double>(1e4, lattice).add_force(x, f, 0, f);
  Vec3 torque = Vec3::Zero();
  for (Index i = 0; i < x.rows(); ++i) torque += row(x, i).cross(row(f, i));
  EXPECT_GT(largest(f), 1e-3);
  // The rounding of a point's forces, eight cells each, at arms of 0.1 m.
  const double rounding = 8 * double(x.rows()) * std::numeric_limits<double>::epsilon() * largest(f);
  EXPECT_LT(f.colwise().sum().abs().maxCoeff(), rounding);
  EXPECT_LT(torque.norm(), 0.1 * rounding);
}

// Against the largest eigenvalue of M⁻¹K, by power iteration on the shifted product.
TYPED_TEST(VolumeForce, RateBoundHoldsAndSafeStiffnessIsNeverNegative) {
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, LatticeMaterial{});
  const auto field = TypeParam::template of<double>(1e5, lattice);
  Random random;
  SCOPED_TRACE(random.trace());
  for (const double by : {0.0, 0.005, 0.03}) {
    const Points<double> x = crumpled(lattice, by, random), none = Points<double>::Zero(x.rows(), 3);
    const Values<double> w = lattice.masses.inverse();
    const double bound = field.rate_bounds(x, none, w).omega_squared;
    Points<double> d = random.points(x.rows(), 1);
    double found = 0;
    for (int i = 0; i < 300; ++i) {
      Points<double> safe = none, product = none;
      field.add_stiffness_times(x, d, true, safe);
      EXPECT_GE((safe * d).sum(), 0);
      field.add_stiffness_times(x, d, false, product);
      product.colwise() *= w;
      found = std::sqrt(product.square().sum() / d.square().sum());
      d = product / std::sqrt(product.square().sum());
    }
    EXPECT_GE(bound, found * (1 - 1e-9)) << by;
    if (by == 0) {
      EXPECT_NEAR(bound, found, (std::is_same_v<TypeParam, Whole> ? 1e-9 : 0.5) * bound);
    }
  }
}

TEST(Volume, RefusesASurfaceThatIsOpenOrInsideOut) {
  Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {3, 3, 3}, LatticeMaterial{});
  const auto told = [&](const std::vector<Triangle>& triangles) -> std::string {
    try {
      VolumeField<double>(1, triangles, lattice.positions);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing";
  };
  std::vector<Triangle> open = lattice.triangles, turned = lattice.triangles, wrong = lattice.triangles;
  open.pop_back();
  wrong[3][1] = 27;
  for (Triangle& t : turned) std::swap(t[0], t[1]);
  EXPECT_EQ(told(lattice.triangles), "nothing");
  EXPECT_THAT(told(open), HasSubstr("closed and face one way"));
  EXPECT_THAT(told(turned), HasSubstr("counter-clockwise from outside, got -0.001"));
  EXPECT_THAT(told(wrong), HasSubstr("triangle 3 uses point 27 of 27"));
}

// The springs of a cell rest in the mirror as well.
TEST(CellVolume, ACellThatIsInsideOutComesBack) {
  for (const bool kept : {false, true}) {
    LatticeMaterial material;
    material.poisson_ratio = kept ? 0.4 : 0.25;
    const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {3, 3, 3}, material);
    auto body = settler(lattice);
    // A corner is pushed through the cell, out at the other end of it.
    body->set_position(0, row(lattice.positions, 13) + 0.2 * Vec3(0.05, 0.05, 0.05));
    for (int i = 0; i < 400; ++i) ASSERT_TRUE(body->advance({double(i), i + 1.0, Vec3::Zero(), {}}).good());
    const auto volumes = Cells::of<double>(1, lattice).volumes(body->positions());
    const double least = *std::min_element(volumes.begin(), volumes.end()) / (0.05 * 0.05 * 0.05);
    if (kept) {
      EXPECT_NEAR(least, 1, 1e-3);
    } else {
      EXPECT_LT(least, 0.9);
    }
  }
}

// Far from the origin, where float drops most of a cell's edges.
TEST(CellVolume, FineForceUsesWhatRoundingHasDropped) {
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, LatticeMaterial{});
  Random random;
  SCOPED_TRACE(random.trace());
  const Points<double> x = crumpled(lattice, 0.005, random) + 100, none = Points<double>::Zero(x.rows(), 3);
  const Points<float> high = x.cast<float>(), low = (x - high.cast<double>()).cast<float>(), still = none.cast<float>();
  Points<double> exact = none;
  Points<float> coarse = still, fine = still;
  Cells::of<double>(1e4, lattice).add_force(x, none, 0, exact);
  const auto field = Cells::of<float>(1e4, lattice);
  field.add_force(high, still, 0, coarse);
  field.add_fine_force(high, low, still, 0, fine);
  EXPECT_LT(largest(fine.cast<double>() - exact), 1e-5 * largest(exact));
  EXPECT_GT(largest(coarse.cast<double>() - exact), 1e-4 * largest(exact));
}

TEST(CellVolume, RefusesWhatHasNoCells) {
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {3, 3, 3}, LatticeMaterial{});
  const auto told = [&](double stiffness, const Count& points, const Points<double>& start) -> std::string {
    try {
      CellVolumeField<double>(stiffness, points, start);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing";
  };
  const Points<double> mirrored = -lattice.positions;
  EXPECT_EQ(told(1, {3, 3, 3}, lattice.positions), "nothing");
  EXPECT_THAT(told(-1, {3, 3, 3}, lattice.positions), HasSubstr("must not be negative, got -1"));
  EXPECT_THAT(told(1, {3, 3, 4}, lattice.positions), HasSubstr("got 3 x 3 x 4 of 27"));
  EXPECT_THAT(told(1, {27, 1, 1}, lattice.positions), HasSubstr("at least 2 x 2 x 2"));
  EXPECT_THAT(told(1, {3, 3, 3}, mirrored), HasSubstr("cell 0 has the volume -0.000125"));
}

TEST(Volume, ASqueezedJellyKeepsItsEnergyWithoutDampers) {
  LatticeMaterial material;
  material.poisson_ratio = 0.45, material.damping_ratio = 0;
  const Lattice lattice = lattice_from_box({0.1, 0.1, 0.1}, {4, 4, 4}, material);
  auto settings = softbody::settings_of(lattice);
  EXPECT_GT(settings.cell_stiffness, 0);
  settings.precision = softbody::Precision::Double;
  settings.motion.dt = 1e-4;
  settings.velocities = lattice.positions;
  settings.velocities.col(1) *= -5;  // pressed flat in y, wide in x
  settings.velocities.col(0) *= 5;
  settings.velocities.col(2) *= 5;
  const auto body = softbody::make_soft_body(settings);
  const double before = body->energy(Vec3::Zero()).total();
  double most = 0;
  for (int i = 0; i < 240; ++i) {
    ASSERT_TRUE(body->advance({i / 240.0, (i + 1) / 240.0, Vec3::Zero(), {}}).good());
    most = std::max(most, std::abs(body->energy(Vec3::Zero()).total() / before - 1));
  }
  EXPECT_LT(most, 1e-3);
  EXPECT_LT(body->momentum().norm(), 1e-13);
}

}  // namespace
}  // namespace hooke::test
