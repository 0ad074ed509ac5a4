// Who dies when, against models that look at everybody in every tick.
#include "scene.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <map>
#include <random>

namespace hooke::particles {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

TEST(Deaths, AreThoseOfAListThatIsSearched) {
  constexpr Index kCapacity = 1000;
  std::mt19937 random(1);
  const auto share = [&] { return std::uniform_real_distribution<double>()(random); };
  Deaths deaths(kCapacity);
  std::vector<double> list;
  std::vector<Index> due, wanted;
  Index told = 0;
  double now = 0;
  for (int tick = 0; tick < 5000; ++tick) {
    // Long and short lives, for ever; crowds that come and go, so that blocks empty and fill.
    const bool crowded = tick / 500 % 2 == 0;
    for (int births = int(share() * (crowded ? 30 : 3)); births > 0 && Index(list.size()) < kCapacity; --births) {
      const double kind = share();
      const double death = kind < 0.05 ? kNever : now + (kind < 0.5 ? 300 : 20) * share();
      deaths.set(Index(list.size()), death);
      list.push_back(death);
    }
    const auto remove = [&](Index i) {
      list[std::size_t(i)] = list.back();
      list.pop_back();
      if (i < Index(list.size())) deaths.set(i, list[std::size_t(i)]);
    };
    // Some go before their time.
    if (!list.empty() && share() < 0.2) remove(Index(share() * double(list.size())));
    if (share() < 0.01) {
      deaths.shift(-7);
      for (double& death : list) death -= 7;
    }
    if (tick % 500 == 499)
      while (list.size() > 40) remove(Index(share() * double(list.size())));
    now += 1;
    due.clear(), wanted.clear();
    for (Index i = 0; i < Index(list.size()); ++i)
      if (list[std::size_t(i)] <= now) wanted.push_back(i);
    deaths.take(now, Index(list.size()), due);
    ASSERT_EQ(due, wanted) << "tick " << tick;
    for (std::size_t i = due.size(); i-- > 0;) remove(due[i]);
    told += Index(due.size());
    for (Index i = 0; i < Index(list.size()); ++i) ASSERT_EQ(deaths[i], list[std::size_t(i)]);
  }
  EXPECT_GT(told, 10'000);
}

template <class S>
class DeathsOf : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(DeathsOf, Scalars);

// Births by hand with lives of random length, some ticks taken back and done again.
TYPED_TEST(DeathsOf, ASystemAreThoseOfAListThatIsSearched) {
  ParticleSettings settings;
  settings.capacity = 700, settings.tile = 32;
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<TypeParam>>(settings));
  struct Life {
    std::int64_t birth;  // in ticks
    double seconds;
  };
  std::map<std::uint64_t, Life> model;  // by serial
  std::mt19937 random(2);
  const auto share = [&] { return std::uniform_real_distribution<double>()(random); };
  constexpr double kTick = 1.0 / 240;
  std::int64_t died = 0;
  for (std::int64_t tick = 0; tick < 4000; ++tick) {
    for (int births = int(share() * 8); births > 0; --births) {
      Birth birth = thrown(Vec3::Zero(), Vec3(1, 0, 0));
      const double kind = share();
      // A third lives for whole ticks.
      birth.lifetime = kind < 0.02 ? kNever : kind < 0.35 ? kTick * (1 + std::floor(200 * share())) : share();
      if (system.size() == settings.capacity) break;
      system.add(birth);
      model[system.serial(system.size() - 1)] = {tick, birth.lifetime};
    }
    if (tick % 7 == 3) {
      Tick again;
      again.start = world.time(), again.end = again.start + kTick;
      const std::string before = bytes(system);
      ASSERT_TRUE(system.advance(again).good());
      system.take_back();
      ASSERT_EQ(bytes(system), before);
    }
    ASSERT_TRUE(world.update(kTick).good());
    died += Index(std::erase_if(model, [&](const auto& each) {
      return each.second.seconds <= (double(tick + 1 - each.second.birth) + 1e-6) * kTick;
    }));
    ASSERT_EQ(system.size(), Index(model.size())) << "tick " << tick;
    ASSERT_EQ(system.counts().died, died);
    for (Index i = 0; i < system.size(); ++i) {
      const auto life = model.find(system.serial(i));
      ASSERT_NE(life, model.end()) << "tick " << tick;
      if (life->second.seconds < kNever) {
        ASSERT_NEAR(system.age(i), double(tick + 1 - life->second.birth) * kTick, 1e-12);
      }
    }
  }
  EXPECT_GT(died, 5000);
}

// Time is not summed up: after minutes it is as good as in the first tick.
TYPED_TEST(DeathsOf, TheOldComeAtTheirTick) {
  ParticleSettings settings;
  settings.capacity = 8;
  World world;
  auto& system = world.add(std::make_unique<ParticleSystem<TypeParam>>(settings));
  const double lives[] = {600 - 1.5 / 240, 600 - 1e-6, 600, 600 + 1e-6, 600 + 1.5 / 240, 1e4};
  for (const double life : lives) {
    Birth birth = thrown(Vec3::Zero(), Vec3::Zero());
    birth.lifetime = life;
    system.add(birth);
  }
  Index expected[] = {6, 5, 3, 2, 1};  // after so many ticks, from the second before ten minutes on
  ASSERT_TRUE(world.update(600 - 2.0 / 240).good());
  for (const Index alive : expected) {
    EXPECT_EQ(system.size(), alive);
    EXPECT_NEAR(system.age(system.size() - 1), world.time(), 1e-9);
    ASSERT_TRUE(world.update(1.0 / 240).good());
  }
}

// A system ages in the ticks that move it: from its own first tick, before it in the prewarm, never while its physics
// is off.
TYPED_TEST(DeathsOf, WhoStandsStillStaysYoung) {
  World world;
  ASSERT_TRUE(world.update(100).good());
  ParticleSettings settings;
  settings.prewarm = 0.25;
  auto& system = world.add(std::make_unique<ParticleSystem<TypeParam>>(settings));
  Birth birth = thrown(Vec3::Zero(), Vec3::Zero());
  birth.lifetime = 1;
  system.add(birth);
  EXPECT_EQ(system.age(0), 0);
  ASSERT_TRUE(world.update(0.5).good());
  EXPECT_NEAR(system.age(0), 0.75, 1e-12);
  system.set_physics(false);
  ASSERT_TRUE(world.update(5).good());
  system.set_physics(true);
  EXPECT_NEAR(system.age(0), 0.75, 1e-12);
  ASSERT_TRUE(world.update(59.0 / 240).good());
  EXPECT_NEAR(system.age(0), 0.75 + 59.0 / 240, 1e-12);
  ASSERT_TRUE(world.update(1.0 / 240).good());
  EXPECT_EQ(system.size(), 0);
}

}  // namespace
}  // namespace hooke::particles
