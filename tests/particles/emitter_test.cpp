// When and where particles are born.
#include "scene.hpp"

#include <gmock/gmock.h>

#include <random>

namespace hooke::particles {
namespace {

std::vector<Birth> born(const Emitter& emitter, double t0, double t1) {
  std::vector<Birth> out;
  emitter.births(t0, t1, out);
  return out;
}

TEST(Curve, IntegralAndItsInverseAgree) {
  const Curve curve({0.5, 1, 3, 4}, {2, 0, 5, 5});
  for (double t = 0.5; t < 6; t += 0.137) EXPECT_NEAR(curve.inverse_integral(curve.integral(t)), t, 1e-9) << t;
  EXPECT_NEAR(curve.integral(3) - curve.integral(0.5), 0.5 * 2 * 0.5 + 0.5 * 5 * 2, 1e-12);
}

TEST(Curve, NamesWhatIsWrong) {
  EXPECT_THROW(Curve({0, 0}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(Curve({0, 1}, {1}), std::invalid_argument);
  EXPECT_THROW(Curve({0, 1}, {1, std::nan("")}), std::invalid_argument);
}

TEST(Emitter, HowTimeIsCutChangesNothing) {
  EmitterSettings settings;
  settings.source = SphereSource{0.3, 0.1};
  settings.rate = Curve({0, 1, 2}, {100, 900, 50});
  settings.bursts = {{0.5, 20, 0.25}};
  settings.spread = 0.4, settings.speed = {1, 3}, settings.start = 0.1;
  const Emitter emitter(settings);
  const auto whole = born(emitter, 0, 2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> step(0, 0.05);
  std::vector<Birth> pieces;
  for (double t = 0; t < 2;) {
    const double next = std::min(2.0, t + step(random));
    emitter.births(t, next, pieces);
    t = next;
  }
  ASSERT_EQ(pieces.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(pieces[i].time, whole[i].time);
    EXPECT_EQ(pieces[i].position, whole[i].position);
    EXPECT_EQ(pieces[i].velocity, whole[i].velocity);
  }
}

TEST(Emitter, TheRateIsKept) {
  EmitterSettings settings;
  settings.rate = Curve({0, 2}, {0, 1000});
  EXPECT_EQ(born(Emitter(settings), 0, 2).size(), 1000u);
  EXPECT_EQ(born(Emitter(settings), 0, 1).size(), 250u);
}

TEST(Emitter, BirthsAreEvenlySpread) {
  EmitterSettings settings;
  settings.rate = 333;
  const auto births = born(Emitter(settings), 0, 1);
  for (std::size_t i = 1; i < births.size(); ++i) EXPECT_NEAR(births[i].time - births[i - 1].time, 1.0 / 333, 1e-12);
}

TEST(Emitter, PlacesLieOnTheForm) {
  const auto each = [](Source source, const auto& check) {
    EmitterSettings settings;
    settings.source = std::move(source);
    settings.position = Vec3(1, 2, 3);
    settings.rate = 500;
    for (const Birth& birth : born(Emitter(settings), 0, 1)) check(birth.position - settings.position);
  };
  each(LineSource{Vec3(2, 0, 0)}, [](const Vec3& p) {
    EXPECT_EQ(p.y(), 0);
    EXPECT_GE(p.x(), 0);
    EXPECT_LE(p.x(), 2);
  });
  each(DiscSource{0.5, 0.25}, [](const Vec3& p) {
    EXPECT_NEAR(p.y(), 0, 1e-12);
    EXPECT_LE(p.norm(), 0.5 + 1e-12);
    EXPECT_GE(p.norm(), 0.25 - 1e-12);
  });
  each(SphereSource{0.5, 0.25}, [](const Vec3& p) {
    EXPECT_LE(p.norm(), 0.5 + 1e-12);
    EXPECT_GE(p.norm(), 0.25 - 1e-12);
  });
  each(BoxSource{Vec3(1, 2, 3)},
       [](const Vec3& p) { EXPECT_LE((p.array().abs() - Eigen::Array3d(1, 2, 3)).maxCoeff(), 0); });
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.resize(3, 3);
  mesh->vertices << 0, 0, 0, 1, 0, 0, 0, 0, 1;
  mesh->triangles = {{0, 2, 1}};
  each(MeshSource{mesh}, [](const Vec3& p) {
    EXPECT_EQ(p.y(), 0);
    EXPECT_GE(p.x(), 0);
    EXPECT_GE(p.z(), 0);
    EXPECT_LE(p.x() + p.z(), 1 + 1e-12);
  });
}

TEST(Emitter, DirectionsStayWithinTheSpread) {
  EmitterSettings settings;
  settings.axis = Vec3(1, 1, 0), settings.spread = 0.3, settings.rate = 1000, settings.speed = 2;
  double farthest = 0;
  Vec3 mean = Vec3::Zero();
  for (const Birth& birth : born(Emitter(settings), 0, 1)) {
    farthest = std::max(farthest, std::acos(birth.velocity.normalized().dot(settings.axis.normalized())));
    mean += birth.velocity;
    EXPECT_NEAR(birth.velocity.norm(), 2, 1e-12);
  }
  EXPECT_LE(farthest, 0.3 + 1e-6);
  EXPECT_GT(farthest, 0.28);
  EXPECT_LT((mean.normalized() - settings.axis.normalized()).norm(), 0.02);
}

TEST(Emitter, AMovingOneLeavesNoClumps) {
  EmitterSettings settings;
  settings.rate = 600, settings.speed = 0;
  settings.path = [](double t) { return Vec3(10 * t, 0, 0); };
  settings.inherit = 0;
  const auto births = born(Emitter(settings), 0, 1);
  for (std::size_t i = 1; i < births.size(); ++i)
    EXPECT_NEAR(births[i].position.x() - births[i - 1].position.x(), 10.0 / 600, 1e-9);
  settings.inherit = 0.5;
  EXPECT_NEAR(born(Emitter(settings), 0, 1)[7].velocity.x(), 5, 1e-6);
}

TEST(Emitter, NamesWhatIsWrong) {
  const auto refuses = [](const auto& change, const char* word) {
    EmitterSettings settings;
    change(settings);
    try {
      const Emitter emitter(settings);
      ADD_FAILURE() << "accepted " << word;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(word));
    }
  };
  refuses([](auto& s) { s.rate = -1; }, "rate");
  refuses([](auto& s) { s.lifetime = 0; }, "lifetime");
  refuses([](auto& s) { s.mass = -1; }, "mass");
  refuses([](auto& s) { s.speed = {2, 1}; }, "speed");
  refuses([](auto& s) { s.axis.setZero(); }, "axis");
  refuses([](auto& s) { s.spread = 4; }, "spread");
  refuses([](auto& s) { s.source = MeshSource{}; }, "triangles");
  refuses([](auto& s) { s.source = MeshSource{std::make_shared<TriangleMesh>()}; }, "triangles");
  refuses([](auto& s) { s.source = DiscSource{1, 2}; }, "inner_radius");
  refuses([](auto& s) { s.bursts = {{0, -1, 0}}; }, "bursts[0].count");
  refuses([](auto& s) { s.position.x() = std::nan(""); }, "position");
}

TEST(Random, IsUniformAndItsChannelsDiffer) {
  const Random random(1);
  double sum = 0, product = 0;
  constexpr int n = 100'000;
  for (int i = 0; i < n; ++i) {
    const double a = random.uniform(std::uint64_t(i), 0), b = random.uniform(std::uint64_t(i), 1);
    sum += a, product += (a - 0.5) * (b - 0.5);
  }
  EXPECT_NEAR(sum / n, 0.5, 0.005);
  EXPECT_NEAR(product / n, 0, 0.002);
}

}  // namespace
}  // namespace hooke::particles
