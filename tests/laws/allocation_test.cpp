// No allocation in a step: once a world runs, it asks for no memory.
#ifdef HOOKE_TESTS_PARTICLES
#include <hooke/particles/particle_system.hpp>
#endif
#include <hooke/softbody/soft_body.hpp>
#include <hooke/world.hpp>

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

// Every request for memory is counted, by operator new and by Eigen alike. Sanitizers bring a malloc of their own.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HOOKE_COUNTS_ALLOCATIONS
namespace {
std::atomic<long> requests{0};
}
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t size) { return requests++, __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return requests++, __libc_calloc(count, size); }
void* realloc(void* before, std::size_t size) { return requests++, __libc_realloc(before, size); }
void* memalign(std::size_t alignment, std::size_t size) { return requests++, __libc_memalign(alignment, size); }
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  return (*out = memalign(alignment, size)) ? 0 : ENOMEM;
}
}
#endif

namespace hooke::test {
namespace {

#ifdef HOOKE_COUNTS_ALLOCATIONS

using softbody::Precision;
using softbody::SoftBodySettings;

struct Case {
  const char* name;
  double damping_ratio = 0;
  void (*body)(SoftBodySettings&) = [](SoftBodySettings&) {};
  void (*world)(World&) = [](World&) {};
};

class NoAllocation : public testing::TestWithParam<Case> {};

TEST(Counter, SeesNewAndEigen) {
  const long before = requests;
  const auto by_new = std::make_unique<double>(1);
  EXPECT_EQ(requests, before + 1) << by_new.get();
  const Points<double> by_eigen = Points<double>::Zero(100, 3);
  EXPECT_EQ(requests, before + 2) << by_eigen(0, 0);
}

// The automatic step's estimates, thirty a second, are among what is counted.
TEST_P(NoAllocation, WhileAWorldRuns) {
  for (const Precision precision : {Precision::Float, Precision::Double})
    for (const double tick_rate : {60.0, 240.0}) {
      softbody::ClothMaterial material;
      material.damping_ratio = {GetParam().damping_ratio, GetParam().damping_ratio, GetParam().damping_ratio};
      SoftBodySettings settings =
          softbody::settings_of(softbody::cloth_from_grid(1, 1, 20, 20, {1, 0, 0}, {0, -1, 0.2}, material));
      for (Index i = 0; i < 20; ++i) settings.pins.push_back(i);
      settings.precision = precision;
      GetParam().body(settings);
      World world(tick_rate);
      world.add(softbody::make_soft_body(settings));
      GetParam().world(world);
      ASSERT_TRUE(world.update(1).good());
      const long before = requests;
      for (int frame = 0; frame < 30; ++frame) world.update(1.0 / 60);
      EXPECT_EQ(requests - before, 0) << "in half a second, " << (precision == Precision::Float ? "float" : "double")
                                      << ", " << tick_rate << " ticks a second";
      EXPECT_NEAR(world.time(), 1.5, 1.0 / 60);
    }
}

const Case kCases[] = {Case{"Undamped"},
                       Case{"Damped", 0.05},
                       Case{"FixedStep", 0, [](SoftBodySettings& s) { s.motion.dt = 1e-4; }},
                       Case{"Mesh", 0,
                            [](SoftBodySettings& s) {  // no grid: one spring across
                              auto network = *s.network;
                              network.springs.push_back({0, 399, 1});
                              s.network = std::make_shared<const softbody::SpringNetwork>(network);
                            }},

                       Case{"Drag", 0,
                            [](SoftBodySettings& s) {
                              s.linear_drag = 1e-4;
                              s.quadratic_drag = 1e-4;
                            }},
                       Case{"GlobalDamping", 0, [](SoftBodySettings&) {}, [](World& world) { world.set_damping(0.2); }},

                       Case{"DrivenPins", 0.05, [](SoftBodySettings&) {},
                            [](World& world) {
                              world.bodies()[0]->drive_pins(
                                  {0, 1}, [](double t, Points<double>& x) { x << 0, 0.01 * t, 0, 0.05, 0.01 * t, 0; });
                            }},
                       Case{"Wind", 0.05,
                            [](SoftBodySettings& s) {
                              s.triangles = {{0, 1, 20}, {1, 21, 20}, {210, 211, 230}};
                              s.wind = softbody::Wind{.velocity = {0, 0, 3}};
                            }},
                       Case{"Contact", 0.05, [](SoftBodySettings&) {},
                            [](World& world) {
                              Collider ball;
                              ball.name = "ball", ball.shapes = {Sphere{{0, -0.6, -0.1}, 0.3}};
                              world.add_collider(ball);
                            }},
                       Case{"TwoThreads", 0, [](SoftBodySettings&) {}, [](World& world) { world.set_threads(2); }}};

INSTANTIATE_TEST_SUITE_P(Laws, NoAllocation, testing::ValuesIn(kCases),
                         [](const auto& test) { return test.param.name; });

#ifdef HOOKE_TESTS_PARTICLES
// Ten minutes of jets that fall on a ball and into a basin: as many drops at the end as at the start, and no memory.
TEST(NoAllocationOf, AFountainForTenMinutes) {
  using namespace particles;
  World world;
  Collider floor, ball;
  floor.name = "floor", floor.shapes = {HalfSpace{}}, floor.restitution = 0.3;
  ball.name = "ball", ball.shapes = {Sphere{{0, 0.2, 0}, 0.3}}, ball.restitution = 0.2;
  world.add_collider(floor), world.add_collider(ball);
  ParticleSettings settings;
  settings.capacity = 2000;
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add_force(std::make_unique<particles::LinearDrag<float>>(0.05));
  EmitterSettings jet;
  jet.position = {0, 0.6, 0}, jet.spread = 0.15, jet.speed = {4, 5}, jet.rate = 300, jet.lifetime = {1, 2};
  system.add_emitter(jet);
  SubEmitterSettings splash;
  splash.on = SubEmitterSettings::On::Impact, splash.count = {1, 2}, splash.least_impact = 2, splash.lifetime = 0.3;
  system.add_sub_emitter(splash);
  ASSERT_TRUE(world.update(20).good());
  const long before = requests;
  Index least = system.size();
  double first = 0, last = 0;  // mean counts of the first and the last two minutes
  for (int second = 20; second < 600; ++second) {
    ASSERT_TRUE(world.update(1).good());
    least = std::min(least, system.size());
    if (second < 140) first += double(system.size()) / 120;
    if (second >= 480) last += double(system.size()) / 120;
  }
  EXPECT_EQ(requests - before, 0);
  EXPECT_GT(least, 500);
  EXPECT_NEAR(last / first, 1, 0.02) << first << " to " << last;
  EXPECT_EQ(system.counts().refused, 0);
  const Counts& counts = system.counts();
  EXPECT_EQ(counts.born - counts.died, system.size());
}
#endif

#endif

}  // namespace
}  // namespace hooke::test
