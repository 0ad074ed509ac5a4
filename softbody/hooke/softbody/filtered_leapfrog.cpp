#include <hooke/softbody/filtered_leapfrog.hpp>

#include <hooke/softbody/filtered_sheet.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace hooke::softbody {

namespace {

// Measured on hanging sheets: error = kErrorFactor · L (c h / L)^kErrorPower.
constexpr double kErrorFactor = 0.11, kErrorPower = 1.33;
// Lowering the stiffness costs so many times the static extension under the sheet's own weight.
constexpr double kCapFactor = 1.5;
constexpr double kGravity = 9.81;
// The automatic step's error as a share of the sheet's size.
constexpr double kDefaultError = 0.01;

double step_of_error(double error, double length, double wave_speed) {
  return length / wave_speed * std::pow(error / (kErrorFactor * length), 1 / kErrorPower);
}

// The network with all springs softer; damping ratios are kept.
std::shared_ptr<const SpringNetwork> softened(std::shared_ptr<const SpringNetwork> network, double scale) {
  if (scale == 1) return network;
  auto out = std::make_shared<SpringNetwork>(*network);
  for (Spring& spring : out->springs) spring.stiffness *= scale, spring.damping *= std::sqrt(scale);
  return out;
}

template <class S>
const FilteredSheet<S>* as_sheet(const Body& body) {
  return dynamic_cast<const FilteredSheet<S>*>(&body);
}

}  // namespace

const Method& filtered_leapfrog() {
  static const Method method = [] {
    Method m = velocity_verlet();
    m.name = "filtered-leapfrog";
    m.stability_limit = std::numeric_limits<double>::infinity();
    return m;
  }();
  return method;
}

std::string FilteredFacts::text() const {
  std::ostringstream out;
  out.precision(3);
  out << (filtered ? "filtered" : "plain leapfrog at this step") << ", waves of " << wave_speed << " m/s travel "
      << travel << " of the sheet a step";
  if (stiffness_scale < 1) out << ", stiffness lowered to " << stiffness_scale << " of the given one";
  out << ", expected error " << expected_error << " m";
  if (freezes())
    out << "; warning: the step is so large that the motion freezes, lower dt below " << 1e3 * kFreeze * step / travel
        << " ms";
  return out.str();
}

std::optional<FilteredFacts> filtered_facts(const Body& body) {
  if (const auto* sheet = as_sheet<float>(body)) return sheet->facts();
  if (const auto* sheet = as_sheet<double>(body)) return sheet->facts();
  return std::nullopt;
}

double filtered_energy(const Body& body, const Vec3& gravity) {
  if (const auto* sheet = as_sheet<float>(body)) return sheet->kept_energy(gravity);
  if (const auto* sheet = as_sheet<double>(body)) return sheet->kept_energy(gravity);
  throw std::invalid_argument("body \"" + body.name() + "\" is not moved by filtered-leapfrog");
}

SheetPlan::SheetPlan(std::shared_ptr<const SpringNetwork> given, const Points<double>& start,
                     const Values<double>& mass, double dt, double wanted_error)
    : grid(SpringGrid::of(*given, mass.size())), mass_model(grid, mass) {
  if (!(wanted_error >= 0) || !std::isfinite(wanted_error))
    throw std::invalid_argument("filtered-leapfrog: wanted error must not be negative, got " +
                                std::to_string(wanted_error) + " m");
  if (wanted_error > 0 && dt > 0)
    throw std::invalid_argument("filtered-leapfrog: give a step or a wanted error, not both");
  automatic = dt == 0;
  const std::vector<double> rest = rest_lengths(*given, start);
  const auto measure = [&](Direction along, Index count) {
    double sum = 0;
    Index springs = 0;
    for (const int spring : grid.springs[along])
      if (spring >= 0) sum += rest[std::size_t(spring)], ++springs;
    return springs ? sum / double(springs) * double(count - 1) : 0;
  };
  width = measure(kRight, grid.columns), height = measure(kDown, grid.rows);
  network = given;
  undamped = line_stiffness(0);
  const auto speed = [](double length, Index count, double rate) {
    return count > 1 ? length / double(count - 1) * std::sqrt(rate) : 0;
  };
  speed_x = speed(width, grid.columns, undamped.x), speed_y = speed(height, grid.rows, undamped.y);

  // The slower of both directions decides: c h / L is largest there.
  const bool across = width > 0 && (height == 0 || speed_x / width > speed_y / height);
  const double length = across ? width : height, fastest = across ? speed_x : speed_y;
  if (!(length > 0) || !(fastest > 0)) {
    step = dt > 0 ? dt : 1;
    return;
  }
  step = dt;
  if (wanted_error > 0) {
    // Both errors add up as squares: E² = (B (1/s - 1))² + (0.11 L (c √s h / L)^1.33)². The largest h of that is where
    // 5/2 u² - 7/2 u + 1 = (E / B)², u = 1/s.
    const double extension = kCapFactor * extension_under_weight(mass);
    const double softer = extension > 0 ? 0.7 + 0.2 * std::sqrt(2.25 + 10 * std::pow(wanted_error / extension, 2)) : 1;
    if (softer > 1) {
      stiffness_scale = 1 / softer;
      cap_error = extension * (softer - 1);
      network = softened(given, stiffness_scale);
      speed_x *= std::sqrt(stiffness_scale), speed_y *= std::sqrt(stiffness_scale);
      undamped.x *= stiffness_scale, undamped.y *= stiffness_scale;
    }
    step = step_of_error(std::sqrt(wanted_error * wanted_error - cap_error * cap_error), length,
                         fastest * std::sqrt(stiffness_scale));
  } else if (dt == 0) {
    step = step_of_error(kDefaultError * length, length, fastest);
  }
}

// The largest stiffness over mass of any edge along rows and columns [1/s²]; dampers count with 4 c / h.
// Diagonals act on the edges of their cell, skipping springs on both edges they span.
SheetPlan::LineStiffness SheetPlan::line_stiffness(double h) const {
  const auto stiffness = [&](Direction direction, Index r, Index c) {
    if (r < 0 || c < 0 || r >= grid.rows || c >= grid.columns) return 0.0;
    const int i = grid.springs[direction][std::size_t(r * grid.columns + c)];
    if (i < 0) return 0.0;
    const Spring& spring = network->springs[std::size_t(i)];
    return spring.stiffness + (h > 0 ? 4 * spring.damping / h : 0);
  };
  const auto cell = [&](Index r, Index c) {
    return std::max(stiffness(kDiagonal, r, c), stiffness(kAntidiagonal, r, c));
  };
  LineStiffness out;
  for (Index r = 0; r < grid.rows; ++r)
    for (Index c = 0; c < grid.columns; ++c) {
      if (c + 1 < grid.columns) {
        const double k = stiffness(kRight, r, c) + cell(r - 1, c) + cell(r, c) +
                         2 * (stiffness(kRight2, r, c) + stiffness(kRight2, r, c - 1));
        out.x = std::max(out.x, k / (mass_model.unit * mass_model.row[r]));
      }
      if (r + 1 < grid.rows) {
        const double k = stiffness(kDown, r, c) + cell(r, c - 1) + cell(r, c) +
                         2 * (stiffness(kDown2, r, c) + stiffness(kDown2, r - 1, c));
        out.y = std::max(out.y, k / (mass_model.unit * mass_model.column[c]));
      }
    }
  return out;
}

// W / (2 K), with K the end-to-end stiffness of the columns, or of the rows where that is less.
double SheetPlan::extension_under_weight(const Values<double>& mass) const {
  const auto end_to_end = [&](Direction along, Index lines, Index links, auto at) {
    double sum = 0;
    for (Index line = 0; line < lines; ++line) {
      double give = 0;
      for (Index link = 0; link + 1 < links; ++link) {
        const int spring = grid.springs[along][std::size_t(at(line, link))];
        give +=
            spring < 0 ? std::numeric_limits<double>::infinity() : 1 / network->springs[std::size_t(spring)].stiffness;
      }
      sum += give > 0 ? 1 / give : 0;
    }
    return sum;
  };
  const double down =
      end_to_end(kDown, grid.columns, grid.rows, [&](Index c, Index r) { return r * grid.columns + c; });
  const double right =
      end_to_end(kRight, grid.rows, grid.columns, [&](Index r, Index c) { return r * grid.columns + c; });
  const double weight = mass.sum() * kGravity, least = std::min(down, right);
  return least > 0 ? weight / (2 * least) : 0;
}

double SheetPlan::travel(double h) const {
  return std::max(width > 0 ? speed_x * h / width : 0, height > 0 ? speed_y * h / height : 0);
}

double SheetPlan::expected_error(double h) const {
  const double length = width > 0 && (height == 0 || speed_x / width > speed_y / height) ? width : height;
  return std::hypot(kErrorFactor * length * std::pow(travel(h), kErrorPower), cap_error);
}

template <class S>
std::unique_ptr<PointBody<S>> make_filtered_sheet(std::string name, PointMasses<S> points,
                                                  const MotionSettings& settings,
                                                  std::shared_ptr<const SpringNetwork> network, double wanted_error) {
  if (!network) throw std::invalid_argument("body \"" + name + "\": filtered-leapfrog needs springs");
  try {
    SheetPlan plan(std::move(network), points.position.template cast<double>(), points.mass.template cast<double>(),
                   settings.dt, wanted_error);
    return std::make_unique<FilteredSheet<S>>(name, std::move(points), settings, std::move(plan));
  } catch (const std::invalid_argument& error) {
    const std::string text = error.what();
    throw std::invalid_argument(text.rfind("body ", 0) == 0 ? text : "body \"" + name + "\": " + text);
  }
}

template std::unique_ptr<PointBody<float>> make_filtered_sheet(std::string, PointMasses<float>, const MotionSettings&,
                                                               std::shared_ptr<const SpringNetwork>, double);
template std::unique_ptr<PointBody<double>> make_filtered_sheet(std::string, PointMasses<double>, const MotionSettings&,
                                                                std::shared_ptr<const SpringNetwork>, double);

}  // namespace hooke::softbody
