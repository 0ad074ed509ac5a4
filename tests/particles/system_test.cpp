// What a system promises: the same bits however it is cut, handles, counts, memory, failures told.
#include "scene.hpp"

#include <gmock/gmock.h>

#include <random>

namespace hooke::particles {
namespace {

// Everything at once: rates and bursts, drag, turbulence, floor, a ball, splitting sparks, a capacity that is met.
template <class S>
struct Show {
  World world{240};
  ParticleSystem<S>* system;

  explicit Show(Index tile = 512, Index capacity = 6000,
                ParticleSettings::AtCapacity policy = ParticleSettings::AtCapacity::OldestDies, bool forces = true) {
    ParticleSettings settings;
    settings.tile = tile, settings.capacity = capacity, settings.at_capacity = policy;
    world.add_collider(floor_at(0, 0.5, 0.3));
    Collider ball;
    ball.shapes = {Sphere{Vec3(0.5, 0.3, 0), 0.3}};
    ball.restitution = 0.6;
    world.add_collider(ball);
    system = &world.add(std::make_unique<ParticleSystem<S>>(settings));
    system->add_force(std::make_unique<LinearDrag<S>>(0.2, Vec3(0.5, 0, 0)));
    if (forces)
      system->add_force(std::make_unique<FlowDrag<S>>(
          std::make_unique<CurlNoise<S>>(typename CurlNoise<S>::Settings{1.0, 0.4, 1.0, 3}), 2));
    EmitterSettings emitter;
    emitter.position = Vec3(0, 1, 0), emitter.axis = Vec3(1, 0.3, 0), emitter.spread = 0.3;
    emitter.rate = 4000, emitter.speed = {2, 5}, emitter.lifetime = {0.5, 1.5};
    system->add_emitter(emitter);
    emitter.bursts = {{0.1, 300, 0.3}}, emitter.rate = 0, emitter.seed = 9;
    system->add_emitter(emitter);
    SubEmitterSettings split;
    split.on = SubEmitterSettings::On::Impact;
    split.count = {1, 3}, split.speed = {0.5, 1}, split.least_impact = 1, split.spread = 1, split.lifetime = 0.3;
    system->add_sub_emitter(split);
    split.on = SubEmitterSettings::On::Death, split.kind = 2, split.probability = 0.3;
    system->add_sub_emitter(split);
  }
};

std::string run_frames(const std::vector<double>& frames, int threads = 1, Index tile = 512, bool forces = true) {
  Show<float> show(tile, 6000, ParticleSettings::AtCapacity::OldestDies, forces);
  show.world.set_threads(threads);
  for (const double frame : frames) EXPECT_TRUE(show.world.update(frame).good());
  EXPECT_GT(show.system->counts().displaced, 100);
  EXPECT_GT(show.system->counts().impacts, 100);
  return bytes(*show.system);
}

TEST(ParticleSystem, TheSameBitsAtAnyFrameRate) {
  const std::string at60 = run_frames(std::vector<double>(120, 1.0 / 60));
  EXPECT_EQ(run_frames(std::vector<double>(60, 1.0 / 30)), at60);
  EXPECT_EQ(run_frames(std::vector<double>(288, 1.0 / 144)), at60);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> length(0, 0.04);
  std::vector<double> frames;
  double time = 0;
  while (time < 1.95) time += frames.emplace_back(length(random));
  frames.push_back(2 - time + 1e-9);
  EXPECT_EQ(run_frames(frames), at60);
}

TEST(ParticleSystem, TheSameBitsAtAnyThreadCountAndTile) {
  const std::vector<double> frames(60, 1.0 / 30);
  for (const bool forces : {true, false}) {
    const std::string one = run_frames(frames, 1, 512, forces);
    for (const Index tile : {32, 64, 256, 4096}) EXPECT_EQ(run_frames(frames, 1, tile, forces), one) << "tile " << tile;
    // Small tiles, so that there are enough of them for several threads.
    for (const int threads : {2, 3, 4})
      EXPECT_EQ(run_frames(frames, threads, 32, forces), one) << threads << " threads";
  }
}

// The fused loop and the one that goes leg by leg: a solid far away brings in the latter.
TEST(ParticleSystem, ASolidFarAwayChangesNoBit) {
  const auto run = [](bool far) {
    World world;
    world.add_collider(floor_at(0, 0.5, 0.3));
    if (far) {
      Collider ball;
      ball.shapes = {Sphere{Vec3(0, 500, 0), 1}};
      world.add_collider(ball);
    }
    ParticleSettings settings;
    settings.dt = 1.0 / 1000;
    auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
    system.add_force(std::make_unique<LinearDrag<float>>(0.2));
    EmitterSettings emitter;
    emitter.position = Vec3(0, 0.3, 0), emitter.rate = 3000, emitter.spread = 2, emitter.speed = {1, 3},
    emitter.lifetime = 1;
    system.add_emitter(emitter);
    EXPECT_TRUE(world.update(2).good());
    return bytes(system);
  };
  EXPECT_EQ(run(true), run(false));
}

TEST(ParticleSystem, HandlesSurviveCompaction) {
  ParticleSettings settings;
  settings.capacity = 100;
  World world;
  world.set_gravity(Vec3::Zero());
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  std::vector<Handle> handles;
  for (int i = 0; i < 100; ++i) {
    Birth birth = thrown(Vec3(i, 0, 0), Vec3(0, 1, 0));
    birth.lifetime = i % 3 == 0 ? 0.1 : 10;
    handles.push_back(system.add(birth));
  }
  ASSERT_TRUE(world.update(0.5).good());
  EXPECT_EQ(system.size(), 66);
  EXPECT_EQ(system.counts().died, 34);
  for (int i = 0; i < 100; ++i) {
    const Index now = system.find(handles[std::size_t(i)]);
    if (i % 3 == 0) {
      EXPECT_EQ(now, -1);
      continue;
    }
    ASSERT_GE(now, 0);
    EXPECT_EQ(system.positions()(now, 0), i);
    EXPECT_NEAR(system.age(now), 0.5, 1e-9);
  }
  // Who is born now takes free places, not free names.
  system.add(thrown(Vec3::Zero(), Vec3::Zero()));
  EXPECT_EQ(system.find(handles[0]), -1);
}

TEST(ParticleSystem, LimitsAreKeptAndTold) {
  for (const auto policy : {ParticleSettings::AtCapacity::Refuse, ParticleSettings::AtCapacity::OldestDies}) {
    Show<float> show(512, 500, policy);
    ASSERT_TRUE(show.world.update(1).good());
    const Counts& counts = show.system->counts();
    EXPECT_LE(show.system->size(), 500);
    EXPECT_EQ(counts.born - counts.died - counts.displaced, show.system->size());
    if (policy == ParticleSettings::AtCapacity::Refuse) {
      EXPECT_GT(counts.refused, 1000);
      EXPECT_EQ(counts.displaced, 0);
    } else {
      EXPECT_GT(counts.displaced, 1000);
      std::uint64_t oldest = ~std::uint64_t(0);
      for (Index i = 0; i < show.system->size(); ++i) oldest = std::min(oldest, show.system->serial(i));
      EXPECT_GT(oldest, std::uint64_t(counts.born) - 2000);
    }
  }
}

TEST(ParticleSystem, BirthsWithinATickFlyOnForTheRestOfIt) {
  ParticleSettings settings;
  World world(10);
  world.set_gravity(Vec3::Zero());
  auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
  EmitterSettings emitter;
  emitter.axis = Vec3(1, 0, 0), emitter.speed = 5, emitter.rate = 100;
  system.add_emitter(emitter);
  ASSERT_TRUE(world.update(0.4).good());
  // A jet without clumps: neighbours are 5/100 m apart.
  std::vector<double> x;
  for (Index i = 0; i < system.size(); ++i) x.push_back(system.positions()(i, 0));
  std::sort(x.begin(), x.end());
  ASSERT_EQ(x.size(), 40u);
  for (std::size_t i = 1; i < x.size(); ++i) EXPECT_NEAR(x[i] - x[i - 1], 0.05, 1e-9);
}

TEST(ParticleSystem, PrewarmIsARunBeforeTheStart) {
  const auto alive = [](double prewarm, double seconds) {
    ParticleSettings settings;
    settings.prewarm = prewarm;
    World world;
    auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
    EmitterSettings emitter;
    emitter.rate = 100, emitter.lifetime = 5;
    system.add_emitter(emitter);
    EXPECT_TRUE(world.update(seconds).good());
    return system.size();
  };
  EXPECT_EQ(alive(2, 0.5), alive(0, 2.5));
}

TEST(ParticleSystem, AFailedNeighbourTakesTheTickBack) {
  // A body that fails in its 300th tick.
  class Failing final : public Body {
   public:
    Failing() : Body("failing") {}
    Index size() const override { return 0; }
    Points<double> positions() const override { return Points<double>(0, 3); }
    Points<double> velocities() const override { return Points<double>(0, 3); }
    Values<double> masses() const override { return Values<double>(0); }
    Points<double> positions_between(double) const override { return Points<double>(0, 3); }
    Points<double> start_positions() const override { return Points<double>(0, 3); }
    void set_position(Index, const Vec3&) override {}
    void set_velocity(Index, const Vec3&) override {}
    void pin(Index) override {}
    void release(Index) override {}
    bool pinned(Index) const override { return false; }
    void move_pin(Index, const Vec3&) override {}
    void drive_pins(std::vector<Index>, PinMotion) override {}
    void add_force(Index, const Vec3&) override {}
    void clear_forces() override {}
    Energy energy(const Vec3&) const override { return {}; }
    Vec3 momentum() const override { return Vec3::Zero(); }
    void begin_frame(double, double, double, double) override {}
    StepReport advance(const Tick&) override {
      StepReport report;
      if (++ticks == 300) report.status = StepReport::Status::NotFinite;
      return report;
    }
    void take_back() override {}
    void damp(double) override {}
    int ticks = 0;
  };
  for (const auto policy : {ParticleSettings::AtCapacity::Refuse, ParticleSettings::AtCapacity::OldestDies}) {
    Show<float> show(512, 3000, policy), other(512, 3000, policy);
    show.world.add(std::unique_ptr<Body>(std::make_unique<Failing>()));
    std::string before;
    for (int i = 0; i < 300; ++i) {
      before = bytes(*show.system);
      if (!show.world.update(1.0 / 240).good()) break;
    }
    EXPECT_EQ(bytes(*show.system), before);
    // It goes on as if nothing had been.
    ASSERT_TRUE(show.world.update(0.5).good());
    ASSERT_TRUE(other.world.update(299.0 / 240 + 0.5).good());
    EXPECT_EQ(bytes(*show.system), bytes(*other.system));
  }
}

template <class S>
class Poison final : public Force<S> {
 public:
  bool varies(bool) const override { return true; }
  void add_acceleration(const Tile<S>& tile, Index first, const Vec3&, double t, S* const a[3]) const override {
    if (t > 0.5 && first >= 0 && tile.count > 7) a[1][7] = std::numeric_limits<S>::quiet_NaN();
  }
};

TEST(ParticleSystem, NaNIsFoundAndNamed) {
  ParticleSettings settings;
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add_force(std::make_unique<Poison<float>>());
  for (int i = 0; i < 20; ++i) system.add(thrown(Vec3(i, 0, 0), Vec3::Zero()));
  const StepReport report = world.update(1);
  ASSERT_FALSE(report.good());
  EXPECT_EQ(report.body, "particles");
  EXPECT_EQ(report.point, 7);
  EXPECT_NEAR(report.time, 0.5, 0.02);
  EXPECT_TRUE(system.positions().allFinite());
}

TEST(ParticleSystem, PushesAreTheSameAtAnyFrameRate) {
  const auto run = [](int rate) {
    ParticleSettings settings;
    World world;
    world.set_gravity(Vec3::Zero());
    auto& system = world.add(std::make_unique<ParticleSystem<double>>(settings));
    Birth birth = thrown(Vec3::Zero(), Vec3::Zero());
    birth.mass = 0.5;
    system.add(birth);
    for (int i = 0; i < rate; ++i) {
      system.add_force(0, Vec3(1, 0, 0));
      EXPECT_TRUE(world.update(1.0 / rate).good());
    }
    return system.velocities()(0, 0);
  };
  for (const int rate : {24, 30, 60, 100, 240, 1000})
    EXPECT_NEAR(run(rate), 2, rate == 1000 || rate == 100 ? 0.02 : 1e-9) << rate;
}

TEST(ParticleSystem, TrailsAndBetweenTicks) {
  ParticleSettings settings;
  settings.trail = 4;
  World world(10);
  world.set_gravity(Vec3::Zero());
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add(thrown(Vec3::Zero(), Vec3(1, 0, 0)));
  ASSERT_TRUE(world.update(1).good());
  Points<float> trail;
  ASSERT_EQ(system.trail(0, trail), 4);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(trail(k, 0), 1 - 0.1 * k, 1e-6);
  EXPECT_NEAR(system.positions_between(0.5)(0, 0), 0.95, 1e-6);
}

TEST(ParticleSystem, LooksChangeOverLife) {
  ParticleSettings settings;
  Kind kind;
  kind.color = {{0, 1}, {Vec3(1, 1, 1), Vec3(1, 0, 0)}};
  kind.size = Curve({0, 1}, {1, 3});
  settings.kinds = {kind};
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  Birth birth = thrown(Vec3::Zero(), Vec3::Zero());
  birth.lifetime = 2, birth.size = 0.1;
  system.add(birth);
  ASSERT_TRUE(world.update(1).good());
  Points<float> colors;
  Values<float> sizes;
  system.appearance(colors, sizes);
  EXPECT_NEAR(colors(0, 1), 0.5, 1e-5);
  EXPECT_NEAR(sizes[0], 0.2, 1e-5);
}

TEST(ParticleSystem, CannotBePinned) {
  ParticleSystem<float> system{ParticleSettings{}};
  system.add(thrown(Vec3::Zero(), Vec3::Zero()));
  EXPECT_THROW(system.pin(0), std::invalid_argument);
  EXPECT_THROW(system.set_position(1, Vec3::Zero()), std::out_of_range);
}

TEST(ParticleSystem, NamesWhatIsWrong) {
  const auto refuses = [](const auto& change, const char* word) {
    ParticleSettings settings;
    change(settings);
    try {
      const ParticleSystem<float> system(settings);
      ADD_FAILURE() << "accepted " << word;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(word));
    }
  };
  refuses([](auto& s) { s.capacity = 0; }, "capacity");
  refuses([](auto& s) { s.dt = -1; }, "dt");
  refuses([](auto& s) { s.restitution = 1.5; }, "restitution");
  refuses([](auto& s) { s.tile = 100; }, "tile");
  refuses([](auto& s) { s.prewarm = std::nan(""); }, "prewarm");
  refuses([](auto& s) { s.radius = -1; }, "radius");
}

TEST(ParticleSystem, ImpactsInTheTickOfBirthCount) {
  ParticleSettings settings;
  settings.dies_on_impact = true;
  World world;
  world.add_collider(floor_at(0, 0.9));
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  SubEmitterSettings splash;  // of deaths by impact
  splash.on = SubEmitterSettings::On::Death, splash.count = 1, splash.lifetime = 1e-3;
  system.add_sub_emitter(splash);
  EmitterSettings emitter;
  emitter.position = Vec3(0, 0.001, 0), emitter.axis = Vec3(0, -1, 0), emitter.speed = 5, emitter.rate = 1000;
  emitter.stop = 0.2;
  system.add_emitter(emitter);
  ASSERT_TRUE(world.update(0.5).good());
  EXPECT_EQ(system.size(), 0);
  EXPECT_EQ(system.counts().born, 400);
}

TEST(ParticleSystem, LivesShorterThanATickEndInIt) {
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(ParticleSettings{}));
  EmitterSettings emitter;
  emitter.rate = 24'000, emitter.lifetime = 0.5e-3;
  system.add_emitter(emitter);
  ASSERT_TRUE(world.update(0.1).good());
  EXPECT_NEAR(double(system.size()), 12, 1);
}

TEST(ParticleSystem, HandlesSurviveATickThatIsTakenBack) {
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(ParticleSettings{}));
  EmitterSettings emitter;
  emitter.rate = 2400, emitter.lifetime = 0.05;
  system.add_emitter(emitter);
  ASSERT_TRUE(world.update(0.2).good());
  std::vector<Handle> handles;
  for (Index i = 0; i < system.size(); ++i) handles.push_back(system.handle(i));
  const std::string before = bytes(system);
  Tick tick;
  tick.start = world.time(), tick.end = tick.start + 1.0 / 240;
  ASSERT_TRUE(system.advance(tick).good());
  ASSERT_NE(bytes(system), before);
  system.take_back();
  EXPECT_EQ(bytes(system), before);
  for (std::size_t i = 0; i < handles.size(); ++i) EXPECT_EQ(system.find(handles[i]), Index(i));
}

TEST(ParticleSystem, SeedsDiffer) {
  const auto run = [](std::uint64_t seed, int emitters) {
    ParticleSettings settings;
    settings.seed = seed;
    World world;
    auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
    EmitterSettings emitter;
    emitter.rate = 100, emitter.spread = 1;
    for (int i = 0; i < emitters; ++i) system.add_emitter(emitter);
    EXPECT_TRUE(world.update(0.1).good());
    return system.positions();
  };
  EXPECT_NE((run(1, 1) - run(2, 1)).matrix().norm(), 0);
  const Points<double> two = run(1, 2);
  EXPECT_NE((two.row(0) - two.row(two.rows() / 2)).matrix().norm(), 0);
}

}  // namespace
}  // namespace hooke::particles
