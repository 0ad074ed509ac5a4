#include <hooke/softbody/soft_body.hpp>

#include <hooke/softbody/cell_volume_field.hpp>
#include <hooke/softbody/spring_field.hpp>
#include <hooke/softbody/volume_field.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace hooke::softbody {

namespace {

template <class S>
std::unique_ptr<Body> make(const SoftBodySettings& s) {
  const Index n = s.positions.rows();
  if (s.masses.size() != n || (s.velocities.rows() != 0 && s.velocities.rows() != n))
    throw std::invalid_argument("body \"" + s.name + "\": " + std::to_string(n) + " positions, " +
                                std::to_string(s.masses.size()) + " masses and " + std::to_string(s.velocities.rows()) +
                                " velocities do not fit together");
  PointMasses<S> points;
  points.origin = s.origin;
  points.position = s.positions.cast<S>();
  points.velocity = s.velocities.rows() ? Points<S>(s.velocities.cast<S>()) : Points<S>(Points<S>::Zero(n, 3));
  points.mass = s.masses.cast<S>();
  points.inverse_mass = points.mass.inverse();
  const bool filtered = s.motion.method == &filtered_leapfrog();
  if (s.wanted_error != 0 && !filtered)
    throw std::invalid_argument("body \"" + s.name + "\": only filtered-leapfrog takes a wanted error, got method " +
                                std::string(s.motion.method->name));
  const bool projected = s.motion.method == &xpbd();
  if (s.motion.iterations != 0 && !projected)
    throw std::invalid_argument("body \"" + s.name + "\": only xpbd takes iterations, got method " +
                                std::string(s.motion.method->name));
  if (projected && s.volume_stiffness != 0)
    throw std::invalid_argument("body \"" + s.name + "\": xpbd moves springs alone and keeps no volume, got " +
                                std::to_string(s.volume_stiffness) + " Pa for it. Take another method");
  auto body = filtered    ? make_filtered_sheet(s.name, std::move(points), s.motion, s.network, s.wanted_error)
              : projected ? make_xpbd_body(s.name, std::move(points), s.motion, s.network)
                          : std::make_unique<PointBody<S>>(s.name, std::move(points), s.motion);
  for (const Index pin : s.pins) body->pin(pin);
  if (!filtered && !projected && s.network && !s.network->springs.empty())
    body->add_field(
        std::make_unique<SpringField<S>>(s.network, body->state().position, s.precision == Precision::DoubleFloat));
  if (s.volume_stiffness != 0)
    body->add_field(std::make_unique<VolumeField<S>>(s.volume_stiffness, s.triangles, body->state().position));
  if (s.cell_stiffness != 0)
    body->add_field(std::make_unique<CellVolumeField<S>>(s.cell_stiffness, s.cells, body->state().position));
  if (s.wind) body->add_field(std::make_unique<WindField<S>>(*s.wind, s.triangles, n));
  if (s.linear_drag != 0) body->add_field(std::make_unique<LinearDrag<S>>(s.linear_drag));
  if (s.quadratic_drag != 0) body->add_field(std::make_unique<QuadraticDrag<S>>(s.quadratic_drag));
  if (s.precision == Precision::DoubleFloat && !body->fused())
    throw std::invalid_argument("body \"" + s.name +
                                "\": double-float takes undamped springs of a grid alone, and a splitting method; got "
                                "method " +
                                std::string(s.motion.method->name) + ". Take double");
  return body;
}

}  // namespace

Precision precision_named(std::string_view name) {
  for (const Precision precision : {Precision::Automatic, Precision::Float, Precision::Double, Precision::DoubleFloat})
    if (precision_name(precision) == name) return precision;
  throw std::invalid_argument("no precision is called \"" + std::string(name) +
                              "\"; there are automatic, float, double, double-float");
}

std::string_view precision_name(Precision precision) {
  switch (precision) {
    case Precision::Automatic:
      return "automatic";
    case Precision::Float:
      return "float";
    case Precision::Double:
      return "double";
    case Precision::DoubleFloat:
      break;
  }
  return "double-float";
}

namespace {

template <class Form>
SoftBodySettings taken_from(const Form& form) {
  SoftBodySettings settings;
  settings.positions = form.positions;
  settings.masses = form.masses;
  settings.network = form.network;
  settings.triangles = form.triangles;
  return settings;
}

}  // namespace

SoftBodySettings settings_of(const Cloth& cloth) { return taken_from(cloth); }

SoftBodySettings settings_of(const Lattice& lattice) {
  SoftBodySettings settings = taken_from(lattice);
  settings.cells = lattice.points;
  settings.cell_stiffness = lattice.cell_stiffness;
  return settings;
}

Precision resolved_precision(const SoftBodySettings& s) {
  if (s.precision != Precision::Automatic) return s.precision;
  const Method& method = *s.motion.method;
  const bool loses = (!method.symplectic && method.stability_limit == std::numeric_limits<double>::infinity()) ||
                     s.wind || s.linear_drag != 0 || s.quadratic_drag != 0;
  if (loses || !s.network || s.network->springs.empty() || s.masses.size() != s.positions.rows())
    return Precision::Float;
  double stiffness = 0;
  for (const Spring& spring : s.network->springs) {
    if (spring.damping > 0) return Precision::Float;
    stiffness += 2 * spring.stiffness;  // at both ends
  }
  const SpringField<double> field(s.network, s.positions);
  const double omega = std::sqrt(
      field.rate_bounds(s.positions, Points<double>::Zero(s.positions.rows(), 3), s.masses.inverse()).omega_squared);
  const double h = s.motion.dt > 0 ? s.motion.dt : 0.9 * largest_stable_step(method, omega, 0);
  const double size = (s.positions.colwise().maxCoeff() - s.positions.colwise().minCoeff()).matrix().norm();
  const double rounding = double(std::numeric_limits<float>::epsilon()) * s.positions.abs().maxCoeff() / std::sqrt(12);
  constexpr double kMinute = 60, kMeasured = 1.0 / 6, kGravity = 9.81, kShare = 1e-3;
  const double heat = kMinute * kMeasured * 1.5 * stiffness * rounding * rounding / h;
  // A sheet that swings down exchanges about a seventh of its weight times its size.
  return heat > kShare * 0.15 * s.masses.sum() * kGravity * size ? Precision::Double : Precision::Float;
}

std::unique_ptr<Body> make_soft_body(const SoftBodySettings& settings) {
  SoftBodySettings s = settings;
  s.precision = resolved_precision(settings);
  return s.precision == Precision::Float ? make<float>(s) : make<double>(s);
}

}  // namespace hooke::softbody
