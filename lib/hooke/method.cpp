#include <hooke/method.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace hooke {

namespace {
constexpr double kAlways = std::numeric_limits<double>::infinity();
}

const Method& explicit_euler() {
  static const Method method{"explicit-euler", 1, false, 0, 1, true, RungeKutta{{{}}, {1}}};
  return method;
}

const Method& semi_implicit_euler() {
  static const Method method{"semi-implicit-euler", 1, true, 2, 1, true, Splitting{{1}, {1}}};
  return method;
}

const Method& implicit_euler() {
  static const Method method{"implicit-euler", 1, false, kAlways, 4, true, Implicit{}};
  return method;
}

const Method& verlet() {
  static const Method method{"verlet", 2, true, 2, 1, true, Verlet{}};
  return method;
}

const Method& velocity_verlet() {
  static const Method method{"velocity-verlet", 2, true, 2, 1, true, Splitting{{0.5, 0.5}, {1, 0}}};
  return method;
}

const Method& rk2() {
  static const Method method{"rk2", 2, false, 0, 2, true, RungeKutta{{{}, {0.5}}, {0, 1}}};
  return method;
}

const Method& rk4() {
  static const Method method{"rk4",
                             4,
                             false,
                             2 * std::sqrt(2.0),
                             4,
                             true,
                             RungeKutta{{{}, {0.5}, {0, 0.5}, {0, 0, 1}}, {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}}};
  return method;
}

std::span<const Method* const> methods() {
  static const std::array<const Method*, 7> all{
      &explicit_euler(), &semi_implicit_euler(), &implicit_euler(), &verlet(), &velocity_verlet(), &rk2(), &rk4()};
  return all;
}

const Method& method_named(std::string_view name) {
  std::string known;
  for (const Method* method : methods()) {
    if (method->name == name) return *method;
    known += (known.empty() ? "" : ", ") + std::string(method->name);
  }
  throw std::invalid_argument("no method is called \"" + std::string(name) + "\"; there are " + known);
}

double largest_stable_step(const Method& method, double omega, double gamma) {
  if (method.stability_limit == kAlways || (omega == 0 && gamma == 0)) return kAlways;
  // |1 + hλ| ≤ 1 for complex pairs gives γ/ω², for real ones 2/γ at worst.
  if (method.stability_limit == 0) return omega == 0 ? 2 / gamma : std::min(gamma / (omega * omega), 2 / gamma);
  const double limit = method.stability_limit;
  if (std::holds_alternative<RungeKutta>(method.scheme)) {
    // Little damping turns hλ to where the region bulges; more turns it to where it is narrowest.
    constexpr double kHalfDisc = 2.615 / (2 * std::numbers::sqrt2);
    return gamma <= 0.6 * omega ? limit / omega : kHalfDisc * limit / std::max(omega, gamma);
  }
  // h²ω² + phγ = limit², written so that neither ω = 0 nor γ = 0 divides by zero. A predicted
  // velocity answers to the last acceleration, which doubles what damping costs.
  const auto* splitting = std::get_if<Splitting>(&method.scheme);
  const double g = splitting && splitting->kick.size() == 1 ? gamma : 2 * gamma;
  return limit * limit / (g + std::sqrt(g * g + limit * limit * omega * omega));
}

}  // namespace hooke
