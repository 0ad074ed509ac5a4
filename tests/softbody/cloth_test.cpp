// Cloth: the same material behaves the same at any resolution and from any mesh.
#include "core/problems.hpp"

#include <hooke/softbody/soft_body.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

namespace hooke::test {
namespace {

using softbody::Cloth;
using softbody::ClothMaterial;
using softbody::Family;
using softbody::SpringField;
using ::testing::HasSubstr;

// Implicit Euler that is content with a ten-thousandth: it only has to find the rest.
const Method& settler() {
  static const Method method = [] {
    Method loose = implicit_euler();
    loose.scheme = Implicit{1e-4, 200};
    return loose;
  }();
  return method;
}

std::unique_ptr<PointBody<double>> still(const Cloth& cloth) {
  const Index n = cloth.positions.rows();
  auto body = body_of(points<double>(cloth.positions, Points<double>::Zero(n, 3), cloth.masses), motion(settler(), 1));
  body->add_field(std::make_unique<SpringField<double>>(cloth.network, body->state().position));
  return body;
}

// Huge steps of implicit Euler until nothing moves.
void settle(PointBody<double>& body, const Vec3& gravity) {
  const double step = 1;
  for (int i = 0; i < 60; ++i) {
    const StepReport report = body.advance({i * step, (i + 1) * step, gravity, {}});
    ASSERT_TRUE(report.good()) << report.text();
    if (i > 3 && body.velocities().abs().maxCoeff() < 1e-5) return;
  }
  ADD_FAILURE() << "still moves after a minute";
}

TEST(Cloth, WeighsDensityTimesArea) {
  ClothMaterial material;
  material.density = 0.37;
  for (const int n : {2, 3, 10, 41}) {
    const Cloth cloth = softbody::cloth_from_grid(1.5, 0.8, n, n + 1, {1, 1, 0}, {0, 0, 3}, material);
    EXPECT_NEAR(cloth.masses.sum(), 0.37 * 1.5 * 0.8, 1e-12);
    TriangleMesh mesh{cloth.positions, cloth.triangles};
    EXPECT_NEAR(softbody::cloth_from_mesh(mesh, material).masses.sum(), 0.37 * 1.5 * 0.8, 1e-12);
  }
}

TEST(Cloth, LiesWhereItIsToldTo) {
  const Cloth cloth = softbody::cloth_from_grid(2, 3, 3, 4, {5, 0, 0}, {0, -0.1, 0}, {});
  EXPECT_EQ(row(cloth.positions, 0), Vec3(-1, 0, 0));
  EXPECT_LT((row(cloth.positions, 1) - Vec3(0, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(row(cloth.positions, 11), Vec3(1, -3, 0));
  EXPECT_EQ(cloth.triangles.size(), 12u);
}

TEST(Cloth, StretchesAlongItsThreadsByItsTensileStiffness) {
  // Without shear: the tension to pull it by `strain` is stretch × width × strain, at any resolution.
  ClothMaterial material;
  material.shear = 0, material.bend = 0;
  for (const int n : {2, 5, 20}) {
    const Cloth cloth = softbody::cloth_from_grid(0.4, 1, n, n, Vec3::UnitX(), Vec3::UnitY(), material);
    Points<double> x = cloth.positions, f = Points<double>::Zero(x.rows(), 3);
    x.col(1) *= 1.01;
    SpringField<double>(cloth.network, cloth.positions).add_force(x, f, 0, f);
    double tension = 0;
    for (int c = 0; c < n; ++c) tension += f(c, 1);
    EXPECT_NEAR(tension, material.stretch * 0.4 * 0.01, 1e-9) << n;
  }
}

// How far the free end of a strip hangs down in the mean, settled under its own weight.
double sag(int n, const ClothMaterial& material) {
  const Cloth cloth = softbody::cloth_from_grid(0.5, 0.5, n, n, Vec3::UnitX(), -Vec3::UnitY(), material);
  auto body = still(cloth);
  for (Index i = 0; i < n; ++i) body->pin(i);
  // Start near the answer of threads alone.
  for (Index i = n; i < n * n; ++i) {
    Vec3 x = row(body->positions(), i);
    const double down = -x.y();
    x.y() -= material.density * 9.81 / material.stretch * (0.5 * down - down * down / 2);
    body->set_position(i, x);
  }
  settle(*body, {0, -9.81, 0});
  const Points<double> x = body->positions();
  return -x.col(1).tail(n).mean() - 0.5;
}

TEST(Cloth, SagsTheSameAtAnyResolution) {
  ClothMaterial material;
  material.stretch = 40, material.shear = 4, material.bend = 0.2;  // soft: the sag is centimetres
  const double fine = sag(100, material);
  EXPECT_GT(fine, 5e-3);
  for (const int n : {10, 25, 50}) EXPECT_NEAR(sag(n, material) / fine, 1, 0.02) << n << " x " << n;
}

// The same grid cut into triangles: along one diagonal, as the grid's own triangles are.
TEST(Cloth, FromATriangulatedGridPullsAsTheGridDoes) {
  ClothMaterial material;
  for (const int n : {5, 15}) {
    SCOPED_TRACE(n);
    const Cloth grid = softbody::cloth_from_grid(1, 1, n, n, Vec3::UnitX(), Vec3::UnitY(), material);
    const Cloth mesh = softbody::cloth_from_mesh({grid.positions, grid.triangles}, material);
    const auto pull = [&](const Cloth& cloth, int axis) {
      Points<double> x = cloth.positions, f = Points<double>::Zero(x.rows(), 3);
      x.col(axis) *= 1.01;
      SpringField<double>(cloth.network, cloth.positions).add_force(x, f, 0, f);
      // Through a cut across the middle: the sum of forces on one half's springs over the other.
      double sum = 0;
      for (Index i = 0; i < x.rows(); ++i) {
        const double at = cloth.positions(i, axis) - (axis == 0 ? -0.5 : 0);
        if (at < 1e-9) sum += f(i, axis);
      }
      return sum;
    };
    for (const int axis : {0, 1}) EXPECT_NEAR(pull(mesh, axis) / pull(grid, axis), 1, 0.1) << "axis " << axis;
    int shear = 0;
    for (const auto& spring : mesh.network->springs) shear += spring.family == Family::Shear;
    EXPECT_EQ(shear, 2 * (n - 1) * (n - 1));
  }
}

TEST(Cloth, DampsEachSpringByItsRatioOfCritical) {
  ClothMaterial material;
  material.damping_ratio = {0.1, 0.2, 0.3};
  const Cloth cloth = softbody::cloth_from_grid(1, 1, 6, 6, Vec3::UnitX(), Vec3::UnitY(), material);
  for (const auto& spring : cloth.network->springs) {
    const double ratio = spring.family == Family::Stretch ? 0.1 : spring.family == Family::Shear ? 0.2 : 0.3;
    EXPECT_NEAR(spring.damping,
                softbody::damping_of_ratio(ratio, spring.stiffness, cloth.masses[spring.a], cloth.masses[spring.b]),
                1e-12);
  }
}

template <class F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Cloth, RefusesBadInputAndNamesIt) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  const auto grid = [&](double w, double h, int c, int r, const Vec3& down, const ClothMaterial& m) {
    return message_of([&] { softbody::cloth_from_grid(w, h, c, r, x, down, m); });
  };
  EXPECT_THAT(grid(0, 1, 3, 3, y, {}), HasSubstr("size must be positive"));
  EXPECT_THAT(grid(1, NAN, 3, 3, y, {}), HasSubstr("size must be positive"));
  EXPECT_THAT(grid(1, 1, 1, 3, y, {}), HasSubstr("at least 2 x 2"));
  EXPECT_THAT(grid(1, 1, 3, 3, 2 * x, {}), HasSubstr("two different directions"));
  ClothMaterial material;
  material.density = 0;
  EXPECT_THAT(grid(1, 1, 3, 3, y, material), HasSubstr("density must be positive, got 0"));
  material = {}, material.shear = -1;
  EXPECT_THAT(grid(1, 1, 3, 3, y, material), HasSubstr("shear must not be negative"));
  const auto mesh = [](const Points<double>& vertices, std::vector<Triangle> triangles) {
    return message_of([&] { softbody::cloth_from_mesh({vertices, std::move(triangles)}, {}); });
  };
  const Points<double> square = rows({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}});
  EXPECT_THAT(mesh(square, {{0, 1, 9}}), HasSubstr("triangle 0 uses vertex 9 of 5"));
  EXPECT_THAT(mesh(square, {{0, 1, 1}}), HasSubstr("triangle 0 has no area"));
  EXPECT_THAT(mesh(square, {{0, 1, 2}, {0, 2, 3}}), HasSubstr("vertex 4 is in no triangle"));
  EXPECT_THAT(mesh(square, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}), HasSubstr("has 3 triangles"));
}

TEST(SoftBody, IsMadeFromItsSettings) {
  auto settings = softbody::settings_of(softbody::cloth_from_grid(1, 1, 5, 5, Vec3::UnitX(), -Vec3::UnitY(), {}));
  settings.name = "sheet";
  settings.origin = {10, 20, 30};
  settings.pins = {0, 4};
  for (const auto precision : {softbody::Precision::Float, softbody::Precision::Double}) {
    settings.precision = precision;
    auto body = softbody::make_soft_body(settings);
    EXPECT_EQ(body->name(), "sheet");
    EXPECT_EQ(body->size(), 25);
    EXPECT_TRUE(body->pinned(0) && body->pinned(4) && !body->pinned(2));
    EXPECT_NEAR(body->positions()(0, 0), 9.5, 1e-6);
    EXPECT_NEAR(body->total_mass(), 0.25, 1e-6);
  }
  settings.pins = {25};
  EXPECT_THROW(softbody::make_soft_body(settings), std::out_of_range);
  settings.pins = {};
  settings.masses.conservativeResize(3);
  EXPECT_THAT(message_of([&] { softbody::make_soft_body(settings); }), HasSubstr("\"sheet\": 25 positions, 3 masses"));
  settings.masses = Values<double>::Ones(25);
  settings.linear_drag = -1;
  EXPECT_THROW(softbody::make_soft_body(settings), std::invalid_argument);
}

TEST(SoftBody, SettlesStillAndInOnePieceAfterAMinute) {
  auto settings = softbody::settings_of(softbody::cloth_from_grid(0.5, 0.5, 8, 8, Vec3::UnitX(), -Vec3::UnitY(), {}));
  settings.pins = {0, 7};
  settings.linear_drag = 0.02;
  World world(240);
  Body& body = world.add(softbody::make_soft_body(settings));
  ASSERT_TRUE(world.update(30).good());
  const Points<double> settled = body.positions();
  ASSERT_TRUE(world.update(30).good());
  EXPECT_LT((body.positions() - settled).abs().maxCoeff(), 1e-4);
  EXPECT_LT(body.velocities().matrix().rowwise().norm().maxCoeff(), 1e-4);
}

}  // namespace
}  // namespace hooke::test
