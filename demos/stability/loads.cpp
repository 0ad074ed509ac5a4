// Unequal masses, stiff springs, many points: does a body hang as it should?
#include "hard_cases.hpp"

#include "scenes.hpp"
#include "trial.hpp"

#include <numeric>

namespace hooke::stability {

namespace {

using scene::SceneDescription;

constexpr double kG = 9.81;

// How much longer than unstretched the way along these points is [m].
double elongation(const scene::SceneBody& body, const Points<double>& x, const std::vector<Index>& way) {
  const Points<double> start = body.body->start_positions();
  double sum = 0;
  for (std::size_t i = 1; i < way.size(); ++i)
    sum += (x.row(way[i]) - x.row(way[i - 1])).matrix().norm() -
           (start.row(way[i]) - start.row(way[i - 1])).matrix().norm();
  return sum;
}

// From the first row down to the last point of an n × n grid.
std::vector<Index> last_column(Index points) {
  const auto n = Index(std::lround(std::sqrt(double(points))));
  std::vector<Index> out;
  for (Index row = 0; row < n; ++row) out.push_back(row * n + n - 1);
  return out;
}

std::vector<Index> way_of(const scene::SceneBody& body, bool chain) {
  std::vector<Index> way = last_column(body.body->size());
  if (chain) {
    way.resize(std::size_t(body.body->size()));
    std::iota(way.begin(), way.end(), 0);
  }
  return way;
}

double balanced_elongation(const SceneDescription& d, bool chain) {
  const scene::Scene scene = build(d, {});
  const scene::SceneBody& body = scene.bodies[0];
  return elongation(body, balance_of(body, scene.world.gravity()).positions, way_of(body, chain));
}

void settle_and_compare(const SceneDescription& d, double seconds, double gate, const Trial& trial, Row& row,
                        bool chain, double wanted) {
  scene::Scene scene = build(d, trial.solver);
  const scene::SceneBody& body = scene.bodies[0];
  const std::vector<Index> way = way_of(body, chain);
  Watch watch(scene.world, row, 100, allowance(trial, seconds > 10 ? 3 : 1));
  watch.run(seconds);
  row.jitter = rms_speed(scene.world);
  judge(row, std::abs(elongation(body, body.body->positions(), way) / wanted - 1), gate);
}

Case mass_ratio(bool chain) {
  Case hard;
  hard.name = chain ? "mass-ratio-chain" : "mass-ratio-sheet";
  hard.title = chain ? "Mass ratio: chain with a heavy end" : "Mass ratio: sheet with a heavy corner";
  hard.problem = chain ? "Ten links hang from a pin, the last point 10 to 10,000 times as heavy as the others. Springs "
                         "are as stiff as the load asks, so the light points tremble a hundred times faster than the "
                         "heavy one swings. It falls into its springs and is damped to rest."
                       : "A sheet of 8 × 8 points hangs from its first row, one free corner 10 to 10,000 times as "
                         "heavy as a point.";
  hard.figure = "stretch against the static answer, relative error";
  hard.gate = "bounded; within 1 % of the static answer once settled";
  hard.parameters = {"10", "100", "1000", "10000"};
  hard.run = [chain](const Trial& trial, Row& row) {
    const double ratio = std::stod(trial.parameter);
    const SceneDescription d = chain ? heavy_chain(ratio) : heavy_sheet(ratio);
    settle_and_compare(d, 5, 0.01, trial, row, chain, balanced_elongation(d, chain));
  };
  return hard;
}

// The middle of the cloth below its pins [m].
double sag(const Points<double>& x) { return -x.col(1).minCoeff(); }

Case light_points() {
  Case hard;
  hard.name = "light-points";
  hard.title = "Light points: one cloth in 10² to 100² points";
  hard.problem =
      "A square metre of one cloth, held along two opposite edges, sags under its weight. However finely it is cut, "
      "its mass and stiffness are the same; a point of the finest has a hundredth of the mass of one of the coarsest.";
  hard.figure = "sag against the static one of 25² points, relative error";
  hard.gate = "the same sag within 2 %; none explodes";
  hard.parameters = {"10", "25"};
  hard.thorough = {"50", "100"};
  const auto wanted = once<double>([] {
    const scene::Scene scene = build(hammock(25), {});
    return sag(balance_of(scene.bodies[0], scene.world.gravity()).positions);
  });
  hard.run = [wanted](const Trial& trial, Row& row) {
    scene::Scene scene = build(hammock(std::stoi(trial.parameter)), trial.solver);
    Watch watch(scene.world, row, 10, allowance(trial));
    watch.run(3);
    row.jitter = rms_speed(scene.world);
    judge(row, std::abs(sag(scene.bodies[0].body->positions()) / wanted() - 1), 0.02);
  };
  return hard;
}

Case over_stiff() {
  Case hard;
  hard.name = "over-stiff";
  hard.title = "Over-stiff: the hanging sheet, stiffness × 1 to 10⁶";
  hard.problem =
      "The hanging sheet of 16 × 16 points with up to a million times its stiffness, at frames of 1/60 s. With one "
      "step a frame no explicit method can do it: it must say so, with its largest stable step, before the motion is "
      "lost.";
  hard.figure = "worst strain";
  hard.gate = "bounded; explicit methods at too long a step warn with the largest stable one before they cross it";
  hard.parameters = {
      "1", "100", "10000", "1000000", "100, one step a frame", "10000, one step a frame", "1000000, one step a frame"};
  hard.run = [](const Trial& trial, Row& row) {
    SceneDescription d = hard_sheet(16, std::stod(trial.parameter), 1);
    Solver solver = trial.solver;
    const bool coarse = trial.parameter.ends_with("frame");
    if (coarse) {
      d.tick_rate = 60;
      solver.dt = 1.0 / 60;
    }
    scene::Scene scene = build(d, solver);
    Watch watch(scene.world, row, 10, allowance(trial));
    watch.energy = true;
    double lost_at = std::numeric_limits<double>::infinity();
    watch.look = [&] {
      row.figure = scene::worst_stretch(scene);
      if (!(row.figure < 1)) lost_at = std::min(lost_at, scene.world.time());
    };
    watch.run(trial.thorough ? 5 : 0.5);
    if (coarse && is_explicit(solver.method)) {
      // Told before it was lost, it may stop or go on: the user knows.
      if (watch.told_at < lost_at - 1e-9) {
        row.outcome = Outcome::Met;
      } else if (row.outcome != Outcome::TooDear) {
        row.outcome = Outcome::Broke;
        row.failed_at = std::min(lost_at, scene.world.time());
      }
      return;
    }
    judge(row);
  };
  return hard;
}

// The worst structural strain up to each of the times, sampled at the ends of frames of 1/60 s.
struct Strains {
  double early = 0, late = 0;  // up to `split`, and after it
};

bool strains_of(scene::Scene& scene, Row& row, double split, double until, double allowed, Strains& out) {
  Watch watch(scene.world, row, 1000, allowed);
  watch.look = [&] {
    const double worst = scene::worst_stretch(scene);
    double& kept = scene.world.time() < split + 1e-9 ? out.early : out.late;
    kept = std::max(kept, worst);
  };
  return watch.run(until);
}

// By a method of order 6 in double, its steps halved until the strain moves by less than this share.
double converged_strain(const SceneDescription& d, double until, double share_off) {
  double before = -1;
  for (double share = 0.9;; share /= 2) {
    Solver solver;
    solver.method = blanes_moan_6().name;
    solver.precision = softbody::Precision::Double;
    scene::Scene probe = build(d, solver);
    solver.dt = share * probe.bodies[0].body->stable_step(blanes_moan_6());
    scene::Scene scene = build(d, solver);
    Row row;
    Strains strains;
    strains_of(scene, row, until, until, kAnyWork, strains);
    if (before > 0 && std::abs(strains.early / before - 1) < share_off) return strains.early;
    before = strains.early;
    if (share < 0.05) return kNone;
  }
}

constexpr int kHardPoints = 32;
constexpr double kHeavy = 300.0 * kHardPoints, kStiff = 1000;

Case hard_bar(const char* name, const char* title, const char* problem, const char* figure, const char* gate,
              double stiffness, double ratio, double until, double allowed) {
  Case hard;
  hard.name = name;
  hard.title = title;
  hard.problem = problem;
  hard.figure = figure;
  hard.gate = gate;
  // Stiff and heavy at once, the reference takes minutes.
  (stiffness > 1 && ratio > 1 ? hard.thorough : hard.parameters) = {""};
  const auto wanted =
      once<double>([=] { return converged_strain(hard_sheet(kHardPoints, stiffness, ratio), until, 0.1 * allowed); });
  hard.run = [=](const Trial& trial, Row& row) {
    scene::Scene scene = build(hard_sheet(kHardPoints, stiffness, ratio), trial.solver);
    Strains strains;
    strains_of(scene, row, until, until, allowance(trial, 3), strains);
    judge(row, std::abs(strains.early / wanted() - 1), allowed);
    if (row.bounded()) row.said += format("worst strain %.4g, converged %.4g", strains.early, wanted());
  };
  return hard;
}

Case hard_settled() {
  Case hard;
  hard.name = "hard-heavy-settled";
  hard.title = "Hard sheet: heavy corner, come to rest";
  hard.problem =
      "The hanging sheet of 32 × 32 points whose free corner weighs as much as 9600 points, with a global damping of "
      "63 % a second, after 20 s.";
  hard.figure = "stretch of the column above the corner against the static answer, relative error";
  hard.gate = "within 5 % of the static answer";
  hard.thorough = {""};  // its balance takes minutes
  const auto wanted = once<double>([] { return balanced_elongation(hard_sheet(kHardPoints, 1, kHeavy), false); });
  hard.run = [wanted](const Trial& trial, Row& row) {
    SceneDescription d = hard_sheet(kHardPoints, 1, kHeavy);
    d.damping = 0.63;
    settle_and_compare(d, 20, 0.05, trial, row, false, wanted());
  };
  return hard;
}

Case hard_stiff_later() {
  Case hard;
  hard.name = "hard-stiff-later";
  hard.title = "Hard sheet: a thousand times the stiffness, later";
  hard.problem = "The same stiff sheet from 0.5 s to 1 s (5 s in the long form): cloth that stiff does not stretch.";
  hard.figure = "worst structural strain after 0.5 s";
  hard.gate = "at most 0.1 %";
  hard.parameters = {""};
  hard.run = [](const Trial& trial, Row& row) {
    scene::Scene scene = build(hard_sheet(kHardPoints, kStiff, 1), trial.solver);
    Strains strains;
    strains_of(scene, row, 0.5, trial.thorough ? 5 : 1, allowance(trial, 3), strains);
    judge(row, strains.late, 1e-3);
  };
  return hard;
}

}  // namespace

void add_loads(std::vector<Case>& out) {
  out.push_back(mass_ratio(true));
  out.push_back(mass_ratio(false));
  out.push_back(light_points());
  out.push_back(over_stiff());
  out.push_back(hard_bar("hard-stiff", "Hard sheet: a thousand times the stiffness",
                         "The hanging sheet of 32 × 32 points with a thousand times its stiffness, default settings, "
                         "frames of 1/60 s, up to 0.5 s.",
                         "worst structural strain against the converged solution's, relative error",
                         "worst structural tension within 10 % of the converged solution's", kStiff, 1, 0.5, 0.1));
  out.push_back(hard_stiff_later());
  out.push_back(hard_bar("hard-heavy", "Hard sheet: heavy corner",
                         "The hanging sheet of 32 × 32 points whose free corner weighs as much as 9600 points, up to "
                         "5 s: it stretches to nearly three times its length.",
                         "worst structural strain against the converged solution's, relative error",
                         "worst structural strain within 10 % of the converged solution's", 1, kHeavy, 5, 0.1));
  out.push_back(hard_settled());
  out.push_back(hard_bar("hard-both", "Hard sheet: stiff and heavy at once",
                         "A thousand times the stiffness and the heavy corner, up to 1 s.",
                         "worst structural strain against the converged solution's, relative error",
                         "worst structural strain within 20 % of the converged solution's", kStiff, kHeavy, 1, 0.2));
}

}  // namespace hooke::stability
