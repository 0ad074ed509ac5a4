#include <scene/standard.hpp>

#include <hooke/linear_bodies.hpp>
#include <scene/fput.hpp>
#include <scene/scene.hpp>
#include <scene/spray.hpp>

#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

namespace hooke::scene {

namespace {

using Compare = StandardScene::Compare;

Points<double> row(const Vec3& x) {
  Points<double> out(1, 3);
  out.row(0) = x.transpose().array();
  return out;
}

/// What a scene file could say: the description is all there is.
StandardScene described(SceneDescription description, std::string problem, int ticks) {
  StandardScene scene;
  scene.name = description.file;
  scene.title = description.title;
  scene.problem = std::move(problem);
  scene.duration = description.duration;
  scene.ticks = ticks;
  scene.build = [description, ticks](const Solver& solver) {
    SceneDescription d = description;
    d.tick_rate = ticks / d.duration;
    for (SoftBody& body : d.bodies) body.solver = solver;
    return std::move(scene::build(d).world);
  };
  scene.description = std::move(description);
  return scene;
}

SceneDescription empty(std::string name, std::string title, double duration) {
  SceneDescription d;
  d.file = std::move(name);
  d.title = std::move(title);
  d.duration = duration;
  return d;
}

SoftBody& add_body(SceneDescription& d, const std::string& name) {
  SoftBody& body = d.bodies.emplace_back();
  body.name = name;
  body.path = "bodies[" + std::to_string(d.bodies.size() - 1) + "]";
  return body;
}

/// One point of one kilogram, with nothing on it yet.
RawPoints one_point(const Vec3& x, const Vec3& v) {
  RawPoints raw;
  raw.points = row(x);
  raw.velocities = row(v);
  raw.masses = Values<double>::Ones(1);
  return raw;
}

/// A mass of one kilogram at x on a spring to the origin, which is point 0 and held.
RawPoints on_a_spring(const Vec3& x, const Vec3& v, double stiffness, double rest_length) {
  RawPoints raw;
  raw.points = Points<double>::Zero(2, 3);
  raw.points.row(1) = x.transpose().array();
  raw.velocities = Points<double>::Zero(2, 3);
  raw.velocities.row(1) = v.transpose().array();
  raw.masses = Values<double>::Ones(2);
  raw.network.springs.push_back({0, 1, stiffness, 0, rest_length, softbody::Family::Raw});
  raw.pins = {0};
  return raw;
}

/// A box of points on springs along edges, face diagonals and body diagonals, around the origin.
/// @param count points along x, y, z; 1 makes it flat
RawPoints lattice(const std::array<int, 3>& count, double spacing, double mass, double stiffness) {
  RawPoints raw;
  const Index n = Index(count[0]) * count[1] * count[2];
  const auto index = [&](int i, int j, int k) { return (k * count[1] + j) * count[0] + i; };
  raw.points.resize(n, 3);
  raw.velocities = Points<double>::Zero(n, 3);
  raw.masses = Values<double>::Constant(n, mass / double(n));
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i) {
        raw.points.row(index(i, j, k)) << spacing * (i - 0.5 * (count[0] - 1)), spacing * (j - 0.5 * (count[1] - 1)),
            spacing * (k - 0.5 * (count[2] - 1));
        // Half of the 26 neighbours: those that come later.
        for (int dk = 0; dk <= 1; ++dk)
          for (int dj = dk ? -1 : 0; dj <= 1; ++dj)
            for (int di = dk || dj ? -1 : 1; di <= 1; ++di) {
              const int a = i + di, b = j + dj, c = k + dk;
              if (a < 0 || b < 0 || a >= count[0] || b >= count[1] || c >= count[2]) continue;
              const double length = spacing * std::sqrt(double(di * di + dj * dj + dk * dk));
              raw.network.springs.push_back({index(i, j, k), index(a, b, c), stiffness, 0, length});
            }
      }
  return raw;
}

/// Adds v + ω × x to the velocities.
void spin(RawPoints& raw, const Vec3& velocity, const Vec3& omega) {
  for (Index i = 0; i < raw.points.rows(); ++i) {
    const Vec3 x = raw.points.row(i).matrix().transpose();
    const Vec3 turning{omega.y() * x.z() - omega.z() * x.y(), omega.z() * x.x() - omega.x() * x.z(),
                       omega.x() * x.y() - omega.y() * x.x()};
    raw.velocities.row(i) += (velocity + turning).transpose().array();
  }
}

StandardScene oscillator() {
  constexpr double kOmega = 2 * std::numbers::pi;
  const Vec3 x{1, 0, 0}, v{0, 3, 0};
  SceneDescription d = empty("oscillator", "Harmonic oscillator, ten periods", 10);
  d.gravity.setZero();
  add_body(d, "oscillator").form = on_a_spring(x, v, kOmega * kOmega, 0);
  StandardScene scene = described(std::move(d),
                                  "One mass on a spring without rest length goes round an ellipse once a second, ten "
                                  "times. What a method does to phase and energy shows here without anything else.",
                                  40);
  scene.exact = [x, v](double t) {
    Points<double> out = Points<double>::Zero(2, 3);
    out.row(1) = (std::cos(kOmega * t) * x + std::sin(kOmega * t) / kOmega * v).transpose().array();
    return out;
  };
  return scene;
}

StandardScene throw_with_linear_drag() {
  constexpr double kRate = 0.1;
  SceneDescription d = empty("throw-linear-drag", "Throw with linear drag", 3);
  SoftBody& body = add_body(d, "ball");
  body.form = one_point({0, 0, 0}, {30, 30, 0});
  body.linear_drag = kRate;
  StandardScene scene =
      described(std::move(d), "One kilogram is thrown at 30 m/s across and 30 m/s up against a drag of 0.1 N·s/m.", 3);
  scene.conservative = false;
  scene.exact = [](double t) {
    const double slowed = (1 - std::exp(-kRate * t)) / kRate, fall = 9.81 / kRate;
    return row({30 * slowed, (30 + fall) * slowed - fall * t, 0});
  };
  return scene;
}

StandardScene throw_with_quadratic_drag() {
  SceneDescription d = empty("throw-quadratic-drag", "Throw with quadratic drag", 3);
  SoftBody& body = add_body(d, "ball");
  body.form = one_point({0, 0, 0}, {30, 30, 0});
  body.quadratic_drag = 0.01;
  StandardScene scene =
      described(std::move(d),
                "One kilogram is thrown at 30 m/s across and 30 m/s up through air that holds it back "
                "by 0.01 N·s²/m² times its speed squared. In two dimensions nobody knows a closed form.",
                3);
  scene.conservative = false;
  return scene;
}

template <class S>
std::unique_ptr<Body> point_body(const RawPoints& raw, const MotionSettings& motion,
                                 std::unique_ptr<const ForceField<S>> field) {
  PointMasses<S> points;
  points.position = raw.points.cast<S>();
  points.velocity = raw.velocities.cast<S>();
  points.mass = raw.masses.cast<S>();
  points.inverse_mass = points.mass.inverse();
  auto body = std::make_unique<PointBody<S>>("body", std::move(points), motion);
  body->add_field(std::move(field));
  return body;
}

MotionSettings motion_of(const Solver& solver) {
  MotionSettings motion;
  motion.method = &method_named(solver.method);
  motion.dt = solver.dt;
  motion.tolerance = solver.tolerance;
  return motion;
}

/// make(S{}) for the solver's precision.
template <class Make>
std::unique_ptr<Body> in_precision(const Solver& solver, const Make& make) {
  switch (solver.precision) {
    case softbody::Precision::Automatic:
    case softbody::Precision::Float:
      return make(float{});
    case softbody::Precision::Double:
      return make(double{});
    default:
      throw std::invalid_argument("this scene has bodies in float and double only");
  }
}

StandardScene ship() {
  StandardScene scene;
  scene.name = "ship";
  scene.title = "The ship whose acceleration grows";
  scene.problem =
      "A ship of 1 kg at 3 m/s accelerates with 10 m/s² at 1 s and 25 m/s² at 2 s, growing steadily in between. How "
      "far "
      "does it get in that second? A method that takes the acceleration as constant over a step is wrong here.";
  scene.duration = 1;
  scene.ticks = 2;
  scene.conservative = false;
  scene.build = [](const Solver& solver) {
    World world(2);
    world.set_gravity({0, 0, 0});
    world.add(in_precision(solver, [&](auto s) {
      using S = decltype(s);
      return point_body<S>(one_point({0, 0, 0}, {3, 0, 0}), motion_of(solver),
                           std::make_unique<TimeForce<S>>([](double t) { return Vec3(10 + 15 * t, 0, 0); }));
    }));
    return world;
  };
  scene.exact = [](double t) { return row({3 * t + 5 * t * t + 2.5 * t * t * t, 0, 0}); };
  return scene;
}

/// Height of a ball dropped from h0 [m] that keeps the share e of its speed at each bounce.
double bouncing_height(double h0, double e, double t) {
  constexpr double g = 9.81;
  double speed = std::sqrt(2 * g * h0), start = speed / g;
  if (t < start) return h0 - 0.5 * g * t * t;
  for (speed *= e; speed > 1e-12; speed *= e) {
    const double flight = 2 * speed / g;
    if (t < start + flight) return speed * (t - start) - 0.5 * g * (t - start) * (t - start);
    start += flight;
  }
  return 0;
}

StandardScene bouncing_ball() {
  constexpr double kRadius = 0.1, kHeight = 1, kRestitution = 0.8, kDuration = 3;
  constexpr int kTicks = 15;
  StandardScene scene;
  scene.name = "bouncing-ball";
  scene.title = "Bouncing ball, restitution 0.8";
  scene.problem =
      "A rigid ball of 1 kg falls 1 m and keeps 0.8 of its speed at every bounce: six bounces in 3 s. Impact times are "
      "solved within the step, so the error is that of the method's free fall alone.";
  scene.duration = kDuration;
  scene.ticks = kTicks;
  scene.conservative = false;
  scene.build = [](const Solver& solver) {
    World world(kTicks / kDuration);
    world.add_collider({"floor", {HalfSpace{{0, 1, 0}, 0}}, {}, {}, 0, 0});
    LinearBody ball;
    ball.shape = BallShape{kRadius};
    ball.position = {0, kHeight + kRadius, 0};
    ball.restitution = kRestitution;
    world.add(in_precision(solver, [&](auto s) -> std::unique_ptr<Body> {
      return std::make_unique<LinearBodies<decltype(s)>>("ball", std::vector{ball}, motion_of(solver));
    }));
    return world;
  };
  scene.exact = [](double t) { return row({0, kRadius + bouncing_height(kHeight, kRestitution, t), 0}); };
  return scene;
}

StandardScene elastic_pendulum() {
  SceneDescription d = empty("elastic-pendulum", "Elastic pendulum", 3);
  add_body(d, "pendulum").form = on_a_spring({1, 0, 0}, {0, 0, 0}, 100, 1);
  return described(std::move(d),
                   "One kilogram is let go level with the pin of its spring, 1 m long and 100 N/m stiff: it swings and "
                   "bounces on the spring at once.",
                   30);
}

StandardScene stiff_pendulum() {
  SceneDescription d = empty("stiff-pendulum", "Stiff spring pendulum", 10);
  d.gravity = {0, -1, 0};
  add_body(d, "pendulum").form = on_a_spring({1, 0, 0}, {0, 0, 0}, 1000, 1);
  return described(std::move(d),
                   "One kilogram in a gravity of 1 m/s² is let go level with the pin of a spring that is 1 m long and "
                   "1000 N/m stiff. The spring trembles thirty times while the pendulum swings once.",
                   100);
}

StandardScene fput_chain() {
  constexpr double kDuration = 10;
  constexpr int kTicks = 100;
  StandardScene scene;
  scene.name = "fput-chain";
  scene.title = "Chain of stiff and soft springs (Fermi, Pasta, Ulam, Tsingou)";
  scene.problem =
      "Six points between two walls, joined by three stiff linear springs (50 rad/s) and four soft quartic ones, as in "
      "Hairer, Lubich and Wanner. The fast vibration wanders from one stiff spring to the next. At 10 s its energies "
      "should be 0.956065, 0.025681 and 0.000198 J.";
  scene.duration = kDuration;
  scene.ticks = kTicks;
  scene.build = [](const Solver& solver) {
    World world(kTicks / kDuration);
    world.set_gravity({0, 0, 0});
    world.add(in_precision(solver,
                           [&](auto s) -> std::unique_ptr<Body> { return fput_body<decltype(s)>(motion_of(solver)); }));
    return world;
  };
  return scene;
}

StandardScene tumbling_net() {
  SceneDescription d = empty("tumbling-net", "Tumbling net", 1);
  RawPoints net = lattice({12, 12, 1}, 1.0 / 11, 0.3, 500);
  spin(net, {1, 4, 0}, {3, 2, 5});
  add_body(d, "net").form = std::move(net);
  StandardScene scene = described(std::move(d),
                                  "A net of 12 × 12 knots, 1 m wide, 0.3 kg, on springs of 500 N/m, is thrown and "
                                  "spins freely. Nothing holds it: momentum is known for ever.",
                                  60);
  scene.free = true;
  return scene;
}

StandardScene jelly_in_flight() {
  SceneDescription d = empty("jelly-flight", "Jelly in free flight", 0.5);
  RawPoints jelly = lattice({6, 6, 6}, 0.04, 1, 2000);
  jelly.points.col(0) *= 1.1;  // it starts stretched and trembles
  spin(jelly, {1, 2, 0}, {3, 5, 2});
  add_body(d, "jelly").form = std::move(jelly);
  StandardScene scene =
      described(std::move(d),
                "A cube of 6 × 6 × 6 points, 0.2 m wide, 1 kg, joined along edges, face diagonals and "
                "body diagonals by springs of 2000 N/m, flies spinning and starts 10 % too long.",
                30);
  scene.free = true;
  return scene;
}

StandardScene sheet(int n) {
  StandardScene scene = described(
      hanging_sheet(n),
      "A sheet of " + std::to_string(n) + " × " + std::to_string(n) +
          " points, 1 m wide and long, 0.3 kg, pinned along its upper edge, is let go at 45° and falls into a swing. "
          "Springs of 500 N/m (structural), 100 N/m (shear) and 5 N/m (bend), no damping. After about 1 s the motion "
          "is chaotic, so 0.5 s are compared.",
      30);
  scene.large = n > 32;
  return scene;
}

StandardScene stiff_sheet() {
  SceneDescription d = hanging_sheet(32);
  d.file = "stiff-sheet";
  d.title = "Stiff hanging sheet, stiffness x 1000";
  auto& material = std::get<FixedMaterial>(d.bodies[0].material);
  for (double* stiffness : {&material.structural, &material.shear, &material.bend}) *stiffness *= 1000;
  StandardScene scene =
      described(std::move(d),
                "The hanging sheet of 32 × 32 points with a thousand times the stiffness: the step is set by motion "
                "that nobody sees.",
                30);
  scene.large = true;
  return scene;
}

StandardScene sheet_over_sphere() {
  SceneDescription d = hanging_sheet(24);
  d.file = "sheet-over-sphere";
  d.title = "Sheet swinging over a fixed sphere";
  d.duration = 0.8;
  d.bodies[0].thickness = 0.01;
  ColliderDescription ball;
  ball.name = "ball";
  ball.path = "colliders[0]";
  ball.solid = MovingShape{Sphere{{0, -0.6, 0}, 0.2}, {}};
  ball.friction = 0.3;
  d.colliders.push_back(std::move(ball));
  StandardScene scene = described(std::move(d),
                                  "A hanging sheet of 24 × 24 points swings down onto a fixed sphere and rubs over it "
                                  "with a friction of 0.3. Contact is not smooth: no method keeps its order across it.",
                                  48);
  scene.compare = Compare::Statistics;
  scene.conservative = false;
  return scene;
}

StandardScene settling_cloth() {
  SceneDescription d = empty("settling-cloth", "Cloth settling on a sphere and the floor", 3);
  SoftBody& cloth = add_body(d, "cloth");
  cloth.origin = {0, 0.6, -0.5};
  cloth.form = Grid{1, 1, 24, 24, {1, 0, 0}, {0, 0, 1}};
  softbody::ClothMaterial material;
  material.density = 0.2;
  material.stretch = 500;
  material.shear = 30;
  material.bend = 1;
  cloth.material = material;
  cloth.wind = softbody::Wind{};
  cloth.thickness = 0.01;
  ColliderDescription ball;
  ball.name = "ball";
  ball.path = "colliders[0]";
  ball.solid = MovingShape{Sphere{{0, 0.3, 0}, 0.25}, {}};
  ball.friction = 0.4;
  ColliderDescription floor;
  floor.name = "floor";
  floor.path = "colliders[1]";
  floor.solid = MovingShape{HalfSpace{}, {}};
  floor.friction = 0.6;
  d.colliders = {std::move(ball), std::move(floor)};
  StandardScene scene =
      described(std::move(d),
                "A damped cloth of 24 × 24 points falls 5 cm onto a sphere, drapes over it and comes to "
                "rest in still air. Asked is where and how wide it ends, not where each fold lies.",
                720);
  scene.compare = Compare::Statistics;
  scene.conservative = false;
  return scene;
}

}  // namespace

SceneDescription hanging_sheet(int n) {
  SceneDescription d = empty("hanging-sheet-" + std::to_string(n), "", 0.5);
  d.title = "Hanging sheet, " + std::to_string(n) + " x " + std::to_string(n) + " points";
  SoftBody& sheet = add_body(d, "sheet");
  sheet.form = Grid{1, 1, n, n, {1, 0, 0}, {0, -1, 1}};
  sheet.material = FixedMaterial{0.3, 500, 100, 5, 0};
  sheet.pin = {"top"};
  return d;
}

std::vector<StandardScene> standard_scenes() {
  std::vector<StandardScene> out;
  for (const auto& make :
       {oscillator, throw_with_linear_drag, throw_with_quadratic_drag, spray_with_linear_drag, rain_with_quadratic_drag,
        ship, bouncing_ball, elastic_pendulum, stiff_pendulum, fput_chain, tumbling_net, jelly_in_flight})
    out.push_back(make());
  for (const int n : {32, 64, 128}) out.push_back(sheet(n));
  for (const auto& make : {stiff_sheet, sheet_over_sphere, settling_cloth}) out.push_back(make());
  return out;
}

}  // namespace hooke::scene
