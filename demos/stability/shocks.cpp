// Bad starts, hard impacts, broken forces: does a body survive, and is it told where not?
#include "hard_cases.hpp"

#include "scenes.hpp"
#include "trial.hpp"

#include <hooke/contacts.hpp>
#include <hooke/softbody/soft_body.hpp>

#include <Eigen/Eigenvalues>

#include <random>

namespace hooke::stability {

namespace {

using scene::RawPoints;
using scene::SceneDescription;

Case coincident_points() {
  Case hard;
  hard.name = "coincident-points";
  hard.title = "Coincident points";
  hard.problem =
      "A spring of 1 m whose two points are at the same place, and one without rest length: their direction is 0/0. "
      "Nothing else acts.";
  hard.figure = "greatest displacement after 2 s [m]";
  hard.gate = "finite, no force where there is no direction";
  hard.parameters = {"rest length 1 m", "rest length 0"};
  hard.run = [](const Trial& trial, Row& row) {
    RawPoints raw;
    raw.points = Points<double>::Zero(2, 3);
    raw.points.col(0) = 0.25;
    raw.velocities = Points<double>::Zero(2, 3);
    raw.masses = Values<double>::Ones(2);
    raw.network.springs.push_back({0, 1, 500, 0, trial.parameter.ends_with("0") ? 0.0 : 1.0, softbody::Family::Raw});
    SceneDescription d = empty_scene("coincident", 2);
    d.gravity.setZero();
    add_body(d, "points", raw);
    scene::Scene scene = build(d, trial.solver);
    Watch watch(scene.world, row, 10, allowance(trial));
    watch.run(2);
    judge(row, (scene.world.bodies()[0]->positions() - raw.points).abs().maxCoeff(), 0);
  };
  return hard;
}

// The volume of the points' ellipsoid of inertia, up to a factor.
double spread(const Points<double>& x) {
  const Eigen::MatrixXd centred = (x.rowwise() - x.colwise().mean()).matrix();
  return std::sqrt(std::max(0.0, Eigen::Matrix3d(centred.transpose() * centred / double(x.rows())).determinant()));
}

Case collapsed_start() {
  Case hard;
  hard.name = "collapsed-start";
  hard.title = "Collapsed start: a jelly pressed flat, or in disorder";
  hard.problem =
      "A jelly of 5 × 5 × 5 points, 0.2 m, 1 kg, k = 2000 N/m, floats without weight. Flat: pressed to a millionth of "
      "its height, so that springs can just tell up from down; layers shoot through each other and may stay folded, "
      "which the springs "
      "take for rest. Half: pressed to half its height. Disorder: every point anywhere in the cube.";
  hard.figure = "volume lost after 10 s, as a share; only half has a gate for it";
  hard.gate = "finite after 10 s; half: its volume again within 1 %";
  hard.parameters = {"half", "flat", "disorder"};
  hard.run = [](const Trial& trial, Row& row) {
    SceneDescription d = empty_scene("collapsed", 10);
    d.gravity.setZero();
    RawPoints raw = jelly(5, 0);
    const double whole = spread(raw.points);
    const bool half = trial.parameter == "half";
    if (trial.parameter != "disorder") {
      raw.points.col(1) *= half ? 0.5 : 1e-6;
    } else {
      std::mt19937 random(5);
      std::uniform_real_distribution<double> place(0, 0.2);
      for (double& x : raw.points.reshaped()) x = place(random);
    }
    add_body(d, "jelly", raw);
    scene::Scene scene = build(d, trial.solver);
    Watch watch(scene.world, row, 10, allowance(trial));
    watch.energy = true;
    watch.run(10);
    row.jitter = rms_speed(scene.world);
    const double lost = 1 - spread(scene.world.bodies()[0]->positions()) / whole;
    if (half) return judge(row, std::abs(lost), 0.01);
    judge(row);
    if (row.bounded()) row.figure = lost;
  };
  return hard;
}

Case over_stretched() {
  Case hard;
  hard.name = "over-stretched";
  hard.title = "Over-stretched start, with wind";
  hard.problem =
      "The hanging sheet of 12 × 12 points starts ten times too long and wide, in a wind of 10 m/s with gusts: a "
      "hundred times the energy of anything it was made for.";
  hard.figure = "worst strain at the end";
  hard.gate = "bounded, no NaN";
  hard.parameters = {""};
  hard.run = [](const Trial& trial, Row& row) {
    SceneDescription d = scene::hanging_sheet(12);
    RawPoints raw = points_of(d);
    raw.points *= 10;
    // Wind needs triangles, and a grid has them: the same sheet, its points put elsewhere.
    d.bodies[0].wind = softbody::Wind{};
    d.bodies[0].wind->velocity = {10, 0, 5};
    d.bodies[0].wind->gust = 0.5;
    scene::Scene scene = build(d, trial.solver);
    Body& body = *scene.world.bodies()[0];
    for (Index i = 0; i < body.size(); ++i) body.set_position(i, raw.points.row(i).matrix().transpose());
    Watch watch(scene.world, row, 100, allowance(trial));
    watch.run(trial.thorough ? 10 : 2);
    judge(row);
    if (row.bounded()) row.figure = scene::worst_stretch(scene);
  };
  return hard;
}

Case huge_velocity() {
  Case hard;
  hard.name = "huge-velocity";
  hard.title = "Huge velocity: 1000 m/s on floor, sphere and thin wall";
  hard.problem =
      "A sheet of 8 × 8 points, 0.2 m wide and a millimetre thick, flies flat at 1000 m/s, four metres a tick, onto a "
      "floor, a sphere of 5 m, and a wall one millimetre thick.";
  hard.figure = "points beyond the surface";
  hard.gate = "nothing passes through";
  hard.parameters = {"floor", "sphere", "wall"};
  hard.run = [](const Trial& trial, Row& row) {
    const Sphere ball{{0, -5, 0}, 5};
    SceneDescription d = empty_scene("impact", 0.1);
    scene::SoftBody& sheet = add_body(d, "sheet", {});
    sheet.form = scene::Grid{0.2, 0.2, 8, 8, {1, 0, 0}, {0, 0, 1}};
    sheet.material = scene::FixedMaterial{0.012, 500, 100, 5, 0};
    RawPoints raw = points_of(d);
    raw.points.col(2) -= 0.1;
    raw.velocities.col(1) = -1000;
    sheet.form = raw;
    sheet.origin = {0, 15.3, 0};
    sheet.thickness = 0.001;
    if (trial.parameter == "floor") add_collider(d, "floor", HalfSpace{});
    if (trial.parameter == "sphere") add_collider(d, "sphere", ball);
    if (trial.parameter == "wall") add_collider(d, "wall", Box{{0, 0, 0}, {2, 0.0005, 2}});
    scene::Scene scene = build(d, trial.solver);
    Watch watch(scene.world, row, 500, allowance(trial));
    double beyond = 0;
    watch.look = [&] {
      const Points<double> x = scene.world.bodies()[0]->positions();
      double now = 0;
      for (Index i = 0; i < x.rows(); ++i) {
        const Vec3 p = x.row(i).matrix().transpose();
        if (trial.parameter == "sphere")
          now += signed_distance(ball, p) < -1e-4 || p.y() < -ball.radius;
        else if (trial.parameter == "floor" || p.head<1>().cwiseAbs().maxCoeff() < 2)
          now += p.y() < -1e-4;
      }
      beyond = std::max(beyond, now);
    };
    watch.run(0.1);
    judge(row, beyond, 0);
  };
  return hard;
}

Case initial_overlap() {
  Case hard;
  hard.name = "initial-overlap";
  hard.title = "Initial overlap: a jelly born half inside a floor";
  hard.problem =
      "A jelly of 6 × 6 × 6 points begins half inside a floor. Contacts push its lower points out at 2 m/s at most; a "
      "wall of that speed throws an elastic body off at twice that.";
  hard.figure = "greatest RMS speed [m/s]";
  hard.gate = "pushed out at bounded speed: at most 4 m/s, and nothing is below the floor after 1 s";
  hard.parameters = {""};
  hard.run = [](const Trial& trial, Row& row) {
    SceneDescription d = empty_scene("overlap", 1);
    add_body(d, "jelly", jelly(6, -0.1));
    add_collider(d, "floor", HalfSpace{}, 0.5);
    scene::Scene scene = build(d, trial.solver);
    Watch watch(scene.world, row, 10, allowance(trial));
    double fastest = 0;
    watch.look = [&] { fastest = std::max(fastest, rms_speed(scene.world)); };
    watch.run(1);
    judge(row, fastest, 2 * Contacts<double>::kPushSpeed);
    const double lowest = scene.world.bodies()[0]->positions().col(1).minCoeff();
    if (row.bounded() && lowest < -1e-3) {
      row.outcome = Outcome::Missed;
      row.said = format("still %.3g m below the floor", -lowest);
    }
  };
  return hard;
}

// Nothing until half a second, then NaN on one point.
template <class S>
class BrokenForce final : public ForceField<S> {
 public:
  bool uses_velocity() const override { return false; }
  void add_force(const Points<S>&, const Points<S>&, double t, Points<S>& f) const override {
    if (t >= 0.5) f(7, 1) = std::numeric_limits<S>::quiet_NaN();
  }
};

template <class S>
bool add_broken_force(Body& body) {
  auto* points = dynamic_cast<PointBody<S>*>(&body);
  if (points) points->add_field(std::make_unique<BrokenForce<S>>());
  return points != nullptr;
}

Case nan_injected() {
  Case hard;
  hard.name = "nan-injected";
  hard.title = "NaN from the user: a force, a pin";
  hard.problem =
      "After 0.5 s the user's own force on point 7, or the user's motion of the pinned point 0, is not a number.";
  hard.figure = "wrong ones among: told, body, point, time, last good state kept";
  hard.gate = "body, point and step are named; the last good state is kept";
  hard.parameters = {"force", "pin"};
  hard.run = [](const Trial& trial, Row& row) {
    const bool force = trial.parameter == "force";
    scene::Scene scene = build(scene::hanging_sheet(6), trial.solver);
    Body& body = *scene.world.bodies()[0];
    if (force && !add_broken_force<float>(body) && !add_broken_force<double>(body))
      throw NoClaim{"its bodies take no force fields"};
    if (!force)
      body.drive_pins(
          {0}, [](double t, Points<double>& places) { places.row(0) << -0.5, t > 0.5 + 1e-6 ? kNone : 0.0, 0.0; });
    Points<double> x, v;
    StepReport report;
    while (scene.world.time() < 1 - 1e-9 && report.good()) {
      x = body.positions(), v = body.velocities();
      report = scene.world.update(scene.world.clock().tick());
    }
    row.simulated = scene.world.time();
    row.said = report.text();
    if (!report.good()) row.failed_at = report.time;
    const bool wrong[]{report.good(), report.body != body.name(), report.point != (force ? 7 : 0),
                       !(std::abs(report.time - 0.5) < 1.5 * scene.world.clock().tick()),
                       !((body.positions() == x).all() && (body.velocities() == v).all())};
    row.figure = double(std::count(std::begin(wrong), std::end(wrong), true));
    row.gate = 0;
    row.outcome = row.figure == 0 ? Outcome::Met : Outcome::Missed;
  };
  return hard;
}

}  // namespace

void add_shocks(std::vector<Case>& out) {
  for (const auto& make : {coincident_points, collapsed_start, over_stretched, huge_velocity, initial_overlap})
    out.push_back(make());
  out.push_back(nan_injected());
}

}  // namespace hooke::stability
