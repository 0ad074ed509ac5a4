// Measures Hooke against a yardstick, against its own size and against its own features.
// What it shows and how to read it: docs/benchmarks.md.
//
//   speed_bench [--quick] [--out FOLDER] [CASE...]    CASE: kernel accuracy threads size features checks filtered
//                                                   particles particle-modules
#include "particles.hpp"
#include "rounds.hpp"
#include "sheet.hpp"
#include "table.hpp"

#include <hooke/error.hpp>
#include <hooke/io/output_file.hpp>
#include <hooke/method.hpp>
#include <hooke/point_body.hpp>
#include <hooke/softbody/filtered_leapfrog.hpp>
#include <hooke/softbody/lattice.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace hooke::bench {
namespace {

constexpr double kDuration = 0.5;  // [s]; the sheet is chaotic after 1 s
constexpr double kTickRate = 60;

struct Effort {
  bool quick = false;
  int rounds() const { return quick ? 5 : 9; }
};

const char* text_of(Precision precision) { return precision == Precision::Float ? "float" : "double"; }

const Method& method_of(const std::string& name) {
  for (const Method* method : methods())
    if (method->name == name) return *method;
  throw std::invalid_argument("no method is called " + name);
}

SoftBodySettings moved_by(SoftBodySettings settings, const Method& method, Precision precision, double dt) {
  settings.motion.method = &method;
  settings.motion.dt = dt;
  settings.precision = precision;
  return settings;
}

struct Run {
  double seconds = 0;  // processor time
  Points<double> positions{0, 3};
  bool good = true;
};

// The sheet from rest to kDuration. Building it is not timed.
Run run(const SoftBodySettings& settings, int threads = 1) {
  World world = world_of(settings, kTickRate);
  world.set_threads(threads);
  Run out;
  const double begin = cpu_seconds();
  out.good = world.update(kDuration).good();
  out.seconds = cpu_seconds() - begin;
  out.positions = world.bodies()[0]->positions();
  return out;
}

// Where the sheet is after kDuration, in double.
struct Reference {
  Points<double> positions{0, 3};
  double uncertainty = 0;  // [m]: how far it moved when its step was halved
};

Reference converged(const SoftBodySettings& sheet) {
  const Method& method = method_of("blanes-moan-6");
  double dt = 0.9 * world_of(sheet).bodies()[0]->stable_step(method);
  Reference out;
  out.positions = run(moved_by(sheet, method, Precision::Double, dt)).positions;
  for (int halvings = 0; halvings < 3; ++halvings) {
    dt /= 2;
    const Points<double> finer = run(moved_by(sheet, method, Precision::Double, dt)).positions;
    out.uncertainty = rms(finer, out.positions);
    out.positions = finer;
    if (out.uncertainty < 1e-8) break;
  }
  return out;
}

Contender ours(const SoftBodySettings& settings) {
  return {[settings] { return run(settings).seconds; }, {}};
}

Contender yardstick(const PlainSheet& sheet, Precision precision, int steps, double duration = kDuration) {
  const auto plain_sheet = std::make_shared<PlainSheet>(sheet);
  return {[=] {
            return precision == Precision::Float ? run_yardstick<float>(*plain_sheet, steps, duration).seconds
                                                 : run_yardstick<double>(*plain_sheet, steps, duration).seconds;
          },
          {}};
}

double yardstick_error(const PlainSheet& sheet, Precision precision, int steps, const Points<double>& reference) {
  return rms(precision == Precision::Float ? run_yardstick<float>(sheet, steps, kDuration).positions
                                           : run_yardstick<double>(sheet, steps, kDuration).positions,
             reference);
}

// The stepper of a sheet from rest to kDuration in one go: what the yardstick does, without a body around it.
template <class S>
class Kernel {
 public:
  Kernel(const SoftBodySettings& sheet, int steps)
      : field_(sheet.network, sheet.positions.cast<S>()), stepper_(field_.stepper()) {
    start_.position = sheet.positions.cast<S>();
    start_.velocity = Points<S>::Zero(start_.position.rows(), 3);
    start_.mass = sheet.masses.cast<S>();
    start_.inverse_mass = start_.mass.inverse();
    for (const Index pin : sheet.pins) start_.inverse_mass[pin] = 0;
    const double h = kDuration / steps;
    stages_.assign(std::size_t(steps), {h, h});
    stages_.front().kick = h / 2;
    stages_.push_back({h / 2, 0});
  }

  Run run() const {
    LowParts<S> low;
    PointMasses<S> end = start_;
    stepper_->load(start_, {}, {0, -9.81, 0}, nullptr);
    Run out;
    const double begin = cpu_seconds();
    stepper_->run(stages_, nullptr);
    out.seconds = cpu_seconds() - begin;
    stepper_->store(end, low);
    out.positions = end.position.template cast<double>();
    return out;
  }

 private:
  softbody::SpringField<S> field_;
  std::unique_ptr<Stepper<S>> stepper_;
  PointMasses<S> start_;
  std::vector<Stage> stages_;
};

Run run_kernel(const SoftBodySettings& sheet, Precision precision, int steps) {
  return precision == Precision::Float ? Kernel<float>(sheet, steps).run() : Kernel<double>(sheet, steps).run();
}

// 1. The same steps as the yardstick's.
Table kernel(const Effort& effort) {
  const int n = 64, steps = int(std::lround(kDuration / yardstick_step(n)));
  struct Case {
    const char* name;
    SoftBodySettings sheet;
    PlainSheet plain_sheet;
    Points<double> answer;
    bool alone = false;  // the kernel without ticks
  };
  std::vector<Case> cases;
  const Reference reference = converged(hanging_sheet(n));
  for (const auto& [form, name] :
       {std::pair{Form::Grid, "grid"}, {Form::Shuffled, "shuffled grid"}, {Form::Mesh, "mesh"}}) {
    const SoftBodySettings sheet = hanging_sheet(n, form);
    cases.push_back(
        {name, sheet, plain(sheet), form == Form::Grid ? reference.positions : shuffle(reference.positions)});
  }
#ifdef HOOKE_BENCH_HAS_HIGHWAY
  for (std::size_t i = 0; i < 3; i += 2) {
    cases.push_back(cases[i]);
    cases.back().name = i == 0 ? "grid, kernel alone" : "mesh, kernel alone", cases.back().alone = true;
  }
#endif
  Table table("kernel",
              "Kernel: hanging sheet, 64 × 64, velocity Verlet at the yardstick's steps of 1/2880 s, one thread",
              {"sheet", "precision", "Hooke, ns per spring and step", "error after 0.5 s, m",
               "yardstick, ns per spring and step", "its error, m", "times faster (median of pairs)",
               "times faster (least times)"});
  for (const Precision precision : {Precision::Float, Precision::Double}) {
    const auto moved = [&](const Case& c) {
      return moved_by(c.sheet, velocity_verlet(), precision, yardstick_step(n));
    };
    std::vector<Contender> turns;
    const auto run_of = [&](const Case& c) { return c.alone ? run_kernel(c.sheet, precision, steps) : run(moved(c)); };
    for (const Case& c : cases) {
      turns.push_back({[&] { return run_of(c).seconds; }, {}});
      turns.push_back(yardstick(c.plain_sheet, precision, steps));
    }
    take_turns(turns, effort.rounds());
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const Contender &mine = turns[2 * i], &other = turns[2 * i + 1];
      const Ratio ratio = times_faster(mine, other);
      const Case& c = cases[i];
      const double springs = double(c.sheet.network->springs.size());
      table.add({c.name,
                 text_of(precision),
                 {1e9 * mine.least() / springs / steps, "%.2f"},
                 {rms(run_of(c).positions, c.answer), "%.1e"},
                 {1e9 * other.least() / springs / steps, "%.2f"},
                 {yardstick_error(c.plain_sheet, precision, steps, c.answer), "%.1e"},
                 {ratio.median, "%.1f"},
                 {ratio.least, "%.1f"}});
    }
  }
  char text[200];
  std::snprintf(text, sizeof text,
                "Reference: Blanes-Moan 6 in double; halving its step last moved it by %.1e m. %d pairs.",
                reference.uncertainty, effort.rounds());
  table.note(text);
  table.note(
      "A sheet is a whole run of a world, with everything that its ticks look at; the kernel alone does what the "
      "yardstick does.");
  return table;
}

// 2. The cheapest way to a given error.
Table accuracy(const Effort& effort) {
  constexpr double kWanted = 1e-5;
  Table table("accuracy", "Time to accuracy: hanging sheet to an error of at most 1e-5 m after 0.5 s, one thread",
              {"N", "who", "method", "precision", "dt, s", "error, m", "seconds per simulated second",
               "share of the yardstick's time in float (median of pairs)", "the same (least times)"});
  for (const int n : {32, 64}) {
    const SoftBodySettings sheet = hanging_sheet(n);
    const PlainSheet plain_sheet = plain(sheet);
    const Reference reference = converged(sheet);
    struct Candidate {
      SoftBodySettings settings;
      double error, seconds;
    };
    std::vector<Candidate> found;
    double cheapest = INFINITY;
    const World probe = world_of(sheet);
    for (const char* name : {"velocity-verlet", "pefrl", "rkn4", "blanes-moan-4", "blanes-moan-6"})
      for (const Precision precision : {Precision::Float, Precision::Double}) {
        const Method& method = method_of(name);
        const double tick = 1 / kTickRate, stable = probe.bodies()[0]->stable_step(method);
        int last = 0;
        for (const double share : {1.1, 1.0, 0.95, 0.9, 0.8, 0.65, 0.5}) {
          const int substeps = int(std::ceil(tick / (share * stable)));
          if (substeps == last) continue;
          last = substeps;
          const SoftBodySettings settings = moved_by(sheet, method, precision, tick / substeps);
          Run best = run(settings);
          if (!best.good) continue;
          // Shorter steps of this method only cost more.
          if (!found.empty() && best.seconds > 2 * cheapest) break;
          const double error = rms(best.positions, reference.positions);
          if (!(error <= kWanted)) continue;
          for (int i = 0; i < 2; ++i) best.seconds = std::min(best.seconds, run(settings).seconds);
          found.push_back({settings, error, best.seconds});
          cheapest = std::min(cheapest, best.seconds);
        }
      }
    std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) { return a.seconds < b.seconds; });
    if (found.size() > 3) found.resize(3);

    const int steps = int(std::lround(kDuration / yardstick_step(n)));
    std::vector<Contender> turns{yardstick(plain_sheet, Precision::Float, steps),
                                 yardstick(plain_sheet, Precision::Double, steps)};
    for (const Candidate& candidate : found) turns.push_back(ours(candidate.settings));
    take_turns(turns, effort.rounds());
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const Ratio ratio = times_faster(turns[0], turns[i]);
      const double seconds = turns[i].least() / kDuration;
      if (i < 2) {
        const Precision precision = i ? Precision::Double : Precision::Float;
        table.add({n,
                   "yardstick",
                   "velocity-verlet",
                   text_of(precision),
                   {yardstick_step(n), "%.3e"},
                   {yardstick_error(plain_sheet, precision, steps, reference.positions), "%.1e"},
                   {seconds, "%.4f"},
                   {ratio.median, "%.3f"},
                   {ratio.least, "%.3f"}});
      } else {
        const Candidate& c = found[i - 2];
        table.add({n,
                   "Hooke",
                   std::string(c.settings.motion.method->name),
                   text_of(c.settings.precision),
                   {c.settings.motion.dt, "%.3e"},
                   {c.error, "%.1e"},
                   {seconds, "%.4f"},
                   {ratio.median, "%.3f"},
                   {ratio.least, "%.3f"}});
      }
    }
    if (found.empty()) table.note("N = " + std::to_string(n) + ": none of Hooke's runs came to 1e-5 m.");
  }
  table.note("Hooke: the three cheapest of 5 methods, 2 precisions and 7 steps around each one's stability limit.");
  return table;
}

// A world that goes on from tick to tick, ns of wall or processor time each.
struct Stretch {
  World world;
  int steps = 0;  // a tick
  explicit Stretch(SoftBodySettings settings, double dt, int steps_a_tick, bool plain = false)
      : world(1 / (dt * steps_a_tick)), steps(steps_a_tick) {
    settings.motion.dt = dt;
    // The kernels of the precision: sheets in float that begin at rest are stepped in double for a while otherwise.
    if (plain) settings.motion.compensated = false;
    world.add(softbody::make_soft_body(settings));
  }
  double tick_length() const { return 1 / world.clock().tick_rate(); }
  void go(int ticks) {
    if (!world.update(ticks * tick_length() * (1 + 1e-9)).good()) throw Error("a benchmark's run blew up");
  }
};

// 3. Threads that share one sheet.
Table threads(const Effort& effort) {
  const int processors = std::max(1, int(std::thread::hardware_concurrency()));
  std::vector<int> counts{2};
  if (processors >= 4) counts.push_back(4);
  Table table("threads", "Threads: hanging sheet, velocity Verlet in float, wall-clock time",
              {"N", "run", "ns per spring and step", "times faster than one thread (median of rounds)",
               "times faster (least times)", "same bits as one thread"});
  for (const int n : effort.quick ? std::vector<int>{64, 128, 256} : std::vector<int>{64, 128, 256, 316, 512}) {
    const double dt = 0.8 * yardstick_step(n);
    const SoftBodySettings sheet = moved_by(hanging_sheet(n), velocity_verlet(), Precision::Float, dt);
    const double springs = double(sheet.network->springs.size());
    // Ticks of a sixtieth of a second up to N = 128; then shorter ones.
    const int steps = std::min(96, 3 * n / 4), ticks = std::max(1, int(std::lround(0.04 / (1e-9 * springs * steps))));
    std::vector<std::unique_ptr<Stretch>> stretches;
    for (std::size_t i = 0; i < counts.size() + 3; ++i) {
      stretches.push_back(std::make_unique<Stretch>(sheet, dt, steps, true));
      if (i >= 3) stretches.back()->world.set_threads(counts[i - 3]);
    }
    const auto timed = [&](Stretch& stretch) {
      return Contender{[&stretch, ticks] {
                         const double begin = wall_seconds();
                         stretch.go(ticks);
                         return wall_seconds() - begin;
                       },
                       {}};
    };
    std::vector<Contender> turns{timed(*stretches[0])};
    // Two sheets that share nothing: what the machine can give. Counted as the time of one.
    turns.push_back({[&stretches, ticks] {
                       const double begin = wall_seconds();
                       std::thread other([&] { stretches[2]->go(ticks); });
                       stretches[1]->go(ticks);
                       other.join();
                       return (wall_seconds() - begin) / 2;
                     },
                     {}});
    for (std::size_t i = 0; i < counts.size(); ++i) turns.push_back(timed(*stretches[i + 3]));
    for (Contender& turn : turns) turn.run();  // first touch of everything
    take_turns(turns, effort.rounds() + 2);
    const Body& one = *stretches[0]->world.bodies()[0];
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const Body& body = *stretches[i == 0 ? 0 : i + 1]->world.bodies()[0];
      const bool same = (body.positions() == one.positions()).all() && (body.velocities() == one.velocities()).all();
      const Ratio ratio = times_faster(turns[i], turns[0]);
      const int used = i == 0 ? 1 : i == 1 ? 2 : counts[i - 2];
      table.add({n,
                 i == 1 ? "two sheets side by side, one thread each"
                        : std::to_string(used) + (used > 1 ? " threads" : " thread"),
                 {1e9 * turns[i].least() / springs / steps / ticks, "%.2f"},
                 {ratio.median, "%.2f"},
                 {ratio.least, "%.2f"},
                 i == 0 ? "-"
                 : same ? "yes"
                        : "NO"},
                used);
      if (!same) throw Error("threads changed the bits of a sheet of N = " + std::to_string(n));
    }
  }
  table.note(
      "Two sheets side by side are this machine's ceiling for two threads: they share nothing but its memory and "
      "its caches. Their time is that of a sheet: half of both.");
  return table;
}

// 4. What a spring costs in sheets of any size.
Table size(const Effort& effort) {
  Table table("size", "Size: ns per spring and step, velocity Verlet, one thread",
              {"N", "points", "springs", "grid, float", "grid, double", "yardstick, grid, float", "mesh, float",
               "mesh, double", "yardstick, mesh, float"});
  for (int n = 16; n <= (effort.quick ? 256 : 1024); n *= 2) {
    const double dt = 0.8 * yardstick_step(n);
    std::vector<std::unique_ptr<Stretch>> stretches;
    std::vector<Contender> turns;
    std::vector<double> work;  // springs × steps of a turn
    Index points = 0, springs = 0;
    const auto add = [&](int steps, const auto& contender) {
      const int ticks = std::max(1, int(std::lround(0.005 / (1e-9 * double(springs) * steps))));
      work.push_back(double(springs) * steps * ticks);
      turns.push_back(contender(ticks));
    };
    for (const Form form : {Form::Grid, Form::Mesh}) {
      const SoftBodySettings sheet = hanging_sheet(n, form);
      points = sheet.positions.rows(), springs = Index(sheet.network->springs.size());
      // What a tick does besides its steps is a part of what they cost. Meshes and the yardstick are too slow for that.
      const int few = n <= 128   ? 48
                      : n <= 512 ? 24
                                 : 12,
                steps = form == Form::Grid ? int(std::ceil(1 / (60 * dt))) : few;
      for (const Precision precision : {Precision::Float, Precision::Double}) {
        stretches.push_back(
            std::make_unique<Stretch>(moved_by(sheet, velocity_verlet(), precision, dt), dt, steps, true));
        add(steps, [s = stretches.back().get()](int ticks) {
          return Contender{[s, ticks] {
                             const double begin = cpu_seconds();
                             s->go(ticks);
                             return cpu_seconds() - begin;
                           },
                           {}};
        });
      }
      add(few, [&](int ticks) { return yardstick(plain(sheet), Precision::Float, ticks * few, ticks * few * dt); });
    }
    for (Contender& turn : turns) turn.run();  // first touch
    take_turns(turns, n < 512 ? effort.rounds() : 3);
    std::vector<Cell> cells{n, int(points), int(springs)};
    for (std::size_t i = 0; i < turns.size(); ++i) cells.push_back({1e9 * turns[i].least() / work[i], "%.2f"});
    table.add(cells);
  }
  table.note("Least of " + std::to_string(effort.rounds()) +
             " rounds, of 3 from N = 512; grids in ticks of a sixtieth of a second, the others in ticks of 12 to 48 "
             "steps; the "
             "same step for all.");
  return table;
}

// 5. What a feature costs, and that one that is absent costs nothing.
Table features(const Effort& effort) {
  const int n = 64, steps = 64;  // a tick
  constexpr int kTicks = 8;      // a round
  const double dt = 1 / kTickRate / steps;
  const SoftBodySettings sheet = hanging_sheet(n);
  const double springs = double(sheet.network->springs.size());
  struct Case {
    std::string name;
    std::function<void(SoftBodySettings&)> body = [](SoftBodySettings&) {};
    std::function<void(World&)> world = [](World&) {};
  };
  const auto dampers = [](double ratio) {
    return [ratio](SoftBodySettings& s) {
      softbody::SpringNetwork network = *s.network;
      for (softbody::Spring& spring : network.springs)
        spring.damping = softbody::damping_of_ratio(ratio, spring.stiffness, s.masses[spring.a], s.masses[spring.b]);
      s.network = std::make_shared<const softbody::SpringNetwork>(std::move(network));
    };
  };
  const auto wind = [](bool once) {
    return [once](SoftBodySettings& s) {
      softbody::Wind air;
      air.velocity = {0, 0, -2};
      air.once_a_tick = once;
      s.wind = air;
    };
  };
  const auto floor = [](double height) {
    return [height](World& world) { world.add_collider({"floor", {HalfSpace{{0, 1, 0}, height}}, {}, {}, 0.3, 0}); };
  };
  const auto none = [](SoftBodySettings&) {};
  const std::vector<Case> cases{
      {"plain sheet"},
      {"all switched off: dampers and drag of 0, global damping 0, a collider that the sheet ignores",
       [&](SoftBodySettings& s) {
         dampers(0)(s);
         s.linear_drag = s.quadratic_drag = 0;
         s.motion.collides = false;
       },
       [&](World& world) {
         world.set_damping(0);
         floor(-0.3)(world);
       }},
      {"global damping, 10 % a second", none, [](World& world) { world.set_damping(0.1); }},
      {"wind, held for a tick", wind(true)},
      {"linear drag", [](SoftBodySettings& s) { s.linear_drag = 1e-5; }},
      {"quadratic drag", [](SoftBodySettings& s) { s.quadratic_drag = 1e-6; }},
      {"dampers, 1 % of critical", dampers(0.01)},
      {"wind, at every step", wind(false)},
      {"pins driven", none,
       [&](World& world) {
         world.bodies()[0]->drive_pins(sheet.pins, [start = sheet](double t, Points<double>& out) {
           for (std::size_t i = 0; i < start.pins.size(); ++i) {
             out.row(Index(i)) = start.positions.row(start.pins[i]);
             out(Index(i), 2) += 0.05 * std::sin(6 * t);
           }
         });
       }},
      {"a collider out of reach", none, floor(-20)},
      {"a collider in contact (the lower half of the sheet lies in it at the start)", none, floor(-0.35)},
      {"plain sheet once more"}};
  std::vector<std::unique_ptr<Stretch>> stretches;
  std::vector<Contender> turns;
  for (const Case& each : cases) {
    SoftBodySettings settings = moved_by(sheet, velocity_verlet(), Precision::Float, dt);
    each.body(settings);
    stretches.push_back(std::make_unique<Stretch>(settings, dt, steps));
    each.world(stretches.back()->world);
    turns.push_back({[s = stretches.back().get()] {
                       const double begin = cpu_seconds();
                       s->go(kTicks);
                       return cpu_seconds() - begin;
                     },
                     {}});
  }
  take_turns(turns, effort.rounds());
  Table table("features",
              "Features, one at a time: hanging sheet, 64 × 64, velocity Verlet in float, 64 steps a tick, one thread",
              {"sheet with", "ns per spring and step", "times the plain sheet's cost (median of rounds)",
               "the same (least times)"});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Ratio ratio = times_faster(turns[0], turns[i]);
    table.add({cases[i].name,
               {1e9 * turns[i].least() / springs / (kTicks * steps), "%.2f"},
               {ratio.median, "%.2f"},
               {ratio.least, "%.2f"}});
  }
  return table;
}

// 6. Large sheets at steps that do not shrink with them.
Table filtered(const Effort& effort) {
  constexpr double kWanted = 1e-2;  // [m]
  Table table(
      "filtered",
      "Filtered leapfrog with a wanted error of 1e-2 m, float, one thread, 60 ticks a second, against leapfrog "
      "softened as far as that error allows",
      {"N", "filtered: step, s", "stiffness", "error, m", "seconds per simulated second", "ns per spring and step",
       "leapfrog: stiffness", "its error, m", "seconds per simulated second (leapfrog)",
       "times faster (median of pairs)", "times faster (least times)"});
  struct Cost {
    double n, filtered, plain;
  };
  std::vector<Cost> costs;
  for (const int n : effort.quick ? std::vector<int>{64, 128} : std::vector<int>{64, 128, 256, 316, 512}) {
    const SoftBodySettings sheet = hanging_sheet(n);
    // Errors here are of millimetres: a reference of velocity Verlet near its limit is sure to a hundredth of that.
    const Points<double> reference =
        run(moved_by(sheet, velocity_verlet(), n < 512 ? Precision::Double : Precision::Float, 0.8 * yardstick_step(n)),
            int(std::max(1u, std::thread::hardware_concurrency())))
            .positions;
    SoftBodySettings coarse = moved_by(sheet, softbody::filtered_leapfrog(), Precision::Float, 0);
    coarse.wanted_error = kWanted;
    World probe = world_of(coarse, kTickRate);
    probe.update(1 / kTickRate);
    const softbody::FilteredFacts facts = *softbody::filtered_facts(*probe.bodies()[0]);
    const double error = rms(run(coarse).positions, reference);
    std::vector<Contender> turns{ours(coarse)};
    double factor = NAN, plain_error = NAN;
    if (n <= 256) {
      // The least stiffness that comes to the wanted error, by bisection.
      const auto soft = [&](double f) {
        const SoftBodySettings out = softened(sheet, f);
        const double stable = world_of(out).bodies()[0]->stable_step(velocity_verlet());
        return moved_by(out, velocity_verlet(), Precision::Float, 0.95 * stable);
      };
      double low = 0.05, high = 1;
      for (int i = 0; i < 8; ++i) {
        const double middle = std::sqrt(low * high);
        const double there = rms(run(soft(middle)).positions, reference);
        if (there <= kWanted)
          high = middle, plain_error = there;
        else
          low = middle;
      }
      factor = high;
      turns.push_back(ours(soft(factor)));
    }
    take_turns(turns, n < 256 ? effort.rounds() : 5);
    const double mine = turns[0].least() / kDuration;
    const bool both = turns.size() > 1;
    const Ratio ratio = both ? times_faster(turns[0], turns[1]) : Ratio{NAN, NAN};
    const double theirs = both ? turns[1].least() / kDuration : NAN;
    table.add({n,
               {facts.step, "%.2e"},
               {facts.stiffness_scale, "× %.2f"},
               {error, "%.1e"},
               {mine, "%.4f"},
               {1e9 * mine * facts.step / double(sheet.network->springs.size()), "%.2f"},
               {factor, "× %.2f"},
               {plain_error, "%.1e"},
               {theirs, "%.4f"},
               {ratio.median, "%.1f"},
               {ratio.least, "%.1f"}});
    costs.push_back({double(n), mine, theirs});
  }
  // Slope of log cost over log N by least squares.
  const auto exponent = [&](double Cost::*of) {
    double k = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const Cost& cost : costs) {
      if (!std::isfinite(cost.*of)) continue;
      const double a = std::log(cost.n), b = std::log(cost.*of);
      k += 1, x += a, y += b, xx += a * a, xy += a * b;
    }
    return (k * xy - x * y) / (k * xx - x * x);
  };
  char text[200];
  std::snprintf(text, sizeof text, "Cost grows as N^%.2f with filtered leapfrog and as N^%.2f with leapfrog.",
                exponent(&Cost::filtered), exponent(&Cost::plain));
  table.note(text);
  return table;
}

// 7. What every tick is looked at for: numbers that are not finite, energy from nowhere, rest.
Table checks(const Effort& effort) {
  struct Case {
    std::string name;
    SoftBodySettings body;
    double damping = 0;
  };
  std::vector<Case> cases;
  for (const int n : {16, 32, 64, 128}) {
    SoftBodySettings sheet = hanging_sheet(n);
    sheet.motion.method = &velocity_verlet();
    for (const Precision precision : {Precision::Float, Precision::Double}) {
      sheet.precision = precision;
      const std::string name = std::to_string(n) + " x " + std::to_string(n) + ", ";
      cases.push_back({name + (precision == Precision::Float ? "float" : "double"), sheet});
    }
  }
  softbody::FixedLatticeMaterial jelly;
  jelly.stiffness = 2000;
  cases.push_back({"jelly, 10 x 10 x 10, damped, float",
                   softbody::settings_of(softbody::lattice_from_box({0.2, 0.2, 0.2}, {10, 10, 10}, jelly))});
  cases.back().body.precision = Precision::Float;
  Table table(
      "checks",
      "What every tick is looked at for: bodies in the air at 0.9 of their largest stable step, 60 ticks a second, one "
      "thread",
      {"body", "substeps a tick", "microseconds a tick", "one pass over the velocities [microseconds]",
       "share of a tick", "times the cost without watches and sleep (median of rounds)"});
  for (const Case& each : cases) {
    const int ticks = std::max(2, 64 * 1024 / int(each.body.positions.rows()));
    const auto world_of = [&](bool looks) {
      auto world = std::make_unique<World>(kTickRate);
      SoftBodySettings settings = each.body;
      // The same steps whether it looks or not.
      settings.motion.dt = 0.9 * softbody::make_soft_body(settings)->stable_step(velocity_verlet());
      settings.motion.sleeps = settings.motion.watches_energy = looks;
      world->add(softbody::make_soft_body(settings));
      world->update(0.1);  // the start of a motion is looked at more often
      return world;
    };
    const auto looks = world_of(true), blind = world_of(false);
    const auto run = [&](World& world) {
      return Contender{[&world, ticks] {
                         const double begin = cpu_seconds();
                         world.update(ticks / kTickRate * (1 + 1e-9));
                         return (cpu_seconds() - begin) / ticks;
                       },
                       {}};
    };
    const auto pass = [&](const auto& body) {
      return Contender{[&body, ticks] {
                         double sum = 0;
                         const double begin = cpu_seconds();
                         for (int i = 0; i < 8 * ticks; ++i) {
                           sum += body.state().kinetic_energy();
                           asm volatile("" : : "g"(&sum) : "memory");
                         }
                         return (cpu_seconds() - begin) / (8 * ticks);
                       },
                       {}};
    };
    const Body& body = *looks->bodies()[0];
    const auto* single = dynamic_cast<const PointBody<float>*>(&body);
    std::vector<Contender> turns{run(*looks), run(*blind),
                                 single ? pass(*single) : pass(dynamic_cast<const PointBody<double>&>(body))};
    take_turns(turns, effort.rounds());
    table.add({each.name,
               int(body.motion_facts().substeps),
               {1e6 * turns[0].least(), "%.2f"},
               {1e6 * turns[2].least(), "%.3f"},
               {turns[2].least() / turns[0].least(), "%.4f"},
               {1 / times_faster(turns[0], turns[1]).median, "%.3f"}});
  }
  table.note(
      "The pass finds what is not finite, tells rest and whether energy must be looked at; it is made whether watches "
      "are on or off.");
  return table;
}

struct NamedCase {
  const char* name;
  Table (*measure)(const Effort&);
};
constexpr NamedCase kCases[] = {
    {"kernel", kernel},
    {"accuracy", accuracy},
    {"threads", threads},
    {"size", size},
    {"features", features},
    {"checks", checks},
    {"filtered", filtered},
    {"particles", [](const Effort& effort) { return particle_pipeline(effort.quick); }},
    {"particle-modules", [](const Effort& effort) { return particle_modules(effort.quick); }}};

int main(int argc, char** argv) {
  Effort effort;
  std::string out = ".";
  std::vector<std::string> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool known = std::any_of(std::begin(kCases), std::end(kCases), [&](auto& c) { return argument == c.name; });
    if (argument == "--quick") {
      effort.quick = true;
    } else if (argument == "--out" && i + 1 < argc) {
      out = argv[++i];
    } else if (known) {
      wanted.push_back(argument);
    } else {
      std::fprintf(stderr,
                   "speed_bench: what is \"%s\"?\nusage: speed_bench [--quick] [--out FOLDER] [CASE...]\ncases:",
                   argument.c_str());
      for (const NamedCase& each : kCases) std::fprintf(stderr, " %s", each.name);
      std::fprintf(stderr, "\n");
      return 2;
    }
  }
  const Machine machine = this_machine();
  std::printf("%s\n", machine.text().c_str());
  io::make_folder(out);
  for (const NamedCase& each : kCases) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), each.name) == wanted.end()) continue;
    const double begin = wall_seconds();
    const Table table = each.measure(effort);
    table.print();
    table.write(out, machine);
    std::fprintf(stderr, "(%s: %.1f s)\n", each.name, wall_seconds() - begin);
  }
  return 0;
}

}  // namespace
}  // namespace hooke::bench

int main(int argc, char** argv) {
  try {
    return hooke::bench::main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "speed_bench: %s\n", error.what());
    return 1;
  }
}
