#include "trial.hpp"

#include <hooke/error.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <algorithm>
#include <bit>
#include <stdexcept>

namespace hooke::stability {

namespace {

constexpr double kAllowed = 1e8, kThoroughFactor = 200;
constexpr double kImplicitWork = 16;  // of a force or product in a solve, where gradients come on top

double dot(const Points<double>& a, const Points<double>& b) { return (a * b).sum(); }

// The total energy [J], of filtered leapfrog the one that it keeps.
double energy_of(const World& world) {
  double sum = 0;
  for (const auto& body : world.bodies())
    sum += softbody::filtered_facts(*body) ? softbody::filtered_energy(*body, world.gravity())
                                           : body->energy(world.gravity()).total();
  return sum;
}

}  // namespace

const char* name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::Met:
      return "met";
    case Outcome::Missed:
      return "missed";
    case Outcome::Broke:
      return "broke";
    case Outcome::NotClaimed:
      return "not claimed";
    default:
      return "too dear";
  }
}

std::vector<std::string> solvers() {
  std::vector<std::string> out{"velocity-verlet",   "verlet",           "semi-implicit-euler", "rk4", "implicit-euler",
                               "implicit-midpoint", "filtered-leapfrog"};
  // Of soft bodies alone, where the build has it.
  try {
    Solver solver;
    solver.method = "xpbd";
    build(scene::hanging_sheet(2), solver);
    out.emplace_back("xpbd");
  } catch (const std::exception&) {
  }
  return out;
}

scene::Scene build(scene::SceneDescription description, const Solver& solver) {
  for (scene::SoftBody& body : description.bodies) body.solver = solver;
  return scene::build(description);
}

bool is_explicit(const std::string& method) {
  for (const Method* known : methods())
    if (known->name == method) return std::isfinite(known->stability_limit);
  return false;
}

Row measure(const Case& hard, const Trial& trial) {
  Row row;
  row.hard = hard.name;
  row.parameter = trial.parameter;
  row.method = trial.solver.method;
  row.precision = softbody::precision_name(trial.solver.precision);
  try {
    hard.run(trial, row);
  } catch (const NoClaim& refusal) {
    row.outcome = Outcome::NotClaimed;
    row.said = refusal.reason;
  } catch (const std::invalid_argument& error) {
    row.outcome = Outcome::NotClaimed;
    row.said = error.what();
  } catch (const Error& error) {
    row.outcome = Outcome::NotClaimed;
    row.said = error.what();
  }
  return row;
}

double rms_speed(const World& world) {
  double sum = 0;
  Index count = 0;
  for (const auto& body : world.bodies()) {
    const Points<double> v = body->velocities();
    for (Index i = 0; i < v.rows(); ++i)
      if (!body->pinned(i)) sum += v.row(i).square().sum(), ++count;
  }
  return count ? std::sqrt(sum / double(count)) : 0;
}

double allowance(const Trial& trial, double share) { return share * kAllowed * (trial.thorough ? kThoroughFactor : 1); }

bool asleep(const World& world) {
  return std::all_of(world.bodies().begin(), world.bodies().end(), [](const auto& body) { return body->asleep(); });
}

Watch::Watch(World& world, Row& row, double reach, double allowed)
    : world_(world), row_(row), reach_(reach), allowed_(allowed) {
  for (const auto& body : world.bodies()) start_.push_back(body->positions());
  energy_start_ = highest_ = energy_of(world);
  exchanged_ = world.energy().kinetic;
}

double Watch::work() const {
  double sum = 0;
  for (const auto& body : world_.bodies()) {
    const MotionFacts facts = body->motion_facts();
    const double each = facts.method.starts_with("implicit") ? kImplicitWork : 1;
    sum += each * double(facts.evaluations + 2 * facts.products) * 4 * double(body->size());
  }
  return sum;
}

// Explicit methods tell beforehand how many steps they need.
bool Watch::refuse_if_too_dear(double seconds) {
  if (asleep(world_)) return false;
  double sum = 0;
  for (const auto& body : world_.bodies()) {
    const MotionFacts facts = body->motion_facts();
    if (!is_explicit(facts.method)) continue;
    const double dt = facts.wanted_dt > 0 ? facts.wanted_dt : 0.9 * facts.stable_step;
    if (!(dt > 0) || !std::isfinite(dt)) continue;
    sum += std::max(seconds / dt, seconds * world_.clock().tick_rate()) * method_named(facts.method).evaluations * 4 *
           double(body->size());
  }
  if (sum <= allowed_) return false;
  row_.outcome = Outcome::TooDear;
  row_.said = format("needs %.1e spring forces, %.1e are allowed", sum, allowed_);
  return true;
}

bool Watch::left() const {
  for (std::size_t b = 0; b < start_.size(); ++b) {
    const double far = (world_.bodies()[b]->positions() - start_[b]).abs().maxCoeff();
    if (!(far <= reach_)) return true;
  }
  return false;
}

void Watch::measure_energy() {
  const Energy now = world_.energy();
  highest_ = std::max(highest_, energy_of(world_));
  // What a motion that keeps its energy would have as kinetic one here: a blow-up does not count itself.
  exchanged_ = std::max(exchanged_, energy_start_ - now.gravitational - now.elastic);
  row_.energy_growth = (highest_ - energy_start_) / exchanged_;
}

void Watch::listen(const StepReport& report) {
  const std::string text = report.text();
  if (row_.said.find(text) == std::string::npos && row_.said.size() < 400)
    row_.said += (row_.said.empty() ? "" : "; ") + text;
  if (std::isnan(told_at) && report.status == StepReport::Status::StepTooLong) told_at = report.time;
}

bool Watch::run(double until) {
  if (!row_.bounded() || refuse_if_too_dear(until - world_.time())) return false;
  while (world_.time() < until - 1e-9) {
    if (before) before();
    const StepReport report = world_.update(std::min(frame, until - world_.time()));
    row_.simulated = world_.time();
    for (const StepReport& warning : world_.take_warnings()) listen(warning);
    if (!report.good()) {
      row_.outcome = Outcome::Broke;
      row_.failed_at = report.time;
      listen(report);
      return false;
    }
    if (energy) measure_energy();
    if (look) look();
    if (left()) {
      row_.outcome = Outcome::Broke;
      row_.failed_at = world_.time();
      if (row_.said.empty()) row_.said = format("left the scene by more than %g m and nothing was said", reach_);
      return false;
    }
    if (work() > allowed_ && world_.time() < until - 1e-9) {
      row_.outcome = Outcome::TooDear;
      row_.said += format("%.1e spring forces were spent after %.3g of %.3g s", work(), world_.time(), until);
      return false;
    }
  }
  return true;
}

void judge(Row& row, double figure, double gate) {
  row.gate = gate;
  if (!row.measured()) return;
  row.figure = figure;
  if (row.bounded()) row.outcome = figure <= gate ? Outcome::Met : Outcome::Missed;
}

void judge(Row& row) {
  if (row.bounded()) row.outcome = Outcome::Met;
}

Balance balance_of(const scene::SceneBody& body, const Vec3& gravity) {
  using Field = softbody::SpringField<double>;
  const Points<double> start = body.body->start_positions();
  const Field field(body.network, start);
  const Values<double> mass = body.body->masses();
  const Index n = mass.size();
  Values<double> free(n);
  Points<double> weight(n, 3);
  for (Index i = 0; i < n; ++i) {
    free[i] = body.held[std::size_t(i)] ? 0 : 1;
    weight.row(i) = mass[i] * free[i] * gravity.transpose().array();
  }
  const auto only_free = [&](Points<double>& p) { p.colwise() *= free; };
  const double total = (mass * free).sum() * gravity.norm();
  const auto energy = [&](const Points<double>& x) { return field.potential_energy(x) - dot(weight, x); };
  const auto force = [&](const Points<double>& x) {
    Points<double> f = weight, still = Points<double>::Zero(n, 3);
    field.add_force(x, still, 0, f);
    only_free(f);
    return f;
  };

  Balance out;
  Points<double> x = body.body->positions(), f = force(x);
  // What springs do not hold is held by this much [N/m], less the better it goes.
  double held = total;
  for (int step = 0; step < 3000; ++step) {
    out.residual = f.matrix().rowwise().norm().maxCoeff() / total;
    if (out.residual < 1e-10 || (step > 300 && out.residual < 1e-6)) break;
    Points<double> d = Points<double>::Zero(n, 3), r = f, p = f;
    const double enough = 1e-8 * dot(r, r);
    double rr = dot(r, r);
    for (int i = 0; i < 4 * n && rr > enough; ++i) {
      Points<double> product = held * p;
      field.add_stiffness_times(x, p, true, product);
      only_free(product);
      const double alpha = rr / dot(p, product);
      d += alpha * p;
      r -= alpha * product;
      const double next = dot(r, r);
      p = r + next / rr * p;
      rr = next;
    }
    const double before = energy(x), slope = dot(f, d);
    double share = 1;
    while (share > 1e-6 && energy(x + share * d) > before - 1e-4 * share * slope + 1e-14 * std::abs(before)) share /= 2;
    x += share * d;
    f = force(x);
    held = share == 1 ? std::max(0.3 * held, 1e-9 * total) : std::min(4 * held, 1e6 * total);
  }
  out.positions = x;
  return out;
}

namespace {

template <class S>
void hash_bits(std::uint64_t& hash, const Points<S>& p) {
  using Bits = std::conditional_t<std::is_same_v<S, float>, std::uint32_t, std::uint64_t>;
  for (Index i = 0; i < p.size(); ++i) {
    auto bits = std::bit_cast<Bits>(p.data()[i]);
    for (std::size_t byte = 0; byte < sizeof bits; ++byte, bits = Bits(std::uint64_t(bits) >> 8))
      hash = (hash ^ (bits & 0xff)) * 0x100000001b3ull;
  }
}

}  // namespace

std::uint64_t state_hash(const World& world) {
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (const auto& body : world.bodies()) {
    if (const auto* single = dynamic_cast<const PointBody<float>*>(body.get())) {
      hash_bits(hash, single->state().position), hash_bits(hash, single->state().velocity);
    } else if (const auto* twice = dynamic_cast<const PointBody<double>*>(body.get())) {
      hash_bits(hash, twice->state().position), hash_bits(hash, twice->state().velocity);
    }
  }
  return hash;
}

}  // namespace hooke::stability
