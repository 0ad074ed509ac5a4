#include "particles.hpp"

#include "rounds.hpp"
#include "yardstick.hpp"

#include <hooke/particles/particle_system.hpp>
#include <hooke/world.hpp>

#include <cmath>
#include <memory>

namespace hooke::bench {

namespace {

using namespace hooke::particles;

constexpr double kTickRate = 240;
constexpr double kDrag = 0.1;  // [1/s], per kg

struct Setting {
  Index count = 1'000'000;
  int substeps = 1;
  std::function<void(ParticleSettings&)> settings = [](ParticleSettings&) {};
  std::function<void(ParticleSystem<float>&)> modules = [](ParticleSystem<float>&) {};
  std::function<void(World&)> world = [](World&) {};
  bool drag = true, floor = true, ages = true;
};

// Particles in a hall of 10 m: they fall, are braked, bounce on the floor and age.
std::unique_ptr<World> hall(const Setting& setting, ParticleSystem<float>*& system) {
  auto world = std::make_unique<World>(kTickRate);
  ParticleSettings settings;
  settings.capacity = setting.count;
  settings.dt = 1 / kTickRate / setting.substeps;
  // A scene that is drawn at ticks alone.
  settings.keeps_previous = false;
  setting.settings(settings);
  system = &world->add(std::make_unique<ParticleSystem<float>>(settings));
  if (setting.drag) system->add_force(std::make_unique<LinearDrag<float>>(kDrag));
  setting.modules(*system);
  if (setting.floor) {
    Collider floor;
    floor.name = "floor", floor.shapes = {HalfSpace{}}, floor.friction = 0.3, floor.restitution = 0.5;
    world->add_collider(floor);
  }
  setting.world(*world);
  EmitterSettings emitter;
  emitter.source = BoxSource{Vec3(5, 4.9, 5)}, emitter.position = Vec3(0, 5, 0), emitter.spread = 3.1,
  emitter.speed = {0, 3};
  if (setting.ages) emitter.lifetime = 1e4;
  emitter.bursts = {{0, setting.count, 0}};
  system->add_emitter(emitter);
  world->update(1 / kTickRate);
  return world;
}

Contender ticks_of(World& world, int ticks) {
  return {[&world, ticks] {
            const double begin = wall_seconds();
            world.update(ticks / kTickRate);
            return (wall_seconds() - begin) / ticks;
          },
          {}};
}

// Half a second of free fall with drag: how far from the closed form the same settings are.
double error_of(int substeps) {
  World world(kTickRate);
  ParticleSettings settings;
  settings.dt = 1 / kTickRate / substeps;
  auto& system = world.add(std::make_unique<ParticleSystem<float>>(settings));
  system.add_force(std::make_unique<LinearDrag<float>>(kDrag));
  Birth birth;
  birth.velocity = Vec3(3, 0, 0);
  system.add(birth);
  constexpr double t = 0.5;
  world.update(t);
  const double lost = 1 - std::exp(-kDrag * t);
  const Vec3 exact(3 / kDrag * lost, 9.81 / kDrag * (lost / kDrag - t), 0);
  return (Vec3(system.positions().row(0).matrix().transpose()) - exact).norm();
}

}  // namespace

Table particle_pipeline(bool quick) {
  Table table("particles",
              "Particles: gravity, drag, floor and age through the pipeline, float, against reading and writing "
              "positions, velocities and ages",
              {"particles", "threads", "substeps a tick", "pipeline [ns]", "read-modify-write [ns]", "times faster",
               "of the least", "error after 0.5 s [m]"});
  for (const Index count : {Index(1'000'000), Index(10'000'000)}) {
    if (quick && count > 1'000'000) continue;
    for (const int substeps : {1, 8})
      for (const int threads : {1, 2}) {
        Setting setting;
        setting.count = count, setting.substeps = substeps;
        ParticleSystem<float>* system = nullptr;
        const auto world = hall(setting, system);
        world->set_threads(threads);
        Gang gang(threads);
        // The system's own arrays, and one more: an age that is counted.
        std::vector<float> life(std::size_t(count), 1);
        const auto x = system->state_positions();
        const auto v = system->state_velocities();
        float* arrays[7];
        for (int k = 0; k < 3; ++k) {
          arrays[k] = const_cast<float*>(x.col(k).data());
          arrays[3 + k] = const_cast<float*>(v.col(k).data());
        }
        arrays[6] = life.data();
        const int repeats = count > 1'000'000 ? 2 : 8;
        const auto memory = [&] {
          const double begin = wall_seconds();
          for (int r = 0; r < repeats; ++r)
            gang.run([&](int i) {
              const long first = long(count) * i / threads / 64 * 64;
              const long last = i + 1 == threads ? long(count) : long(count) * (i + 1) / threads / 64 * 64;
              read_modify_write(arrays, first, last);
            });
          return (wall_seconds() - begin) / repeats;
        };
        std::vector<Contender> turns{ticks_of(*world, repeats), {memory, {}}};
        take_turns(turns, quick ? 5 : 11);
        // A substep against a pass over the memory.
        for (double& time : turns[0].times) time /= substeps;
        const Ratio ratio = times_faster(turns[0], turns[1]);
        table.add({int(count),
                   threads,
                   substeps,
                   {1e9 * turns[0].least() / double(count), "%.3f"},
                   {1e9 * turns[1].least() / double(count), "%.3f"},
                   {ratio.median, "%.2f"},
                   {ratio.least, "%.2f"},
                   {error_of(substeps), "%.1e"}},
                  threads);
      }
  }
  table.note(
      "Times are wall time, the least of the rounds, a particle and substep. \"times faster\" is the median of the "
      "ratios of "
      "neighbouring runs: 0.9 means that a substep takes 1/0.9 of a read-modify-write of seven arrays, positions, "
      "velocities and ages. The "
      "pipeline passes over six of them: it keeps times of death and looks at those whose time has come.");
  return table;
}

Table particle_modules(bool quick) {
  Table table("particle-modules", "What each module costs: 200,000 particles, float, one thread, one substep a tick",
              {"scene", "ns a particle and tick", "more than bare [ns]"});
  struct Case {
    const char* name;
    Setting setting;
  };
  const auto bare = [] {
    Setting s;
    s.count = 200'000, s.drag = s.floor = s.ages = false;
    return s;
  };
  std::vector<Case> cases;
  const auto add = [&](const char* name, const auto& change) {
    Setting s = bare();
    change(s);
    cases.push_back({name, s});
  };
  add("bare: gravity", [](Setting&) {});
  add("all switched off: drag of 0, colliders ignored, no lifetime", [](Setting& s) {
    s.modules = [](auto& system) { system.add_force(std::make_unique<LinearDrag<float>>(0)); };
    s.settings = [](auto& settings) { settings.collides = false; };
    s.floor = true;
  });
  add("age", [](Setting& s) { s.ages = true; });
  add("linear drag", [](Setting& s) { s.drag = true; });
  add("floor", [](Setting& s) { s.floor = true; });
  add("linear drag, floor, age", [](Setting& s) { s.drag = s.floor = s.ages = true; });
  add("… and a copy for interpolation", [](Setting& s) {
    s.drag = s.floor = s.ages = true;
    s.settings = [](auto& settings) { settings.keeps_previous = true; };
  });
  add("quadratic drag", [](Setting& s) {
    s.modules = [](auto& system) { system.add_force(std::make_unique<QuadraticDrag<float>>(0.01)); };
  });
  add("attractor", [](Setting& s) {
    s.modules = [](auto& system) { system.add_force(std::make_unique<Attractor<float>>(Vec3::Zero(), 1, 0.1)); };
  });
  add("vortex", [](Setting& s) {
    s.modules = [](auto& system) {
      system.add_force(
          std::make_unique<FlowDrag<float>>(std::make_unique<Vortex<float>>(Vec3::Zero(), Vec3(0, 1, 0), 1, 0.1), 2));
    };
  });
  add("turbulence", [](Setting& s) {
    s.modules = [](auto& system) {
      system.add_force(
          std::make_unique<FlowDrag<float>>(std::make_unique<CurlNoise<float>>(CurlNoise<float>::Settings{}), 2));
    };
  });
  add("sphere that nobody meets", [](Setting& s) {
    s.world = [](World& world) {
      Collider ball;
      ball.shapes = {Sphere{Vec3(0, 50, 0), 1}};
      world.add_collider(ball);
    };
  });
  add("sphere of 1 m in their midst", [](Setting& s) {
    s.world = [](World& world) {
      Collider ball;
      ball.shapes = {Sphere{Vec3(0, 5, 0), 1}};
      world.add_collider(ball);
    };
  });
  add("floor, impact times solved", [](Setting& s) {
    s.floor = true;
    s.settings = [](auto& settings) { settings.exact_impacts = true; };
  });
  add("runge-kutta 4 through the core",
      [](Setting& s) { s.settings = [](auto& settings) { settings.method = &rk4(); }; });
  std::vector<std::unique_ptr<World>> worlds;
  std::vector<Contender> turns;
  for (const Case& each : cases) {
    ParticleSystem<float>* system = nullptr;
    worlds.push_back(hall(each.setting, system));
    turns.push_back(ticks_of(*worlds.back(), 4));
  }
  take_turns(turns, quick ? 5 : 15);
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double each = 1e9 / double(cases[i].setting.count);
    table.add(
        {cases[i].name, {each * turns[i].least(), "%.2f"}, {each * (turns[i].least() - turns[0].least()), "%.2f"}});
  }
  table.note("Wall time, the least of the rounds, all scenes in turn.");
  return table;
}

}  // namespace hooke::bench
