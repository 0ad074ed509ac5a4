#include <hooke/method.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hooke {

namespace {
constexpr double kAlways = std::numeric_limits<double>::infinity();

// Kick, drift, kick, …, kick from the first half of each, mirrored; what is left of 1 goes to the middle.
Splitting symmetric_kicks(std::vector<double> kick, std::vector<double> drift) {
  const auto mirror = [](std::vector<double>& half, bool single_middle) {
    double rest = single_middle ? 1 : 0.5;
    for (const double c : half) rest -= single_middle ? 2 * c : c;
    std::vector<double> all = half;
    all.push_back(rest);
    if (!single_middle) all.push_back(rest);
    all.insert(all.end(), half.rbegin(), half.rend());
    half = std::move(all);
  };
  const bool kick_in_the_middle = kick.size() > drift.size();
  mirror(kick, kick_in_the_middle);
  mirror(drift, !kick_in_the_middle);
  drift.push_back(0);
  return {kick, drift};
}
}  // namespace

bool Method::adaptive() const {
  const auto* table = std::get_if<RungeKutta>(&scheme);
  return table && !table->error.empty();
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
                             RungeKutta{{{}, {0.5}, {0, 0.5}, {0, 0, 1}}, {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}, 2.615}};
  return method;
}

const Method& pefrl() {
  static const Method method = [] {
    constexpr double xi = 0.1786178958448091, lambda = -0.2123418310626054, chi = -0.06626458266981849;
    constexpr double outer = (1 - 2 * lambda) / 2, middle = 1 - 2 * (chi + xi);
    return Method{"pefrl",
                  4,
                  true,
                  2.9894495,
                  4,
                  false,
                  Splitting{{0, outer, lambda, lambda, outer}, {xi, chi, middle, chi, xi}}};
  }();
  return method;
}

const Method& rkn4() {
  static const Method method{
      "rkn4",
      4,
      false,
      2.5865188,
      3,
      false,
      Nystrom{{0, 0.5, 1}, {{}, {1.0 / 8}, {0, 0.5}}, {1.0 / 6, 1.0 / 3, 0}, {1.0 / 6, 2.0 / 3, 1.0 / 6}}};
  return method;
}

const Method& blanes_moan_4() {
  static const Method method{"blanes-moan-4",
                             4,
                             true,
                             3.1634,
                             6,
                             false,
                             symmetric_kicks({0.0829844064174052, 0.396309801498368, -0.0390563049223486},
                                             {0.245298957184271, 0.604872665711080})};
  return method;
}

const Method& blanes_moan_6() {
  static const Method method{
      "blanes-moan-6",
      6,
      true,
      3.1414,
      11,
      false,
      symmetric_kicks(
          {0.0414649985182624, 0.198128671918067, -0.0400061921041533, 0.0752539843015807, -0.0115113874206879},
          {0.123229775946271, 0.290553797799558, -0.127049212625417, -0.246331761062075, 0.357208872795928})};
  return method;
}

const Method& implicit_midpoint() {
  static const Method method{"implicit-midpoint", 2, true, kAlways, 4, true, Implicit{0, 200, 0.5}};
  return method;
}

const Method& linearised_midpoint() {
  static const Method method{"linearised-midpoint", 2, false, kAlways, 1, true, Implicit{1e-6, 1, 0.5, true}};
  return method;
}

const Method& dormand_prince() {
  static const Method method = [] {
    const std::vector<double> weight{35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84, 0};
    const std::vector<double> fourth{5179.0 / 57600, 0,       7571.0 / 16695, 393.0 / 640, -92097.0 / 339200,
                                     187.0 / 2100,   1.0 / 40};
    RungeKutta table{{{},
                      {1.0 / 5},
                      {3.0 / 40, 9.0 / 40},
                      {44.0 / 45, -56.0 / 15, 32.0 / 9},
                      {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                      {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                      {weight.begin(), weight.end() - 1}},
                     weight,
                     0.9971890,
                     {},
                     true};
    for (std::size_t i = 0; i < weight.size(); ++i) table.error.push_back(weight[i] - fourth[i]);
    return Method{"dormand-prince", 5, false, 0.9971890, 6, true, std::move(table)};
  }();
  return method;
}

std::span<const Method* const> methods() {
  static const std::array all{&explicit_euler(),
                              &semi_implicit_euler(),
                              &implicit_euler(),
                              &verlet(),
                              &velocity_verlet(),
                              &rk2(),
                              &rk4(),
                              &pefrl(),
                              &rkn4(),
                              &blanes_moan_4(),
                              &blanes_moan_6(),
                              &implicit_midpoint(),
                              &linearised_midpoint(),
                              &dormand_prince()};
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
  if (!method.accepts_velocity_forces) gamma = 0;
  if (method.stability_limit == kAlways || (omega == 0 && gamma == 0)) return kAlways;
  // |1 + hλ| ≤ 1 for complex pairs gives γ/ω², for real ones 2/γ at worst.
  if (method.stability_limit == 0) return omega == 0 ? 2 / gamma : std::min(gamma / (omega * omega), 2 / gamma);
  const double limit = method.stability_limit;
  if (!method.accepts_velocity_forces) return limit / omega;
  if (const auto* table = std::get_if<RungeKutta>(&method.scheme)) {
    // Little damping turns hλ to where the region bulges; more turns it to where it is narrowest.
    return gamma <= 0.6 * omega ? limit / omega : table->half_disc / std::max(omega, gamma);
  }
  // h²ω² + phγ = limit², written so that neither ω = 0 nor γ = 0 divides by zero. A predicted
  // velocity answers to the last acceleration, which doubles what damping costs.
  const auto* splitting = std::get_if<Splitting>(&method.scheme);
  const double g = splitting && splitting->kick.size() == 1 ? gamma : 2 * gamma;
  return limit * limit / (g + std::sqrt(g * g + limit * limit * omega * omega));
}

}  // namespace hooke
