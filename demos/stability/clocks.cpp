// Time and place: frames of any length, moving pins, far from the origin, steps below an ulp, long runs.
#include "hard_cases.hpp"

#include "scenes.hpp"
#include "trial.hpp"

#include <hooke/point_body.hpp>

#include <numbers>
#include <random>

namespace hooke::stability {

namespace {

using scene::RawPoints;
using scene::SceneDescription;

// A sheet in the wind, two corners of which are driven by time, over a sphere.
SceneDescription driven_sheet() {
  SceneDescription d = scene::hanging_sheet(8);
  d.duration = 1;
  d.bodies[0].pin = {"top-left", "top-right"};
  scene::PinDrive drive{{"top-left", "top-right"}, {}};
  drive.drive.swing = {0.2, 0.1, 0};
  drive.drive.period = 0.5;
  d.bodies[0].pin_motion.push_back(std::move(drive));
  d.bodies[0].thickness = 0.01;
  add_collider(d, "ball", Sphere{{0, -0.625, 0}, 0.25});
  return d;
}

// Where a body in float can hold a point: its places are relative to an origin of its own.
Vec3 rounded(const Body& body, const Vec3& x) {
  const auto* single = dynamic_cast<const PointBody<float>*>(&body);
  if (!single) return x;
  Vec3 out;
  for (int k = 0; k < 3; ++k) {
    volatile float place = float(x[k] - single->state().origin[k]);  // gcc 12 at -O3 leaves the rounding out else
    out[k] = single->state().origin[k] + double(place);
  }
  return out;
}

Case variable_frames() {
  Case hard;
  hard.name = "variable-frames";
  hard.title = "Variable frame time";
  hard.problem =
      "A sheet over a sphere, two of its corners driven by time, in frames of 30, 60, 144 and 240 Hz and of random "
      "lengths: the motion is that of the ticks alone.";
  hard.figure = "runs with other bits than the one at 240 Hz";
  hard.gate = "bitwise the same state at the same tick";
  hard.parameters = {""};
  hard.run = [](const Trial& trial, Row& row) {
    std::vector<std::uint64_t> hashes;
    for (const double rate : {240.0, 30.0, 60.0, 144.0, 0.0}) {
      scene::Scene scene = build(driven_sheet(), trial.solver);
      Watch watch(scene.world, row, 10, allowance(trial, 3));
      std::mt19937 random(1);
      std::uniform_real_distribution<double> any(0.0001, 0.05);
      watch.before = [&] { watch.frame = rate > 0 ? 1 / rate : any(random); };
      if (!watch.run(1)) return;
      hashes.push_back(state_hash(scene.world));
    }
    row.gate = 0;
    row.figure = 0;
    for (const std::uint64_t hash : hashes) row.figure += hash != hashes[0];
    row.outcome = row.figure == 0 ? Outcome::Met : Outcome::Missed;
  };
  return hard;
}

Case moving_pins() {
  Case hard;
  hard.name = "moving-pins";
  hard.title = "Teleporting and moving pins";
  hard.problem =
      "Jump: the pinned row of a sheet is moved 10 m within one frame. Drive: it shakes at up to 20 m/s. Teleport: all "
      "points of a swinging sheet are set 10 m aside between two frames.";
  hard.figure =
      "jump, drive: greatest distance of a pin from its target [m]; teleport: energy against a twin that "
      "stayed, over the kinetic";
  hard.gate =
      "bounded; pins exactly at their target, rounded to the precision, in the same step; a "
      "teleport adds no energy: 1e-9, in float the rounding of positions at 10 m, 1e-3";
  hard.parameters = {"jump", "drive", "teleport"};
  hard.run = [](const Trial& trial, Row& row) {
    const bool single = trial.solver.precision == softbody::Precision::Float;
    scene::Scene scene = build(scene::hanging_sheet(8), trial.solver);
    World& world = scene.world;
    Body& body = *world.bodies()[0];
    const Points<double> start = body.positions();
    Watch watch(world, row, 200, allowance(trial));
    double off = 0;
    if (trial.parameter == "teleport") {
      // Beside a twin that stays.
      scene::Scene twin = build(scene::hanging_sheet(8), trial.solver);
      Row row_of_twin;
      Watch watch_twin(twin.world, row_of_twin, 200, allowance(trial));
      if (!watch.run(0.3) || !watch_twin.run(0.3)) return;
      const Points<double> x = body.positions();
      for (Index i = 0; i < body.size(); ++i)
        body.set_position(i, Vec3(Vec3(x.row(i).matrix().transpose()) + Vec3(10, 0, 0)));
      const double after = world.time() + 2 * world.clock().tick();
      if (!watch.run(after) || !watch_twin.run(after)) return;
      const Energy energy = twin.world.energy();
      judge(row, std::abs(world.energy().total() - energy.total()) / energy.kinetic, single ? 1e-3 : 1e-9);
      return;
    }
    if (trial.parameter == "jump") {
      if (!watch.run(0.1)) return;
      for (Index i = 0; i < 8; ++i) body.move_pin(i, Vec3(start.row(i).matrix().transpose()) + Vec3(10, 0, 0));
      if (!watch.run(world.time() + 1.0 / 60)) return;
      for (Index i = 0; i < 8; ++i) {
        const Vec3 target = Vec3(start.row(i).matrix().transpose()) + Vec3(10, 0, 0);
        off = std::max(off, (Vec3(body.positions().row(i).matrix().transpose()) - rounded(body, target)).norm());
      }
      watch.run(1);
    } else {
      const auto place = [start](double t, Index i) {
        return Vec3(Vec3(start.row(i).matrix().transpose()) + Vec3(2 * std::sin(10 * t), 0, 0));
      };
      std::vector<Index> pins(8);
      for (Index i = 0; i < 8; ++i) pins[std::size_t(i)] = i;
      body.drive_pins(pins, [place](double t, Points<double>& places) {
        for (Index i = 0; i < 8; ++i) places.row(i) = place(t, i).transpose().array();
      });
      watch.look = [&] {
        for (Index i = 0; i < 8; ++i) {
          const Vec3 target = place(world.time(), i);
          off = std::max(off, (Vec3(body.positions().row(i).matrix().transpose()) - rounded(body, target)).norm());
        }
      };
      watch.run(1);
    }
    judge(row, off, 0);
  };
  return hard;
}

Case far_from_origin() {
  Case hard;
  hard.name = "far-from-origin";
  hard.title = "Far from the origin";
  hard.problem =
      "A sheet falls on a sphere and a floor, all of it at 1, 10, 100 and 1000 km along every axis, the body's origin "
      "there too.";
  hard.figure = "runs with other bits than the one at the origin";
  hard.gate = "bitwise the same motion relative to the origin";
  hard.parameters = {""};
  hard.run = [](const Trial& trial, Row& row) {
    std::vector<std::uint64_t> hashes;
    for (const double km : {0, 1, 10, 100, 1000}) {
      const Vec3 far = Vec3::Constant(1000.0 * km);
      SceneDescription d = scene::hanging_sheet(8);
      d.bodies[0].pin = {"top-left"};
      d.bodies[0].origin = far;
      d.bodies[0].thickness = 0.0078125;
      add_collider(d, "ball", Sphere{far + Vec3(0, -0.625, 0.25), 0.25});
      add_collider(d, "floor", HalfSpace{{0, 1, 0}, far.y() - 1});
      scene::Scene scene = build(d, trial.solver);
      Watch watch(scene.world, row, 10, allowance(trial, 3));
      if (!watch.run(2)) return;
      hashes.push_back(state_hash(scene.world));
    }
    row.gate = 0;
    row.figure = 0;
    for (const std::uint64_t hash : hashes) row.figure += hash != hashes[0];
    row.outcome = row.figure == 0 ? Outcome::Met : Outcome::Missed;
  };
  return hard;
}

RawPoints lone_point(const Vec3& x, const Vec3& v) {
  RawPoints raw;
  raw.points = x.transpose().array();
  raw.velocities = v.transpose().array();
  raw.masses = Values<double>::Ones(1);
  return raw;
}

Case tiny_steps() {
  Case hard;
  hard.name = "tiny-steps";
  hard.title = "Tiny steps";
  hard.problem =
      "Steps of 1e-5 s. Drift: a point 100 m from its body's origin moves at 1 mm/s, 1e-8 m a step where one ulp of "
      "float is 7.6e-6 m. Fall: a point falls from rest, 1e-4 m/s a step up to 98 m/s.";
  hard.figure = "relative error of the way";
  hard.gate = "increments below one ulp are not lost: within 1e-3";
  hard.parameters = {"drift", "fall"};
  hard.run = [](const Trial& trial, Row& row) {
    const bool drift = trial.parameter == "drift";
    const double seconds = trial.thorough ? 10 : 1;  // 10⁶ or 10⁵ steps
    SceneDescription d = empty_scene("tiny-steps", seconds);
    if (drift) d.gravity.setZero();
    const Vec3 x = drift ? Vec3(100, 0, 0) : Vec3(0, 0, 0), v = drift ? Vec3(1e-3, 0, 0) : Vec3(0, 0, 0);
    add_body(d, "point", lone_point(x, v));
    Solver solver = trial.solver;
    solver.dt = 1e-5;
    scene::Scene scene = build(d, solver);
    Watch watch(scene.world, row, 1e4, allowance(trial, 3));
    watch.run(seconds);
    const Vec3 moved = scene.world.bodies()[0]->displacement(0);
    const double wanted = drift ? 1e-3 * seconds : -0.5 * 9.81 * seconds * seconds;
    // The rounding of one position is not what is asked.
    const double ulp = trial.solver.precision == softbody::Precision::Float && drift ? 7.7e-6 : 0;
    judge(row, std::max(0.0, std::abs((drift ? moved.x() : moved.y()) - wanted) - ulp) / std::abs(wanted), 1e-3);
  };
  return hard;
}

// The energy that the method itself keeps on an oscillator of 1 kg at z = ω dt: its own where that is known.
double kept_energy(const std::string& method, double x, double v, double omega, double dt) {
  const double z = omega * dt, u = v / omega;
  if (method == "semi-implicit-euler") return x * x + u * u - z * x * u;
  if (method == "velocity-verlet" || method == "verlet" || method == "filtered-leapfrog")
    return u * u + (1 - z * z / 4) * x * x;
  return x * x + u * u;
}

Case long_run() {
  Case hard;
  hard.name = "long-run";
  hard.title = "Long run";
  hard.problem =
      "Oscillator: 10⁷ steps (10⁶ in the short form) of one undamped oscillator at z = ω dt = 0.1. Sheet: as many "
      "steps (10⁵ in the short form) of the hanging sheet of 6 × 6 points at a twentieth of the largest stable one.";
  hard.figure =
      "oscillator: relative change of the energy that the method keeps; sheet: energy gained over the "
      "energy exchanged";
  hard.gate = "oscillator: 3e-5; sheet: bounded, never above its start by 1e-3";
  hard.parameters = {"oscillator", "sheet"};
  hard.run = [](const Trial& trial, Row& row) {
    const double steps = trial.thorough ? 1e7 : 1e6;
    const std::string& method = trial.solver.method;
    Solver solver = trial.solver;
    if (trial.parameter == "oscillator") {
      if (method == "implicit-euler" || method == "xpbd") throw NoClaim{"it damps oscillations by design"};
      if (method == "rk4") throw NoClaim{"it loses z⁶/72 of the energy a step by design: 13 % in 10⁷ steps"};
      constexpr double kOmega = 2 * std::numbers::pi;
      solver.dt = 0.1 / kOmega;
      SceneDescription d = empty_scene("oscillator", 1);
      d.gravity.setZero();
      d.tick_rate = 1 / (100 * solver.dt);
      RawPoints raw = lone_point({0, 0, 0}, {0, 0, 0});
      raw.points = Points<double>::Zero(2, 3);
      raw.points(1, 0) = 1;
      raw.velocities = Points<double>::Zero(2, 3);
      raw.masses = Values<double>::Ones(2);
      raw.network.springs.push_back({0, 1, kOmega * kOmega, 0, 0, softbody::Family::Raw});
      raw.pins = {0};
      add_body(d, "oscillator", raw);
      scene::Scene scene = build(d, solver);
      const Body& body = *scene.world.bodies()[0];
      const auto kept = [&] {
        return kept_energy(method, body.positions()(1, 0), body.velocities()(1, 0), kOmega, solver.dt);
      };
      const double before = kept();
      double worst = 0;
      Watch watch(scene.world, row, 10, allowance(trial, 3));
      watch.frame = 100 * scene.world.clock().tick();
      watch.look = [&] { worst = std::max(worst, std::abs(kept() / before - 1)); };
      watch.run(steps * solver.dt);
      judge(row, worst, 3e-5);
      return;
    }
    scene::Scene probe = build(scene::hanging_sheet(6), {});
    // The energy swings with the square of the step.
    const double dt = 0.05 * probe.bodies[0].body->stable_step(velocity_verlet());
    if (is_explicit(method)) solver.dt = dt;
    scene::Scene scene = build(scene::hanging_sheet(6), solver);
    Watch watch(scene.world, row, 10, allowance(trial, 3));
    watch.frame = 0.1;
    watch.energy = true;
    watch.run((trial.thorough ? 1 : 0.1) * steps * dt);
    judge(row, row.energy_growth, 1e-3);
  };
  return hard;
}

}  // namespace

void add_clocks(std::vector<Case>& out) {
  for (const auto& make : {variable_frames, moving_pins, far_from_origin, tiny_steps, long_run}) out.push_back(make());
}

}  // namespace hooke::stability
