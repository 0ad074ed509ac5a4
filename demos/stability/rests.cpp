// At rest means at rest; and nothing gains energy on the way there.
#include "hard_cases.hpp"

#include "scenes.hpp"
#include "trial.hpp"

#include <algorithm>

namespace hooke::stability {

namespace {

using scene::SceneDescription;
using scene::StandardScene;

constexpr double kStill = 1e-4;  // RMS speed [m/s]

const StandardScene& standard(const std::string& name) {
  static const std::vector<StandardScene> all = scene::standard_scenes();
  return *std::find_if(all.begin(), all.end(), [&](const StandardScene& scene) { return scene.name == name; });
}

struct Resting {
  SceneDescription scene;
  double within = 3;  ///< [s]
};

Resting resting(const std::string& name, bool thorough) {
  if (name.starts_with("jelly")) {
    const bool soft = name == "jelly, soft";
    SceneDescription d = empty_scene("jelly-on-floor", 3);
    add_body(d, "jelly", jelly(thorough ? 10 : 6, 0.1, soft ? 50 : 2000));
    add_collider(d, "floor", HalfSpace{}, 0.5);
    return {d, soft ? 5.0 : 3.0};
  }
  if (name == "cloth on a sphere") {
    SceneDescription d = *standard("settling-cloth").description;
    if (!thorough) {
      auto& grid = std::get<scene::Grid>(d.bodies[0].form);
      grid.columns = grid.rows = 12;
    }
    d.damping = 0.63;
    return {d, 20};
  }
  SceneDescription d = scene::hanging_sheet(thorough ? 32 : 12);
  d.damping = 0.63;
  return {d, 20};
}

Case rest() {
  Case hard;
  hard.name = "rest";
  hard.title = "Rest";
  hard.problem =
      "A jelly cube (10³ points, 6³ in the short form; k = 2000 N/m and 50 N/m, 1 kg) dropped 0.1 m on a floor, and a "
      "cloth draped over a fixed sphere and a hanging sheet with a global damping of 63 % a second, come to rest, and "
      "then "
      "stay so: 10 simulated minutes in the long form.";
  hard.figure = "when the RMS speed fell below 1e-4 m/s for good [s]";
  hard.gate = "below it and asleep within 3 s (soft jelly 5 s, cloth and sheet 20 s); then not a bit changes";
  hard.parameters = {"jelly", "jelly, soft", "cloth on a sphere", "hanging sheet"};
  hard.run = [](const Trial& trial, Row& row) {
    const Resting resting = stability::resting(trial.parameter, trial.thorough);
    scene::Scene scene = build(resting.scene, trial.solver);
    Watch watch(scene.world, row, 10, allowance(trial, 3));
    double moving = 0;
    watch.look = [&] {
      if (rms_speed(scene.world) >= kStill) moving = scene.world.time();
    };
    watch.run(resting.within);
    row.jitter = rms_speed(scene.world);
    const Points<double> there = scene.world.bodies()[0]->positions();
    judge(row, moving, resting.within - 0.9 * watch.frame);
    if (!row.bounded()) return;
    row.said += asleep(scene.world) ? "asleep" : "awake";
    if (!asleep(scene.world)) row.outcome = Outcome::Missed;
    // Asleep, minutes cost nothing.
    if (row.outcome != Outcome::Met || !watch.run(trial.thorough ? 600 : 60)) return;
    row.jitter = rms_speed(scene.world);
    const double drift = (scene.world.bodies()[0]->positions() - there).abs().maxCoeff();
    if (drift == 0) return;
    row.outcome = Outcome::Missed;
    row.said += format("; moved by %.2g m in the minutes after", drift);
  };
  return hard;
}

Case energy() {
  Case hard;
  hard.name = "energy";
  hard.title = "Energy over a minute";
  hard.problem =
      "Undamped scenes for 60 s (6 s in the short form) with each solver's own step. What comes in comes from "
      "nowhere.";
  hard.figure = "greatest energy above the start over the energy exchanged, the largest kinetic one";
  hard.gate = "at most 1e-3";
  hard.parameters = {"oscillator", "elastic-pendulum", "stiff-pendulum", "fput-chain", "tumbling-net", "jelly-flight"};
  hard.parameters.emplace_back("hanging-sheet-32");
  hard.run = [](const Trial& trial, Row& row) {
    const StandardScene& standard = stability::standard(trial.parameter);
    const double seconds = trial.thorough ? 60 : 6;
    World world = [&] {
      if (!standard.description) {
        StandardScene longer = standard;
        return longer.build(trial.solver);
      }
      return std::move(build(*standard.description, trial.solver).world);
    }();
    Watch watch(world, row, 1e5, allowance(trial, 3));
    watch.energy = true;
    watch.run(seconds);
    judge(row, row.energy_growth, 1e-3);
  };
  return hard;
}

}  // namespace

void add_rests(std::vector<Case>& out) {
  out.push_back(rest());
  out.push_back(energy());
}

}  // namespace hooke::stability
