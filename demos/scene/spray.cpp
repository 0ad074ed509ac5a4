#include <scene/spray.hpp>

#include <hooke/particles/particle_system.hpp>

#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

namespace hooke::scene {

namespace {

constexpr Index kCount = 4096;
constexpr double kGravity = 9.81, kRate = 0.1, kQuadratic = 0.01;

// The golden spiral: directions evenly over the sphere.
Vec3 direction(Index i) {
  const double z = 1 - (2 * double(i) + 1) / double(kCount), turn = std::numbers::pi * (3 - std::sqrt(5.0)) * double(i);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), z, r * std::sin(turn)};
}

template <class S>
std::unique_ptr<Body> system_of(const Solver& solver, bool quadratic) {
  particles::ParticleSettings settings;
  settings.method = &method_named(solver.method);
  settings.dt = solver.dt;
  settings.tolerance = solver.tolerance;
  settings.capacity = kCount;
  auto system = std::make_unique<particles::ParticleSystem<S>>(settings);
  if (quadratic)
    system->add_force(std::make_unique<particles::QuadraticDrag<S>>(kQuadratic));
  else
    system->add_force(std::make_unique<particles::LinearDrag<S>>(kRate));
  for (Index i = 0; i < kCount; ++i) {
    particles::Birth birth;
    birth.velocity = quadratic ? Vec3(0, -25.0 * double(i) / double(kCount), 0) : Vec3(30 * direction(i));
    system->add(birth);
  }
  return system;
}

StandardScene particle_scene(bool quadratic) {
  StandardScene scene;
  scene.duration = 3, scene.ticks = 3;
  scene.conservative = false;
  scene.build = [quadratic](const Solver& solver) {
    if (solver.precision == softbody::Precision::DoubleFloat)
      throw std::invalid_argument("particle systems are moved in float or double");
    World world(1);
    world.set_gravity({0, -kGravity, 0});
    world.add(solver.precision != softbody::Precision::Double ? system_of<float>(solver, quadratic)
                                                              : system_of<double>(solver, quadratic));
    return world;
  };
  return scene;
}

}  // namespace

StandardScene spray_with_linear_drag() {
  StandardScene scene = particle_scene(false);
  scene.name = "spray-linear-drag", scene.title = "Particle system: 4,096 thrown with linear drag";
  scene.problem =
      "A particle system of 4,096 particles of one kilogram, thrown in all directions at 30 m/s against a drag of 0.1 "
      "N·s/m. "
      "Splitting methods run in the fused loop of particle systems, the others through the core; divide the time by "
      "4,096 for "
      "the cost of a particle.";
  scene.exact = [](double t) {
    const double slowed = (1 - std::exp(-kRate * t)) / kRate, fall = kGravity / kRate;
    Points<double> out(kCount, 3);
    for (Index i = 0; i < kCount; ++i) {
      const Vec3 v = 30 * direction(i);
      out.row(i) << v.x() * slowed, (v.y() + fall) * slowed - fall * t, v.z() * slowed;
    }
    return out;
  };
  return scene;
}

StandardScene rain_with_quadratic_drag() {
  StandardScene scene = particle_scene(true);
  scene.name = "rain-quadratic-drag", scene.title = "Particle system: 4,096 falling with quadratic drag";
  scene.problem =
      "A particle system of 4,096 particles of one kilogram that start downwards at 0 to 25 m/s, braked by 0.01 "
      "N·s²/m² times "
      "their speed squared: a force that depends on velocity, evaluated tile by tile. Divide the time by 4,096 for the "
      "cost of a "
      "particle.";
  scene.exact = [](double t) {
    const double terminal = std::sqrt(kGravity / kQuadratic);
    Points<double> out = Points<double>::Zero(kCount, 3);
    for (Index i = 0; i < kCount; ++i) {
      const double start = std::atanh(25.0 * double(i) / double(kCount) / terminal);
      out(i, 1) =
          -terminal * terminal / kGravity * std::log(std::cosh(kGravity * t / terminal + start) / std::cosh(start));
    }
    return out;
  };
  return scene;
}

}  // namespace hooke::scene
