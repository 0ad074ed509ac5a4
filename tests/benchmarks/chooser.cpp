// Runs the chooser on random scenes and compares what it picks with every other row: did it meet the wanted
// error, and what did it cost beside the cheapest row that does. Prints a table and a summary.
//
//   chooser_bench [--first SEED] [--scenes COUNT] [--work SECONDS] [--csv FILE]
//
// A fifth of the scenes is so stiff that velocity Verlet takes up to five times `work`, with coarse wanted errors.
// What seeds the chooser was tuned on is told in docs/chooser.md. Costs are counted force evaluations times the
// chooser's cost table; processor time is told beside them.
#include <hooke/softbody/choose_solver.hpp>
#include <hooke/softbody/spring_field.hpp>
#include <hooke/softbody/xpbd.hpp>
#include <hooke/world.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <random>
#include <set>
#include <string>

namespace {

using namespace hooke;
using namespace hooke::softbody;

struct RandomScene {
  std::string kind;
  SoftBodySettings body;
  Vec3 gravity{0, 0, 0};
  double duration = 0, wanted = 0, size = 0;
  int ticks = 8;
  bool damped = false, stiff = false;
};

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double in(double low, double high) { return low + (high - low) * (double(engine_()) / 4294967296.0); }
  double log(double low, double high) { return low * std::pow(high / low, in(0, 1)); }
  int whole(int low, int high) { return std::min(high, low + int(in(0, 1) * (high - low + 1))); }
  bool chance(double p) { return in(0, 1) < p; }

 private:
  std::mt19937 engine_;
};

double size_of(const Points<double>& x) {
  return std::sqrt((x.colwise().maxCoeff() - x.colwise().minCoeff()).square().sum());
}

// Scene `seed`, whose run by velocity Verlet in float takes up to `work` seconds by the cost table.
RandomScene make_scene(unsigned seed, double work) {
  Dice dice(seed * 7919u + 12345u);
  RandomScene s;
  SpringNetwork net;
  const double L = dice.log(0.3, 3), mass = dice.log(0.03, 3) * L * L;
  const double stiffness = dice.log(30, 3e4);
  Points<double>& x = s.body.positions;
  const int kind = dice.whole(0, 9);
  std::vector<Index> top;
  const auto spring = [&](int a, int b, double k) {
    Spring out;
    out.a = a, out.b = b, out.stiffness = k;
    out.rest_length = (x.row(a) - x.row(b)).matrix().norm();
    net.springs.push_back(out);
  };
  if (kind <= 5) {  // a grid
    s.kind = "grid";
    const int rows = int(std::lround(dice.log(12, 64))),
              columns = dice.chance(0.5) ? rows : int(std::lround(dice.log(8, 64)));
    x.resize(rows * columns, 3);
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) x.row(r * columns + c) << L * c / (rows - 1), -L * r / (rows - 1), 0;
    const double shear = stiffness * dice.in(0.05, 0.6), bend = stiffness * dice.in(0.0, 0.1);
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        const int i = r * columns + c;
        if (c + 1 < columns) spring(i, i + 1, stiffness);
        if (r + 1 < rows) spring(i, i + columns, stiffness);
        if (r + 1 < rows && c + 1 < columns) spring(i, i + columns + 1, shear), spring(i + 1, i + columns, shear);
        if (c + 2 < columns) spring(i, i + 2, bend);
        if (r + 2 < rows) spring(i, i + 2 * columns, bend);
      }
    if (dice.chance(0.7))
      for (int c = 0; c < columns; ++c) s.body.pins.push_back(c);
    else
      s.body.pins = {0, columns - 1};
  } else if (kind == 6) {
    s.kind = "chain";
    const int n = dice.whole(30, 300);
    x.setZero(n, 3);
    for (int i = 0; i < n; ++i) x(i, 0) = L * i / (n - 1);
    for (int i = 0; i + 1 < n; ++i) spring(i, i + 1, stiffness * 10);
    s.body.pins = {0};
    if (dice.chance(0.5)) s.body.pins.push_back(n - 1);
  } else if (kind == 7) {
    s.kind = "box";
    const int a = dice.whole(4, 10), b = dice.whole(4, 10), c = dice.whole(4, 16);
    const double d = L / (c - 1);
    x.resize(a * b * c, 3);
    const auto at = [&](int i, int j, int k) { return (k * b + j) * a + i; };
    for (int k = 0; k < c; ++k)
      for (int j = 0; j < b; ++j)
        for (int i = 0; i < a; ++i) x.row(at(i, j, k)) << d * i, -d * k, d * j;
    for (int k = 0; k < c; ++k)
      for (int j = 0; j < b; ++j)
        for (int i = 0; i < a; ++i)
          for (int dk = 0; dk <= 1; ++dk)
            for (int dj = -1; dj <= 1; ++dj)
              for (int di = -1; di <= 1; ++di) {
                if (dk == 0 && (dj < 0 || (dj == 0 && di <= 0))) continue;
                if (std::abs(di) + std::abs(dj) + dk > 2) continue;
                const int i2 = i + di, j2 = j + dj, k2 = k + dk;
                if (i2 < 0 || j2 < 0 || i2 >= a || j2 >= b || k2 >= c) continue;
                spring(at(i, j, k), at(i2, j2, k2), stiffness);
              }
    for (int i = 0; i < a * b; ++i) s.body.pins.push_back(i);
  } else if (kind == 8) {
    s.kind = "mesh";
    const int n = int(std::lround(dice.log(10, 45)));
    TriangleMesh mesh;
    std::vector<int> order(std::size_t(n * n));
    for (int i = 0; i < n * n; ++i) order[std::size_t(i)] = i;
    for (int i = n * n - 1; i > 0; --i) std::swap(order[std::size_t(i)], order[std::size_t(dice.whole(0, i))]);
    Points<double> p(n * n, 3);
    const double d = L / (n - 1);
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c)
        p.row(order[std::size_t(r * n + c)]) << d * (c + dice.in(-0.25, 0.25)), -d * (r + dice.in(-0.25, 0.25)), 0;
    mesh.vertices = p;
    for (int r = 0; r + 1 < n; ++r)
      for (int c = 0; c + 1 < n; ++c) {
        const int q[4] = {order[std::size_t(r * n + c)], order[std::size_t(r * n + c + 1)],
                          order[std::size_t((r + 1) * n + c)], order[std::size_t((r + 1) * n + c + 1)]};
        if (dice.chance(0.5)) {
          mesh.triangles.push_back({q[0], q[2], q[1]}), mesh.triangles.push_back({q[1], q[2], q[3]});
        } else {
          mesh.triangles.push_back({q[0], q[2], q[3]}), mesh.triangles.push_back({q[0], q[3], q[1]});
        }
      }
    ClothMaterial material;
    material.density = mass / (L * L), material.stretch = stiffness, material.shear = stiffness * 0.2;
    material.bend = stiffness * 0.02;
    material.damping_ratio = {0, 0, 0};
    const Cloth cloth = cloth_from_mesh(mesh, material);
    x = cloth.positions, net = *cloth.network, s.body.masses = cloth.masses;
    const std::vector<double> rest = rest_lengths(net, x);
    for (std::size_t i = 0; i < rest.size(); ++i) net.springs[i].rest_length = rest[i];
    for (int c = 0; c < n; ++c) s.body.pins.push_back(order[std::size_t(c)]);
  } else {
    s.kind = "network";
    const int n = dice.whole(60, 1200);
    x.resize(n, 3);
    for (int i = 0; i < n; ++i) x.row(i) << L * dice.in(0, 1), L * dice.in(0, 1), L * dice.in(0, 1);
    std::set<std::pair<int, int>> seen;
    for (int i = 0; i < n; ++i) {
      std::vector<std::pair<double, int>> near;
      for (int j = 0; j < n; ++j)
        if (j != i) near.push_back({(x.row(i) - x.row(j)).matrix().squaredNorm(), j});
      std::partial_sort(near.begin(), near.begin() + 8, near.end());
      for (int m = 0; m < 8; ++m) {
        const int j = near[std::size_t(m)].second;
        if (seen.insert({std::min(i, j), std::max(i, j)}).second)
          spring(std::min(i, j), std::max(i, j), stiffness * dice.log(0.3, 3));
      }
    }
    for (int i = 0; i < n; ++i)
      if (x(i, 1) > 0.9 * L) s.body.pins.push_back(i);
  }
  const Index n = x.rows();
  if (s.body.masses.size() == 0) s.body.masses = Values<double>::Constant(n, mass / double(n));
  s.damped = dice.chance(0.15);
  if (s.damped) {
    const double ratio = dice.log(0.01, 0.3);
    for (Spring& sp : net.springs)
      sp.damping = damping_of_ratio(ratio, sp.stiffness, s.body.masses[sp.a], s.body.masses[sp.b]);
  }
  s.size = size_of(x);
  // Stretched along a direction of its own, and a smooth start velocity.
  if (dice.chance(0.4)) {
    const double stretch = dice.log(0.003, 0.15);
    const int axis = dice.whole(0, 1);
    x.col(axis) *= 1 + stretch;
  }
  if (dice.chance(0.3)) {
    s.body.velocities.setZero(n, 3);
    const double speed = dice.log(0.03, 1) * std::sqrt(9.81 * L);
    const double kx = dice.in(0.5, 3), ky = dice.in(0.5, 3);
    for (Index i = 0; i < n; ++i)
      s.body.velocities(i, 2) = speed * std::sin(kx * x(i, 0) / L * 3) * std::sin(ky * x(i, 1) / L * 3);
  }
  const double tilt = dice.in(0, 1.5707963), g = dice.chance(0.1) ? 0 : 9.81;
  s.gravity = {0, -g * std::cos(tilt), g * std::sin(tilt)};
  s.size = size_of(x);
  s.body.network = std::make_shared<SpringNetwork>(net);
  s.duration = dice.log(0.25, 2.0) * std::sqrt(L / 9.81);
  s.wanted = std::pow(10.0, dice.in(-7, -1));
  s.ticks = dice.whole(16, 60);
  // Stiffness, over up to four decades more, so that there is something to do.
  double target = dice.log(0.1 * work, work);
  s.stiff = dice.chance(0.2);
  if (s.stiff) target = dice.log(work, 5 * work), s.wanted = std::pow(10.0, dice.in(-3, -1));
  for (int pass = 0; pass < 2; ++pass) {
    s.body.network = std::make_shared<SpringNetwork>(net);
    SoftBodySettings probe = s.body;
    probe.precision = Precision::Double;
    const double h = 0.9 * make_soft_body(probe)->stable_step(velocity_verlet());
    const double seconds = SolverCost(s.body).seconds(velocity_verlet(), Precision::Float, s.duration / h);
    const double scale = std::clamp(target / seconds, 0.1, 100.0);
    if (pass == 0)
      for (Spring& sp : net.springs) sp.stiffness *= scale * scale, sp.damping *= scale;
    else if (seconds > target)
      s.duration *= target / seconds;
  }
  return s;
}

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

double rms(const Points<double>& a, const Points<double>& b) {
  const double e = std::sqrt((a - b).square().rowwise().sum().mean());
  return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

struct Run {
  Points<double> end{0, 3};
  double cpu = 0;
  double evaluations = 0;
  double seconds = 0;  // by the table, of implicit methods
  double speed = 0;    // RMS over points and ticks [m/s]
  bool good = true;
};

// With `cost` and `most` an implicit run gives up once it would cost more than that.
Run run(const RandomScene& scene, const Method& method, Precision precision, double substeps, double noise = 0,
        const ImplicitCost* cost = nullptr, double most = 0) {
  SoftBodySettings body = scene.body;
  const double tick = scene.duration / scene.ticks;
  body.motion.method = &method;
  body.motion.dt = tick / substeps;
  body.precision = precision;
  Dice dice(99);
  if (noise > 0)
    for (Index i = 0; i < body.positions.rows(); ++i)
      for (int k = 0; k < 3; ++k) body.positions(i, k) += noise * dice.in(-1, 1);
  World world(1 / tick);
  world.set_gravity(scene.gravity);
  Body& moved = world.add(make_soft_body(body));
  Run out;
  for (int i = 0; i < scene.ticks && out.good; ++i) {
    const double begin = cpu_seconds();
    out.good = world.update(tick).good();
    out.cpu += cpu_seconds() - begin;
    out.speed += moved.velocities().square().rowwise().sum().mean() / scene.ticks;
    if (!cost) continue;
    const MotionFacts facts = moved.motion_facts();
    out.seconds = cost->seconds(precision, double(facts.evaluations), double(facts.products), (i + 1) * substeps);
    out.good = out.good && out.seconds * scene.ticks <= most * (i + 1);
  }
  out.speed = std::sqrt(out.speed);
  out.end = moved.positions();
  out.evaluations = double(moved.motion_facts().evaluations);
  return out;
}

struct Row {
  const Method* method;
  Precision precision;
  double substeps, seconds;
};

const char* name_of(Precision p) { return p == Precision::Float ? "float" : "double"; }

// All methods that a step can be given to and that are stable undamped, but Verlet, which is velocity Verlet.
// Dormand-Prince costs ten times as much on such scenes (docs/methods/stiff.md); implicit methods have rows of their
// own, as their cost is known only once they have run.
std::vector<Row> rows_of(const RandomScene& scene, double speed) {
  const double tick = scene.duration / scene.ticks;
  SoftBodySettings settings = scene.body;
  settings.precision = Precision::Double;
  const auto body = make_soft_body(settings);
  const bool velocity = body->motion_facts().velocity_forces;
  const SolverCost cost(scene.body);
  std::vector<Row> out;
  const auto add = [&](const Method& method, double n) {
    for (const Precision p : {Precision::Float, Precision::Double})
      out.push_back({&method, p, n,
                     cost.seconds(method, p, evaluations_of(method, scene.ticks, n),
                                  rounding_shows(scene.body, tick / n, speed, scene.gravity.norm()))});
  };
  double fewest = 1;
  for (const Method* method :
       {&semi_implicit_euler(), &velocity_verlet(), &rk4(), &pefrl(), &rkn4(), &blanes_moan_4(), &blanes_moan_6()}) {
    if (velocity && !method->accepts_velocity_forces) continue;
    const double coarsest = std::max(1.0, std::ceil(tick / (0.9 * body->stable_step(*method)) - 1e-9));
    if (method == &velocity_verlet()) fewest = coarsest;
    for (int level = 0; level < 9; ++level) add(*method, coarsest * std::pow(2.0, level));
  }
  if (scene.kind == "grid")
    for (double n = 1; n < fewest; n *= 2) add(filtered_leapfrog(), n);
  for (double n = 1; n < fewest; n *= 2) add(xpbd(), n);
  std::stable_sort(out.begin(), out.end(), [](const Row& a, const Row& b) { return a.seconds < b.seconds; });
  return out;
}

// Finer and finer, until it changes by less than a twentieth of the wanted error.
bool reference(const RandomScene& scene, double error, Points<double>& answer, double& uncertainty) {
  SoftBodySettings settings = scene.body;
  settings.precision = Precision::Double;
  const auto body = make_soft_body(settings);
  const double tick = scene.duration / scene.ticks;
  const bool velocity = body->motion_facts().velocity_forces;
  Points<double> before{0, 3};
  const auto coarsest = [&](const Method& m) { return std::max(1.0, std::ceil(tick / (0.9 * body->stable_step(m)))); };
  std::vector<std::pair<const Method*, double>> steps;
  if (velocity)
    for (double f : {1, 2, 4, 8, 16, 32}) steps.push_back({&rk4(), f * coarsest(rk4())});
  else
    steps = {{&pefrl(), coarsest(pefrl())},
             {&blanes_moan_4(), coarsest(blanes_moan_4())},
             {&blanes_moan_6(), coarsest(blanes_moan_6())},
             {&blanes_moan_6(), 2 * coarsest(blanes_moan_6())},
             {&blanes_moan_6(), 4 * coarsest(blanes_moan_6())},
             {&blanes_moan_6(), 8 * coarsest(blanes_moan_6())}};
  for (const auto& [method, n] : steps) {
    const Run now = run(scene, *method, Precision::Double, n);
    if (!now.good) continue;
    uncertainty = before.rows() ? rms(now.end, before) : std::numeric_limits<double>::infinity();
    before = answer = now.end;
    if (uncertainty <= error / 20) return true;
  }
  return false;
}

struct Outcome {
  double error = 0;     // of the choice, over the wanted one
  double ratio = 0;     // its cost with the pilot over the cheapest row's
  double cheapest = 0;  // [s], modelled
  bool met = false, says_no = false, nothing_meets = false;
};

}  // namespace

int main(int argc, char** argv) {
  unsigned first = 1000;
  int wanted = 100;
  double work = 0.2;
  std::string csv_name;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    if (key == "--first") first = unsigned(std::atoi(argv[i + 1]));
    if (key == "--scenes") wanted = std::atoi(argv[i + 1]);
    if (key == "--work") work = std::atof(argv[i + 1]);
    if (key == "--csv") csv_name = argv[i + 1];
  }
  std::FILE* csv = csv_name.empty() ? nullptr : std::fopen(csv_name.c_str(), "w");
  if (csv)
    std::fprintf(csv,
                 "seed,kind,points,springs,duration,damped,stiff,growth,wanted,error,uncertainty,says,method,precision,"
                 "substeps,predicted,"
                 "run_s,pilot_s,cheapest_method,cheapest_precision,cheapest_substeps,cheapest_s,choice_cpu,choosing_"
                 "cpu,cheapest_cpu\n");
  std::vector<Outcome> outcomes;
  int chaotic = 0, unsettled = 0;
  for (unsigned seed = first; int(outcomes.size()) < wanted; ++seed) {
    const RandomScene scene = make_scene(seed, work);
    const double tick = scene.duration / scene.ticks, error = scene.wanted * scene.size;
    SoftBodySettings settings = scene.body;
    settings.precision = Precision::Double;
    const double n0 = std::max(1.0, std::ceil(tick / (0.9 * make_soft_body(settings)->stable_step(velocity_verlet()))));
    // Of the motion itself: velocity Verlet may be far from it.
    const double noise = 1e-9 * scene.size;
    const Method& judge = scene.damped ? rk4() : pefrl();
    const double growth =
        rms(run(scene, judge, Precision::Double, n0).end, run(scene, judge, Precision::Double, n0, noise).end) / noise;
    if (!(growth <= 100)) {
      ++chaotic;
      continue;
    }
    Points<double> answer;
    double uncertainty = 0;
    if (!reference(scene, error, answer, uncertainty)) {
      ++unsettled;
      continue;
    }
    RunSetting setting;
    setting.gravity = scene.gravity, setting.duration = scene.duration, setting.tick_rate = 1 / tick;
    double begin = cpu_seconds();
    const SolverChoice choice = choose_solver(scene.body, setting, scene.wanted);
    const double choosing_cpu = cpu_seconds() - begin;
    const Run ours = run(scene, *choice.method, choice.precision, double(choice.substeps));
    Outcome out;
    out.error = ours.good ? rms(ours.end, answer) / error : std::numeric_limits<double>::infinity();
    out.met = out.error <= 1;
    out.says_no = !choice.meets;
    // By the speed that it had; implicit methods as they were counted.
    const double cost_of_choice =
        choice.method == &implicit_euler()
            ? choice.seconds
            : SolverCost(scene.body)
                  .seconds(*choice.method, choice.precision, choice.evaluations,
                           rounding_shows(scene.body, choice.dt, ours.speed, scene.gravity.norm()));
    // The cheapest row that meets it. Rows dearer than ours are not looked at: ours then counts as the cheapest.
    std::map<std::pair<const Method*, Precision>, double> coarser;
    Row best{choice.method, choice.precision, double(choice.substeps), cost_of_choice};
    double best_cpu = ours.cpu;
    bool found = out.met;
    for (const Row& row : rows_of(scene, ours.speed)) {
      if (found && row.seconds >= cost_of_choice) break;
      if (!found && row.seconds > 400 * n0 * 1e-9 * double(scene.body.network->springs.size()) * scene.ticks) break;
      double& last = coarser.try_emplace({row.method, row.precision}, 0).first->second;
      // Hopeless: two orders more than it has would be needed from the step before.
      if (last > error * std::pow(2.0, row.method->order + 2)) {
        last /= std::pow(2.0, row.method->order + 2);
        continue;
      }
      const Run now = run(scene, *row.method, row.precision, row.substeps);
      const double e = now.good ? rms(now.end, answer) : std::numeric_limits<double>::infinity();
      last = e;
      if (e <= error) {
        best = row, best_cpu = now.cpu, found = true;
        break;
      }
    }
    // Steps that long are of no use for small errors.
    const bool coarse = found && scene.wanted > 1e-4;
    const ImplicitCost cost(scene.body);
    for (const Method* method : {&implicit_euler(), &implicit_midpoint()})
      for (const Precision precision : {Precision::Float, Precision::Double})
        for (double n = 1; coarse; n *= 2) {
          if (cost.seconds(precision, 3 * n * scene.ticks, 3 * n * scene.ticks, 0) > best.seconds) break;
          const Run now = run(scene, *method, precision, n, 0, &cost, best.seconds);
          if (!now.good) continue;
          const double e = rms(now.end, answer);
          if (e <= error) best = {method, precision, n, now.seconds}, best_cpu = now.cpu;
          // Twice as dear each time, and no more than so much better.
          const double levels = std::log2(best.seconds / now.seconds);
          if (e <= error || e > error * std::pow(2.0, method->order * (levels + 1))) break;
        }
    out.nothing_meets = !found;
    out.cheapest = best.seconds;
    out.ratio = (cost_of_choice + choice.pilot_seconds) / best.seconds;
    outcomes.push_back(out);
    std::printf(
        "%5u %-7s%s %5ld points, G %.0e, %.1e wanted, error %.2f of it%s | %s %s %ld, %.3f + %.3f s | %s %s %g, %.3f s "
        "| "
        "cost %.2f%s\n",
        seed, scene.kind.c_str(), scene.stiff ? " stiff" : "", long(scene.body.positions.rows()), growth, scene.wanted,
        out.error, out.says_no ? " (said no)" : "", std::string(choice.method->name).c_str(), name_of(choice.precision),
        long(choice.substeps), cost_of_choice, choice.pilot_seconds, std::string(best.method->name).c_str(),
        name_of(best.precision), best.substeps, best.seconds, out.ratio, out.cheapest >= 0.05 ? " *" : "");
    if (std::getenv("EXPLAIN")) std::printf("      %s\n", choice.text().c_str());
    std::fflush(stdout);
    if (csv) {
      std::fprintf(
          csv,
          "%u,%s,%ld,%zu,%.6g,%d,%d,%.3g,%.3g,%.3g,%.3g,%d,%s,%s,%ld,%.3g,%.4g,%.4g,%s,%s,%g,%.4g,%.4g,%.4g,%.4g\n",
          seed, scene.kind.c_str(), long(scene.body.positions.rows()), scene.body.network->springs.size(),
          scene.duration, int(scene.damped), int(scene.stiff), growth, scene.wanted, out.error * scene.wanted,
          uncertainty / scene.size, int(choice.meets), std::string(choice.method->name).c_str(),
          name_of(choice.precision), long(choice.substeps), choice.predicted_error / scene.size, cost_of_choice,
          choice.pilot_seconds, std::string(best.method->name).c_str(), name_of(best.precision), best.substeps,
          best.seconds, ours.cpu, choosing_cpu, best_cpu);
      std::fflush(csv);
    }
  }
  if (csv) std::fclose(csv);

  int met = 0, meetable = 0, above3 = 0, counted = 0, within2 = 0, above4 = 0, said = 0, false_no = 0;
  for (const Outcome& o : outcomes) {
    if (o.nothing_meets) {
      said += o.says_no;
      continue;
    }
    ++meetable;
    met += o.met;
    above3 += o.error > 3;
    false_no += o.says_no;
    if (o.cheapest < 0.05) continue;
    ++counted;
    within2 += o.ratio <= 2;
    above4 += o.ratio > 4;
  }
  const auto percent = [](int part, int all) { return all ? 100.0 * part / all : 100.0; };
  std::printf("%zu scenes (%d chaotic and %d without a settled reference left out)\n", outcomes.size(), chaotic,
              unsettled);
  std::printf("wanted error met: %d of %d (%.1f %%); above 3 times: %d; said no though a row meets it: %d\n", met,
              meetable, percent(met, meetable), above3, false_no);
  std::printf(
      "cost at most 2 times the cheapest row's: %d of the %d whose cheapest row takes 50 ms or more (%.1f %%); above 4 "
      "times: %d\n",
      within2, counted, percent(within2, counted), above4);
  std::printf("nothing meets it: %zu, said so: %d\n", outcomes.size() - std::size_t(meetable), said);
}
