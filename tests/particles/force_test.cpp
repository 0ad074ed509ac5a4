// Forces that vary from place to place.
#include "scene.hpp"

#include <random>

namespace hooke::particles {
namespace {

template <class S>
struct Cloud {
  static constexpr Index n = 1024;
  std::vector<S> memory = std::vector<S>(9 * n, S(0));
  Tile<S> tile;
  S* a[3];
  explicit Cloud(double extent) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-extent, extent);
    tile.count = n;
    for (int k = 0; k < 3; ++k) {
      tile.x[k] = memory.data() + k * n, tile.v[k] = memory.data() + (3 + k) * n, a[k] = memory.data() + (6 + k) * n;
      for (Index i = 0; i < n; ++i) tile.x[k][i] = S(uniform(random));
    }
  }
  void clear() { std::fill(memory.begin() + 6 * n, memory.end(), S(0)); }
};

TEST(CurlNoise, HasNoDivergenceAndTheSpeedAskedFor) {
  const CurlNoise<double> noise({2.0, 0.5, 1.0, 7});
  Cloud<double> cloud(3);
  double square = 0, worst = 0, steepest = 0;
  const auto velocity = [&](Index i) { return Vec3(cloud.a[0][i], cloud.a[1][i], cloud.a[2][i]); };
  noise.add_velocity(cloud.tile, Vec3::Zero(), 0.3, cloud.a);
  for (Index i = 0; i < cloud.n; ++i) square += velocity(i).squaredNorm();
  EXPECT_NEAR(std::sqrt(square / double(cloud.n)), 2, 0.3);
  constexpr double h = 1e-5;
  Eigen::Matrix<double, 3, Eigen::Dynamic> gradient(3, cloud.n);
  for (int k = 0; k < 3; ++k) {
    const auto shifted = [&](double by) {
      Cloud<double> moved = cloud;
      for (int c = 0; c < 3; ++c)
        moved.tile.x[c] = moved.memory.data() + c * cloud.n, moved.a[c] = moved.memory.data() + (6 + c) * cloud.n;
      moved.clear();
      for (Index i = 0; i < cloud.n; ++i) moved.tile.x[k][i] += by;
      noise.add_velocity(moved.tile, Vec3::Zero(), 0.3, moved.a);
      return std::vector<double>(moved.a[k], moved.a[k] + cloud.n);
    };
    const auto low = shifted(-h), high = shifted(h);
    for (Index i = 0; i < cloud.n; ++i) gradient(k, i) = (high[std::size_t(i)] - low[std::size_t(i)]) / (2 * h);
  }
  for (Index i = 0; i < cloud.n; ++i) {
    worst = std::max(worst, std::abs(gradient.col(i).sum()));
    steepest = std::max(steepest, gradient.col(i).norm());
  }
  EXPECT_LT(worst, 1e-4 * steepest);
}

TEST(CurlNoise, ChangesWithTimeAndNotAcrossTheLattice) {
  const CurlNoise<float> noise({1.0, 0.5, 1.0, 7});
  Cloud<float> cloud(1);
  noise.add_velocity(cloud.tile, Vec3::Zero(), 0, cloud.a);
  const std::vector<float> before(cloud.a[0], cloud.a[0] + cloud.n);
  cloud.clear();
  noise.add_velocity(cloud.tile, Vec3::Zero(), 1, cloud.a);
  int changed = 0;
  for (Index i = 0; i < cloud.n; ++i) changed += std::abs(before[std::size_t(i)] - cloud.a[0][i]) > 0.05f;
  EXPECT_GT(changed, cloud.n / 2);
}

TEST(Attractor, KeepsTheEnergyOfAnOrbit) {
  ParticleSettings settings;
  settings.dt = 1.0 / 2000;
  World world;
  world.set_gravity(Vec3::Zero());
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  system.add_force(std::make_unique<Attractor<double>>(Vec3::Zero(), 4, 0.01));
  system.add(thrown(Vec3(1, 0, 0), Vec3(0, 1.6, 0)));
  const auto energy = [&] {
    const Vec3 x = system.positions().row(0).matrix().transpose(), v = system.velocities().row(0).matrix().transpose();
    return 0.5 * v.squaredNorm() - 4 / std::sqrt(x.squaredNorm() + 1e-4);
  };
  const double start = energy();
  double worst = 0;
  for (int i = 0; i < 240 * 20; ++i) {
    ASSERT_TRUE(world.update(1.0 / 240).good());
    worst = std::max(worst, std::abs(energy() - start));
  }
  EXPECT_LT(worst, 1e-4 * std::abs(start));
}

TEST(Flow, TakesParticlesAlong) {
  ParticleSettings settings;
  World world;
  world.set_gravity(Vec3::Zero());
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add_force(std::make_unique<FlowDrag<float>>(
      std::make_unique<Vortex<float>>(Vec3::Zero(), Vec3(0, 1, 0), 2 * std::numbers::pi, 0.1, 0.5), 50));
  system.add(thrown(Vec3(0, 0, 0), Vec3::Zero()));
  ASSERT_TRUE(world.update(1).good());
  // On the axis there is the updraught alone, followed after a fiftieth of a second.
  EXPECT_NEAR(system.velocities()(0, 1), 0.5, 1e-4);
  EXPECT_NEAR(system.positions()(0, 1), 0.5 * (1 - 0.02), 1e-3);
}

TEST(Repulsion, PushesEquallyAndSpreads) {
  ParticleSettings settings;
  World world;
  world.set_gravity(Vec3::Zero());
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  system.add_force(std::make_unique<Repulsion<double>>(200, 0.1));
  EmitterSettings emitter;
  emitter.source = SphereSource{0.1, 0}, emitter.speed = 0, emitter.bursts = {{0, 300, 0}};
  system.add_emitter(emitter);
  ASSERT_TRUE(world.update(1.0 / 240).good());
  const auto nearest = [&] {
    const auto x = system.positions();
    double least = 1;
    for (Index i = 0; i < system.size(); ++i)
      for (Index j = 0; j < i; ++j) least = std::min(least, (x.row(i) - x.row(j)).matrix().norm());
    return least;
  };
  const double before = nearest();
  ASSERT_TRUE(world.update(1).good());
  EXPECT_GT(nearest(), 2 * before);
  EXPECT_LT(world.momentum().norm(), 1e-10);
}

TEST(Masses, HeavyOnesFallFasterThroughAir) {
  ParticleSettings settings;
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  system.add_force(std::make_unique<LinearDrag<double>>(0.1));
  Birth light = thrown(Vec3::Zero(), Vec3::Zero()), heavy = light;
  light.mass = 0.01, heavy.mass = 0.02;
  system.add(light), system.add(heavy);
  ASSERT_TRUE(world.update(5).good());
  EXPECT_NEAR(system.velocities()(0, 1), -9.81 * 0.1, 1e-6);
  EXPECT_NEAR(system.velocities()(1, 1), -9.81 * 0.2, 1e-6);
}

TEST(Attractor, NegativeKicksCount) {
  for (const Method* method : {&pefrl(), &blanes_moan_4(), &blanes_moan_6()}) {
    ParticleSettings settings;
    settings.method = method;
    World world;
    auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
    system.add_force(std::make_unique<Attractor<double>>(Vec3::Zero(), 1e-12, 1));
    system.add(thrown(Vec3::Zero(), Vec3::Zero()));
    ASSERT_TRUE(world.update(1).good());
    EXPECT_NEAR(system.velocities()(0, 1), -9.81, 1e-9) << method->name;
    EXPECT_NEAR(system.positions()(0, 1), -4.905, 1e-9) << method->name;
  }
}

// Two neighbours on the border of cells, where rounding decides which one they are in.
TEST(Repulsion, IsMutualAtTheBordersOfCells) {
  for (const float x : {0.7f, 0.8f, 0.3f, -0.1f, -0.7f}) {
    ParticleSettings settings;
    World world;
    world.set_gravity(Vec3::Zero());
    auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
    system.add_force(std::make_unique<Repulsion<float>>(100, 0.1));
    system.add(thrown(Vec3(x, 0, 0), Vec3::Zero())), system.add(thrown(Vec3(double(x) + 0.05, 0, 0), Vec3::Zero()));
    ASSERT_TRUE(world.update(1.0 / 240).good());
    EXPECT_LT(system.velocities()(0, 0), 0) << x;
    EXPECT_NEAR(system.velocities()(0, 0), -system.velocities()(1, 0), 1e-6) << x;
  }
}

TEST(CurlNoise, DoesNotJumpWhereItsPatternWraps) {
  const CurlNoise<double> noise({1.0, 0.5, 1.0, 7});
  Cloud<double> cloud(2);
  const auto at = [&](double t) {
    cloud.clear();
    noise.add_velocity(cloud.tile, Vec3::Zero(), t, cloud.a);
    return std::vector<double>(cloud.a[0], cloud.a[0] + cloud.n);
  };
  for (const double t : {0.0, 1024 / 0.31, 1024 / 0.87}) {
    const auto before = at(t - 1e-7), after = at(t + 1e-7);
    for (std::size_t i = 0; i < before.size(); ++i) ASSERT_NEAR(before[i], after[i], 1e-4) << t;
  }
}

}  // namespace
}  // namespace hooke::particles
