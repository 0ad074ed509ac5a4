#include "measure.hpp"

#include "rivals.hpp"

#include <hooke/error.hpp>
#include <hooke/method.hpp>
#include <hooke/softbody/filtered_leapfrog.hpp>
#include <hooke/softbody/xpbd.hpp>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace hooke::report {

using scene::Solver;
using scene::StandardScene;
using softbody::Precision;

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::pair<Precision, const char*> kPrecisions[] = {
    {Precision::Float, "float"}, {Precision::Double, "double"}, {Precision::DoubleFloat, "double-float"}};
// Farther than this many sizes of the scene from where it should be, a run has blown up.
constexpr double kBlownUp = 10;

double duration_tick(const StandardScene& scene) { return scene.duration / scene.ticks; }

Points<double> positions_of(const World& world) {
  Index n = 0;
  for (const auto& body : world.bodies()) n += body->size();
  Points<double> out(n, 3);
  n = 0;
  for (const auto& body : world.bodies()) {
    out.middleRows(n, body->size()) = body->positions();
    n += body->size();
  }
  return out;
}

double rms(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().sum() / double(a.rows()));
}

double worst(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().rowwise().sum().maxCoeff());
}

// What drifts are told relative to.
struct Scales {
  double kinetic = 0;   // greatest kinetic energy [J]
  double momentum = 0;  // [kg m/s]
};

// Energy and momentum on the way.
class Watch {
 public:
  Watch(const StandardScene& scene, const World& world, const Scales& scales)
      : scene_(scene), scales_(scales), energy_(world.energy().total()), momentum_(world.momentum()) {
    for (const auto& body : world.bodies()) mass_ += body->total_mass();
  }
  void look(const World& world) {
    const Energy energy = world.energy();
    kinetic_ = std::max(kinetic_, energy.kinetic);
    drift_ = std::max(drift_, std::abs(energy.total() - energy_));
    const Vec3 fallen = mass_ * world.time() * world.gravity();
    momentum_drift_ = std::max(momentum_drift_, (world.momentum() - momentum_ - fallen).norm());
  }
  void tell(Row& row) const {
    row.energy_drift = scene_.conservative ? drift_ / scales_.kinetic : kUnknown;
    row.momentum_drift = scene_.free ? momentum_drift_ / scales_.momentum : kUnknown;
  }
  Scales scales() const { return {kinetic_, std::sqrt(2 * mass_ * kinetic_)}; }

 private:
  const StandardScene& scene_;
  Scales scales_;
  double energy_, mass_ = 0, kinetic_ = 0, drift_ = 0, momentum_drift_ = 0;
  Vec3 momentum_;
};

Outcome run(const StandardScene& scene, const Solver& solver, const Scales& scales, int copies = 0,
            double limit = std::numeric_limits<double>::infinity()) {
  Outcome out;
  if (copies > 0) {
    std::vector<World> worlds;
    for (int i = 0; i < copies; ++i) worlds.push_back(scene.build(solver));
    const double begin = cpu_seconds();
    for (World& world : worlds) world.update(scene.duration);
    out.cpu = (cpu_seconds() - begin) / copies;
    return out;
  }
  World world = scene.build(solver);
  StepReport report;
  Watch watched(scene, world, scales);
  double steps = 0;
  for (int tick = 0; tick < scene.ticks && report.good(); ++tick) {
    if (out.cpu > 0.01 && out.cpu * scene.ticks / tick > limit) {  // it will take too long
      out.cut = true;
      return out;
    }
    const double begin = cpu_seconds();
    report = world.update(duration_tick(scene));
    out.cpu += cpu_seconds() - begin;
    if (report.good()) watched.look(world);
    steps += double(world.bodies()[0]->motion_facts().substeps);
  }
  out.positions = positions_of(world);
  watched.tell(out.row);
  out.row.dt = world.time() > 0 ? world.time() / steps : solver.dt;
  for (const auto& body : world.bodies()) {
    const MotionFacts facts = body->motion_facts();
    out.row.evaluations += double(facts.evaluations + facts.products);
  }
  if (report.status == StepReport::Status::NotFinite || report.status == StepReport::Status::EnergyGrew)
    out.row.status = "blow-up";
  if (report.status == StepReport::Status::NotConverged) out.row.status = "not converged";
  return out;
}

// Steps a tick at the method's stability limit, by velocity Verlet's where it has none.
int coarsest(const World& world, const Method& method, double tick) {
  double stable = std::numeric_limits<double>::infinity();
  for (const auto& body : world.bodies()) {
    const double limit = body->stable_step(method);
    stable = std::min(stable, limit > 0 ? limit : body->stable_step(velocity_verlet()));
  }
  return stable >= tick ? 1 : int(std::ceil(tick / stable));
}

Solver solver_of(const Method& method, Precision precision, double dt) {
  Solver solver;
  solver.method = std::string(method.name);
  solver.precision = precision;
  solver.dt = dt;
  return solver;
}

// Every method in every precision that takes the scene. The first level is twice the limit, where it should fail, or
// one step a tick where there is no limit.
std::vector<Series> contenders(const StandardScene& scene, const Scales& scales, double size,
                               std::vector<std::string>& notes) {
  std::vector<Series> out;
  std::vector<const Method*> every(methods().begin(), methods().end());
  every.push_back(&softbody::filtered_leapfrog());  // for grids alone
  every.push_back(&softbody::xpbd());               // for soft bodies alone
  for (const Method* method : every)
    for (const auto& entry : kPrecisions) {
      const Precision precision = entry.first;
      const std::string precision_name = entry.second;
      const double tick = duration_tick(scene);
      int first = 1;
      try {
        const World world = scene.build(solver_of(*method, precision, tick));
        first = coarsest(world, *method, tick);
      } catch (const std::exception& refusal) {
        notes.push_back(std::string(method->name) + " in " + precision_name + ": " + refusal.what());
        continue;
      }
      const auto add = [&](const std::function<Solver(int)>& solver) {
        Series series;
        series.name = std::string(method->name) + ", " + precision_name;
        series.run = [scene, scales, solver, name = std::string(method->name), precision_name](int level, int copies,
                                                                                               double limit) {
          const Solver now = solver(level);
          Outcome outcome = run(scene, now, scales, copies, limit);
          outcome.row.method = name;
          outcome.row.precision = precision_name;
          if (now.wanted_error > 0) {
            outcome.row.setting = "stiffness lowered as an error allows";
            outcome.row.tolerance = now.wanted_error;
          } else if (now.dt == 0) {
            outcome.row.tolerance = now.tolerance;
          }
          return outcome;
        };
        out.push_back(std::move(series));
      };
      if (method == &softbody::filtered_leapfrog())
        add([method, precision, size](int level) {
          Solver solver = solver_of(*method, precision, 0);
          solver.wanted_error = 0.1 * size * std::pow(0.5, level);
          return solver;
        });
      if (method->adaptive()) {
        add([method, p = precision, size](int level) {
          Solver solver = solver_of(*method, p, 0);
          solver.tolerance = 0.01 * size * std::pow(0.1, level);
          return solver;
        });
        continue;
      }
      add([method, p = precision, tick, first](int level) {
        const double steps = first > 1 ? std::ceil(0.5 * first) * std::pow(2.0, level) : std::pow(2.0, level);
        return solver_of(*method, p, tick / steps);
      });
    }
  return out;
}

// The answer by two methods of high order, each refined until it stops changing or its share of the budget is spent.
Reference refined(const StandardScene& scene, const Scales& scales, double size, double budget) {
  struct Answer {
    const Method* method = nullptr;
    Points<double> points{0, 3};
    double dt = 0, difference = kUnknown;
  };
  std::vector<Answer> answers;
  for (const char* name : {"blanes-moan-6", "rk4", "dormand-prince", "velocity-verlet"}) {
    const auto known =
        std::find_if(methods().begin(), methods().end(), [&](const Method* m) { return m->name == name; });
    if (known == methods().end() || answers.size() == 2) continue;
    Answer answer;
    answer.method = *known;
    const double tick = duration_tick(scene);
    try {
      int steps = coarsest(scene.build(solver_of(**known, Precision::Double, tick)), **known, tick);
      double spent = 0, last = 0;
      for (int level = 0; level < 14; ++level, steps *= 2) {
        if (level >= 2 && spent + 2 * last > budget / 2) break;
        const Outcome outcome = run(scene, solver_of(**known, Precision::Double, tick / steps), scales);
        if (!outcome.row.ok()) continue;
        spent += last = outcome.cpu;
        const Points<double> now = compared(scene, outcome.positions);
        const double difference = answer.points.rows() ? rms(now, answer.points) : kUnknown;
        // Once rounding takes over, the next finer step is worse.
        if (difference > answer.difference && difference < 1e-9 * size) break;
        answer.points = now, answer.dt = tick / steps, answer.difference = difference;
        if (difference < 1e-13 * size) break;
      }
    } catch (const std::exception&) {
      continue;  // it does not accept the scene
    }
    if (answer.points.rows() && std::isfinite(answer.difference)) answers.push_back(std::move(answer));
  }
  if (answers.size() < 2) throw Error(scene.name + ": no two methods agree to make a reference");
  if (answers[1].difference < answers[0].difference) std::swap(answers[0], answers[1]);
  const auto& [a, b] = std::pair(answers[0], answers[1]);
  Reference out;
  out.answer = a.points;
  out.step_difference = a.difference;
  out.method_difference = rms(a.points, b.points);
  char text[500];
  std::snprintf(text, sizeof text,
                "%s in double at dt = %.3g s, which differs from twice that step by %.2g m (RMS), and from %s at dt = "
                "%.3g s (itself settled to %.2g m) by %.2g m.",
                std::string(a.method->name).c_str(), a.dt, a.difference, std::string(b.method->name).c_str(), b.dt,
                b.difference, out.method_difference);
  out.text = text;
  return out;
}

Reference reference_of(const StandardScene& scene, const Scales& scales, double size, double budget) {
  if (!scene.exact) return refined(scene, scales, size, budget);
  Reference out;
  out.answer = compared(scene, scene.exact(scene.duration));
  out.text = "Closed form.";
  return out;
}

// Compares, and repeats what was short.
Row judged(const Series& series, int level, Outcome outcome, const SceneReport& report, const Effort& effort,
           double& spent) {
  Row row = std::move(outcome.row);
  row.repeats = 1;
  double least = outcome.cpu, used = outcome.cpu;
  if (row.ok() && !outcome.positions.allFinite()) row.status = "blow-up";
  if (row.ok()) {
    const Points<double> now = compared(report.scene, outcome.positions);
    row.rms = rms(now, report.reference.answer);
    row.worst = worst(now, report.reference.answer);
    if (!(row.worst < kBlownUp * report.size)) row.status = "blow-up";
  }
  if (!row.ok()) {
    row.rms = row.worst = row.energy_drift = row.momentum_drift = row.seconds = kUnknown;
    spent += used;
    return row;
  }
  // A watched run reads the clock every tick: where that matters it is not counted. Short runs are timed in
  // bunches, for the clock is coarse.
  constexpr double kLong = 0.02, kBunch = 5e-4;
  bool counted = outcome.cpu > kLong;
  const int copies = int(std::clamp(kBunch / std::max(outcome.cpu, 1e-9), 1.0, 50.0));
  while (!counted || (used + least < effort.repeat && row.repeats < 400)) {
    const double again = series.run(level, copies, 0).cpu;
    least = counted ? std::min(least, again) : again;
    counted = true;
    used += copies * again;
    row.repeats += copies;
  }
  row.seconds = least / report.scene.duration;
  spent += used;
  return row;
}

}  // namespace

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

Points<double> compared(const StandardScene& scene, const Points<double>& positions) {
  if (scene.compare == StandardScene::Compare::Points) return positions;
  Points<double> out(2, 3);
  out.row(0) = positions.colwise().mean();
  out.row(1) = (positions.rowwise() - out.row(0)).square().colwise().mean().sqrt();
  return out;
}

SceneReport measure(const StandardScene& scene, const Effort& wanted,
                    const std::function<void(double done)>& progress) {
  Effort effort = wanted;
  if (scene.large) effort.budget *= 3;
  SceneReport report;
  report.scene = scene;
  // A first look for scales that no method under test decides.
  Scales scales;
  {
    const double tick = duration_tick(scene);
    World world = scene.build(solver_of(velocity_verlet(), Precision::Double, tick));
    const int steps = 2 * coarsest(world, velocity_verlet(), tick);
    world = scene.build(solver_of(velocity_verlet(), Precision::Double, tick / steps));
    const Points<double> start = positions_of(world);
    Watch watch(scene, world, {1, 1});
    for (int i = 0; i < scene.ticks && world.update(tick).good(); ++i) watch.look(world);
    scales = watch.scales();
    const Points<double> end = positions_of(world);
    report.points = start.rows();
    const Vec3 low = start.colwise().minCoeff().min(end.colwise().minCoeff()).matrix().transpose();
    const Vec3 high = start.colwise().maxCoeff().max(end.colwise().maxCoeff()).matrix().transpose();
    report.size = (high - low).norm();
  }
  report.reference = reference_of(scene, scales, report.size, effort.budget);
  progress(0.1);

  std::vector<Series> all = contenders(scene, scales, report.size, report.notes);
  if (const auto plain = plain_springs(scene)) {
    report.springs = Index(plain->springs.size());
    for (const auto& more : {yardstick(*plain), bullet_classic(*plain)})
      all.insert(all.end(), more.begin(), more.end());
  }

  // The next run is always that of the series with the least time so far: whatever the budget, all get the
  // same stretch of the time axis.
  struct State {
    int level = 0;
    double spent = 0, last_cpu = 0, best = std::numeric_limits<double>::infinity();
    int idle = 0;  // levels since it got better
    bool done = false, cut = false;
    std::vector<Row> rows;
  };
  std::vector<State> states(all.size());
  double spent = 0;
  const double floor = std::max(report.reference.uncertainty(), 1e-14 * report.size);
  for (;;) {
    std::size_t i = all.size();
    for (std::size_t k = 0; k < all.size(); ++k)
      if (!states[k].done && (i == all.size() || states[k].spent < states[i].spent)) i = k;
    if (i == all.size()) break;
    State& state = states[i];
    const double most = std::min(effort.budget / 8, effort.budget - spent);
    bool too_long = 2 * state.last_cpu > most;
    if (!too_long) {
      Outcome outcome = all[i].run(state.level, 0, most);
      state.last_cpu = outcome.cpu;
      double used = outcome.cpu;
      too_long = outcome.cut;
      if (!outcome.cut) {
        used = 0;
        state.rows.push_back(judged(all[i], state.level, std::move(outcome), report, effort, used));
        const Row& row = state.rows.back();
        state.idle = row.ok() && row.rms > 0.7 * state.best ? state.idle + 1 : 0;
        if (row.ok()) state.best = std::min(state.best, row.rms);
        state.done = row.ok() && (row.rms <= floor || (state.idle >= 2 && state.best < 1e-2 * report.size));
      }
      state.spent += used, spent += used;
      if (++state.level == all[i].levels) state.done = true;
      progress(0.1 + 0.9 * std::min(1.0, spent / effort.budget));
    }
    if (too_long) state.done = state.cut = true;
  }
  for (State& state : states) report.rows.insert(report.rows.end(), state.rows.begin(), state.rows.end());
  std::string cut;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (states[i].cut) cut += (cut.empty() ? "" : "; ") + all[i].name;
  if (!cut.empty()) report.notes.push_back("The budget ended these before their errors did: " + cut + ".");
  progress(1);
  return report;
}

}  // namespace hooke::report
