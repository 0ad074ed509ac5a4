#include <hooke/point_body.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace hooke {

namespace {

// The automatic step keeps this share of the largest stable one: stiffness may grow a little
// until it is looked at again.
constexpr double kStepSafety = 0.9;
// How often the automatic step is looked at again [s].
constexpr double kEstimateInterval = 1.0 / 30;
// Positions and velocities below this never make a force overflow by themselves.
constexpr double kOrdinary = 1e9;
// A given substep is held against the stable one this often [s].
constexpr double kStepCheckInterval = 0.25;
// The automatic step of undamped bodies keeps the swing of their energy below this share of what their motion
// exchanges. It is looked at this often to begin with, and later whenever twice the time has passed, at least this
// often [s].
constexpr double kSwing = 8e-4;
constexpr double kSwingInterval = 0.25, kLongestSwingInterval = 2;
// Bodies are not taken to be smaller where their origin follows them [m].
constexpr double kLeastSize = 0.25;
// Of the energy of bodies whose points are all off by a rounding, an evaluation of the forces adds less than this by
// its rounding: 0.02 where springs and steps are stiffest.
constexpr double kKick = 1.0 / 32;
// Methods without a stable step still need one: ω h of this.
constexpr double kUnstablePhase = 0.05;

void check_finite(const Vec3& value, const char* what) {
  if (!value.allFinite()) throw std::invalid_argument(std::string(what) + " must be finite");
}

}  // namespace

template <class S>
PointBody<S>::PointBody(std::string name, PointMasses<S> points, MotionSettings settings)
    : Body(std::move(name)),
      points_(std::move(points)),
      settings_(settings),
      integrator_(*settings.method, settings.compensated && std::is_same_v<S, float>) {
  const auto fail = [&](const std::string& rule) {
    throw std::invalid_argument("body \"" + this->name() + "\": " + rule);
  };
  const Index n = points_.size();
  if (points_.velocity.rows() != n || points_.mass.size() != n || points_.inverse_mass.size() != n)
    fail("position, velocity, mass and inverse_mass must have the same length");
  if (!points_.origin.allFinite() || !points_.position.allFinite() || !points_.velocity.allFinite())
    fail("positions and velocities must be finite");
  if (n > 0 && !((points_.mass > S(0)).all() && points_.mass.allFinite())) fail("masses must be positive");
  if (n > 0 && !((points_.inverse_mass >= S(0)).all() && points_.inverse_mass.allFinite()))
    fail("inverse masses must not be negative");
  if (!(settings_.dt >= 0) || !std::isfinite(settings_.dt)) fail("dt must not be negative");
  if (!(settings_.thickness >= 0) || !std::isfinite(settings_.thickness)) fail("thickness must not be negative");
  if (!(settings_.tolerance > 0) || !std::isfinite(settings_.tolerance)) fail("tolerance must be positive");
  if (settings_.retries < 0) fail("retries must not be negative");
  start_ = previous_position_ = points_.position;
  start_origin_ = points_.origin;
  previous_velocity_ = points_.velocity;
}

template <class S>
void PointBody<S>::add_field(std::unique_ptr<const ForceField<S>> field) {
  passive_ = passive_ && field->passive();
  may_follow_ = may_follow_ && field->anywhere();
  wake();
  if (field->once_a_tick()) {
    held_fields_.push_back(std::move(field));
    return;
  }
  if (field->uses_velocity() && !settings_.method->accepts_velocity_forces)
    throw std::invalid_argument("body \"" + name() + "\": method " + std::string(settings_.method->name) +
                                " accepts no forces of velocity (drag, dampers, wind)");
  uses_velocity_ = uses_velocity_ || field->uses_velocity();
  fields_.push_back(std::move(field));
  const bool alone = fields_.size() == 1;
  stepper_ = alone ? fields_[0]->stepper() : nullptr;
  const bool fine = stepper_ && settings_.compensated && std::is_same_v<S, float> &&
                    std::holds_alternative<Splitting>(settings_.method->scheme);
  fine_stepper_ = fine ? fields_[0]->fine_stepper() : nullptr;
  last_estimate_ = -1;
}

template <class S>
void PointBody<S>::check(Index point) const {
  if (point < 0 || point >= size())
    throw std::out_of_range("body \"" + name() + "\": point " + std::to_string(point) + " of " +
                            std::to_string(size()));
}

template <class S>
Points<double> PointBody<S>::world(const Points<S>& p) const {
  return p.template cast<double>().rowwise() + points_.origin.transpose().array();
}

template <class S>
Points<double> PointBody<S>::positions_between(double fraction) const {
  const Points<double> before = world(previous_position_);
  return before + fraction * (positions() - before);
}

template <class S>
void PointBody<S>::set_position(Index point, const Vec3& position) {
  check(point);
  check_finite(position, "position");
  points_.position.row(point) = (position - points_.origin).transpose().template cast<S>();
  previous_position_.row(point) = points_.position.row(point);
  changed(point);
}

template <class S>
void PointBody<S>::set_velocity(Index point, const Vec3& velocity) {
  check(point);
  check_finite(velocity, "velocity");
  points_.velocity.row(point) = velocity.transpose().template cast<S>();
  changed(point);
}

// Somebody has edited a point.
template <class S>
void PointBody<S>::changed(Index point) {
  integrator_.drop_low(point);
  free_mass_ = -1;
  wake();
}

template <class S>
void PointBody<S>::wake() {
  asleep_ = false;
  quiet_since_ = tick_.end;
  energy_watch_.forget();
}

template <class S>
void PointBody<S>::hold(Index point) {
  points_.inverse_mass[point] = 0;
  points_.velocity.row(point).setZero();
  changed(point);
}

template <class S>
void PointBody<S>::pin(Index point) {
  check(point);
  hold(point);
}

template <class S>
void PointBody<S>::release(Index point) {
  check(point);
  points_.inverse_mass[point] = 1 / points_.mass[point];
  std::erase_if(moving_, [&](const Moving& pin) { return pin.point == point; });
  for (Driven& group : driven_)
    for (Index& driven : group.points)
      if (driven == point) driven = -1;
  last_estimate_ = -1;
  changed(point);
}

template <class S>
bool PointBody<S>::pinned(Index point) const {
  check(point);
  return points_.inverse_mass[point] == 0;
}

template <class S>
void PointBody<S>::move_pin(Index point, const Vec3& target) {
  check(point);
  check_finite(target, "pin target");
  if (!pinned(point))
    throw std::invalid_argument("body \"" + name() + "\": point " + std::to_string(point) +
                                " is not pinned; pin it before moving it");
  const Vec3 from = points_.origin + points_.position.row(point).matrix().transpose().template cast<double>();
  std::erase_if(moving_, [&](const Moving& pin) { return pin.point == point; });
  moving_.push_back({point, from, target});
  wake();
}

template <class S>
void PointBody<S>::drive_pins(std::vector<Index> points, PinMotion motion) {
  for (const Index point : points) check(point);
  for (const Index point : points) hold(point);
  Points<double> place(Index(points.size()), 3);
  driven_.push_back({std::move(points), std::move(motion), std::move(place)});
}

template <class S>
void PointBody<S>::add_force(Index point, const Vec3& force) {
  check(point);
  check_finite(force, "force");
  pushed_.emplace_back(point, force);
}

template <class S>
Energy PointBody<S>::energy(const Vec3& gravity) const {
  // Four sums each, so that one addition need not wait for the one before.
  constexpr Index kSums = 4;
  Eigen::Array<double, kSums, 1> kinetic = Eigen::Array<double, kSums, 1>::Zero(), height = kinetic, mass = kinetic;
  const S *w = points_.inverse_mass.data(), *m = points_.mass.data();
  const S *x = points_.position.data(), *v = points_.velocity.data();
  const Index n = size();
  for (Index first = 0; first < n; first += kSums)
    for (Index j = 0, i = first; j < kSums && i < n; ++j, ++i) {
      const double weight = w[i] > S(0) ? double(m[i]) : 0;
      const double vx = double(v[i]), vy = double(v[n + i]), vz = double(v[2 * n + i]);
      kinetic[j] += weight * (vx * vx + vy * vy + vz * vz);
      height[j] +=
          weight * (gravity[0] * double(x[i]) + gravity[1] * double(x[n + i]) + gravity[2] * double(x[2 * n + i]));
      mass[j] += weight;
    }
  Energy energy;
  energy.kinetic = 0.5 * kinetic.sum();
  energy.gravitational = -height.sum() - gravity.dot(points_.origin) * mass.sum();
  for (const auto* fields : {&fields_, &held_fields_})
    for (const auto& field : *fields) energy.elastic += field->potential_energy(points_.position);
  return energy;
}

template <class S>
Vec3 PointBody<S>::momentum() const {
  Vec3 sum = Vec3::Zero();
  for (Index i = 0; i < size(); ++i)
    if (points_.inverse_mass[i] != 0)
      sum += double(points_.mass[i]) * points_.velocity.row(i).matrix().transpose().template cast<double>();
  return sum;
}

template <class S>
void PointBody<S>::begin_frame(double seconds, double waiting, double t0, double t1) {
  if (!pushed_.empty() || !bank_.empty()) {
    // The bank is a time line: what waits unsimulated comes before what is pushed now.
    if (bank_.empty() && waiting > 0) bank_.push_back({waiting, {}});
    bank_.push_back({seconds, std::move(pushed_)});
    pushed_.clear();
  }
  frame_start_ = t0;
  frame_end_ = t1;
}

// Turns the coming tick's share of the bank into constant accelerations.
template <class S>
void PointBody<S>::spend_bank(double seconds) {
  pushing_ = false;
  if (bank_.empty()) return;
  push_acceleration_.setZero(size(), 3);
  double left = seconds;
  while (!bank_.empty() && left > 0) {
    Banked& piece = bank_.front();
    // A piece that ends with the tick but for rounding does.
    const bool all = piece.seconds <= left + 1e-9 * seconds;
    const double spent = all ? std::min(piece.seconds, left) : left;
    for (const auto& [point, force] : piece.pushes) {
      const Vec3 a = force * (spent / seconds) * double(points_.inverse_mass[point]);
      push_acceleration_.row(point) += a.transpose().array().template cast<S>();
      pushing_ = true;
    }
    left -= spent;
    if (all)
      bank_.pop_front();
    else
      piece.seconds -= spent;
    if (left <= 1e-9 * seconds) break;
  }
}

// Fields that are evaluated once a tick join the pushes of the user.
template <class S>
void PointBody<S>::hold_fields(double t) {
  if (held_fields_.empty()) return;
  force_.setZero(size(), 3);
  for (const auto& field : held_fields_) field->add_force(points_.position, points_.velocity, t, force_);
  if (!pushing_) push_acceleration_.setZero(size(), 3);
  push_acceleration_ += force_.colwise() * points_.inverse_mass;
  pushing_ = true;
}

template <class S>
void PointBody<S>::acceleration(const Points<S>& x, const Points<S>& v, double t, Points<S>& a) {
  if (fields_.empty()) {
    a.setZero(x.rows(), 3);
  } else {
    force_.setZero(x.rows(), 3);
    // Only of the state itself is it known what rounding has dropped. Dampers take from what moves fast what that
    // would give it.
    const bool shows = slow_ || !uses_velocity_;
    const Points<S>& low = integrator_.low().position;
    const bool fine = shows && &x == &points_.position && low.rows() > 0;
    for (const auto& field : fields_) {
      if (fine)
        field->add_fine_force(x, low, v, t, force_);
      else
        field->add_force(x, v, t, force_);
    }
    a.resize(x.rows(), 3);
    for (int k = 0; k < 3; ++k) a.col(k) = force_.col(k) * points_.inverse_mass;
  }
  for (int k = 0; k < 3; ++k) {
    const S g = S(tick_.gravity[k]);
    if (g != 0) a.col(k) += (points_.inverse_mass > S(0)).select(Values<S>::Constant(x.rows(), g), S(0));
  }
  if (pushing_) a += push_acceleration_;
  if (watching_ && culprit_ < 0) {
    for (Index i = 0; i < size() && culprit_ < 0; ++i)
      if (!x.row(i).allFinite() || !v.row(i).allFinite()) culprit_ = i;
    if (culprit_ < 0 && !a.allFinite()) {
      // Held points last: an infinite force makes NaN of them, but it is their neighbour's.
      for (const bool held : {true, false})
        for (Index i = size(); i-- > 0;)
          if ((points_.inverse_mass[i] == 0) == held && !a.row(i).allFinite()) culprit_ = i;
      fields_at_fault_ = double(x.abs().maxCoeff()) < kOrdinary && double(v.abs().maxCoeff()) < kOrdinary;
    }
  }
}

template <class S>
void PointBody<S>::prescribe(double t0, const Points<S>& from, double t, Points<S>& x, Points<S>& v) {
  // A stage that ends with the tick but for rounding does: pins are exactly at their target then.
  if (std::abs(t - tick_.end) < 1e-9 * (tick_.end - tick_.start)) t = tick_.end;
  const auto place = [&](Index point, const Vec3& where) {
    for (int k = 0; k < 3; ++k) {
      x(point, k) = S(where[k] - points_.origin[k]);
      if (t > t0) v(point, k) = (x(point, k) - from(point, k)) / S(t - t0);
    }
  };
  for (Driven& group : driven_) {
    group.motion(t, group.place);
    for (std::size_t i = 0; i < group.points.size(); ++i)
      if (group.points[i] >= 0) place(group.points[i], group.place.row(Index(i)).matrix().transpose());
  }
  for (const Moving& pin : moving_) {
    const double done = frame_end_ > frame_start_ ? (t - frame_start_) / (frame_end_ - frame_start_) : 1;
    place(pin.point, done >= 1 ? pin.to : Vec3(pin.from + done * (pin.to - pin.from)));
  }
}

template <class S>
void PointBody<S>::collide(double t0, const Points<S>& from, double t1, Points<S>& x, Points<S>& v) {
  contacts_.resolve(t0, from, t1, points_.inverse_mass, x, v);
}

template <class S>
void PointBody<S>::add_implicit_times(const Points<S>& x, const Points<S>& v, S h, bool safe, const Points<S>& d,
                                      Points<S>& out) {
  force_.setZero(x.rows(), 3);
  damping_product_.setZero(x.rows(), 3);
  for (const auto& field : fields_) {
    field->add_stiffness_times(x, d, safe, force_);
    if (field->uses_velocity()) field->add_damping_times(x, v, d, damping_product_);
  }
  out += (h * h) * force_ + h * damping_product_;
}

template <class S>
void PointBody<S>::add_couplings(const Points<S>& x, const Points<S>& v, double h, std::vector<Coupling>& out) {
  for (const auto& field : fields_) field->add_couplings(x, v, h, out);
}

template <class S>
typename ForceField<S>::Rates PointBody<S>::rate_bounds() const {
  if (rates_) return *rates_;
  typename ForceField<S>::Rates rates;
  for (const auto& field : fields_) {
    const auto more = field->rate_bounds(points_.position, points_.velocity, points_.inverse_mass);
    rates.omega_squared += more.omega_squared;
    rates.gamma += more.gamma;
  }
  if (before_tick_) rates_ = rates;
  return rates;
}

template <class S>
double PointBody<S>::stable_step(const Method& method) const {
  const auto rates = rate_bounds();
  return largest_stable_step(method, std::sqrt(rates.omega_squared), rates.gamma);
}

template <class S>
MotionFacts PointBody<S>::motion_facts() const {
  const Work& work = integrator_.work();
  return {std::string(settings_.method->name),
          std::string(fused()                    ? stepper_->precision()
                      : std::is_same_v<S, float> ? "float"
                                                 : "double"),
          substeps(),
          stable_step(),
          settings_.dt,
          uses_velocity_,
          work.evaluations,
          work.products};
}

// The substep where none is given.
template <class S>
double PointBody<S>::automatic_step() const {
  const Method& method = *settings_.method;
  const auto rates = rate_bounds();
  const double omega = std::sqrt(rates.omega_squared);
  const double stable = kStepSafety * largest_stable_step(method, omega, rates.gamma);
  if (method.stability_limit != 0 || omega == 0) return stable;
  // No step is stable undamped; a small phase per step keeps the growth slow. Heavy damping has a
  // limit of its own, which the phase must not pass.
  const double damped = kStepSafety * largest_stable_step(method, 0, rates.gamma);
  return std::max(stable, std::min(kUnstablePhase / omega, damped));
}

template <class S>
void PointBody<S>::choose_substeps(const Tick& tick) {
  const double length = tick.end - tick.start;
  if (settings_.dt > 0) {
    wanted_dt_ = settings_.dt;
  } else if (adapts()) {
    wanted_dt_ = length;
  } else if (last_estimate_ < 0 || tick.start - last_estimate_ >= kEstimateInterval * (1 - 1e-9)) {
    last_estimate_ = tick.start;
    wanted_dt_ = step_share_ * automatic_step();
  }
  // The length of a tick is rounded as its times are: after days that is more than a billionth of a step.
  const double count = std::ceil(length / wanted_dt_ * (1 - 1e-9));
  substeps_ = std::clamp<Index>(count < double(settings_.max_substeps) ? Index(count) : settings_.max_substeps, 1,
                                settings_.max_substeps);
}

// Near the largest stable step an oscillation's energy swings by several times itself, and one that begins at full
// speed swings too far. Damping would take that away; without it the step has to be smaller where much of the motion
// is that fast. With Verlet the swing is h²/8 Σ m |a|²; as much again is to come of what moves, h²/8 vᵀK v, and for
// an oscillation the sum is always the same, (ω h)²/4 of its energy. The step only shrinks: each change costs some
// energy itself.
template <class S>
void PointBody<S>::bound_swing(const Tick& tick) {
  const Method& method = *settings_.method;
  if (settings_.dt > 0 || !method.symplectic || method.order != 2 || std::isinf(method.stability_limit)) return;
  if (!alone() || fields_.empty() || loses_energy()) return;
  const double interval = std::clamp(swing_checked_, kSwingInterval, kLongestSwingInterval);
  if (swing_checked_ >= 0 && tick.start - swing_checked_ < interval * (1 - 1e-9)) return;
  swing_checked_ = tick.start;
  const double h = (tick.end - tick.start) / double(substeps_);
  Points<S>& a = damping_product_;  // its memory
  acceleration(points_.position, points_.velocity, tick.start, a);
  const auto free = points_.inverse_mass > S(0);
  const bool falls_freely = free.all() && (tick.colliders.empty() || !settings_.collides);
  for (int k = 0; k < 3 && falls_freely; ++k) a.col(k) -= S(tick.gravity[k]);
  double swing = 0;
  for (int k = 0; k < 3; ++k) swing += double((points_.mass * free.select(a.col(k).square(), S(0))).sum());
  force_.setZero(size(), 3);
  for (const auto& field : fields_) field->add_stiffness_times(points_.position, points_.velocity, true, force_);
  for (int k = 0; k < 3; ++k) swing += double((points_.velocity.col(k) * force_.col(k)).sum());
  swing *= h * h / 8;
  // What starts from rest has fallen for as long as this is not looked at.
  const double fall = tick.gravity.norm() * kSwingInterval;
  const Energy energy = this->energy(tick.gravity);
  exchanged_ = std::max(exchanged_, energy.kinetic + energy.elastic + double(points_.mass.sum()) * fall * fall / 2);
  if (swing <= kSwing * exchanged_) return;
  step_share_ = std::min(step_share_, std::sqrt(kSwing / 2 * exchanged_ / swing) * h / automatic_step());
  last_estimate_ = -1;
  choose_substeps(tick);
}

template <class S>
SolveResult PointBody<S>::substep(double t, double h) {
  if (adapts())
    return integrator_.adapt(*this, points_.position, points_.velocity, t, h, settings_.tolerance,
                             h / double(settings_.max_substeps));
  return integrator_.step(*this, points_.position, points_.velocity, t, h);
}

// All substeps of tick_ by the stepper, or false where it cannot. Kicks and drifts that follow each
// other become one, so a tick of n substeps of velocity Verlet evaluates forces n + 1 times.
template <class S>
bool PointBody<S>::run_fast() {
  const auto* table = std::get_if<Splitting>(&settings_.method->scheme);
  if (!fused() || (slow_ && !fine_stepper_) || watching_ || prescribes() || collides()) return false;
  Stepper<S>& stepper = slow_ ? *fine_stepper_ : *stepper_;
  const double h = (tick_.end - tick_.start) / double(substeps_);
  stages_.clear();
  std::int64_t evaluations = 0;
  for (Index i = 0; i < substeps_; ++i)
    for (std::size_t j = 0; j < table->kick.size(); ++j) {
      const Stage next{table->kick[j] * h, table->drift[j] * h};
      if (!stages_.empty() && (next.kick == 0 || stages_.back().drift == 0)) {
        stages_.back().kick += next.kick;
        stages_.back().drift += next.drift;
      } else {
        stages_.push_back(next);
      }
    }
  for (const Stage& stage : stages_) evaluations += stage.kick != 0;
  stepper.load(points_, integrator_.low(), tick_.gravity, pushing_ ? &push_acceleration_ : nullptr);
  stepper.run(stages_, tick_.gang);
  stepper.store(points_, integrator_.low());
  if (!slow_) integrator_.drop_low();
  integrator_.count(evaluations);
  return true;
}

template <class S>
bool PointBody<S>::rounding_shows(double h, double speed, double size, double gravity) {
  const double rounding = double(std::numeric_limits<S>::epsilon()) * size;
  return h * speed < kSlow * rounding || (gravity > 0 && h * h * gravity < kLight * rounding);
}

template <class S>
bool PointBody<S>::needs_low() const {
  // Without fields there is nothing that would feel it.
  if (!std::is_same_v<S, float> || !settings_.compensated || fields_.empty()) return false;
  const double h = (tick_.end - tick_.start) / double(substeps_);
  const bool stepped = fused() && fine_stepper_;
  if (stepped && settings_.dt > 0 && std::isfinite(checked_limit_) && h < kFine * checked_limit_) return true;
  const double speed = std::sqrt(double(points_.velocity.square().sum()) / double(size()));
  return rounding_shows(h, speed, double(points_.position.abs().maxCoeff()), stepped ? tick_.gravity.norm() : 0);
}

// All substeps of tick_, or those up to the one that fails.
template <class S>
SolveResult PointBody<S>::run_tick() {
  const double length = tick_.end - tick_.start;
  integrator_.restart();
  slow_ = needs_low();
  if (settings_.collides && !tick_.colliders.empty())
    contacts_.begin_tick(tick_.colliders, points_, tick_.start, tick_.end, settings_.thickness);
  SolveResult solve;
  if (run_fast()) return solve;
  for (Index i = 0; i < substeps_ && solve.converged; ++i) {
    const double t = tick_.start + length * double(i) / double(substeps_);
    solve = substep(t, length / double(substeps_));
  }
  return solve;
}

// What went wrong in tick_, and the state from before it. NaN spreads from point to point
// within a tick, so the tick is run again under watch for where it came from.
template <class S>
StepReport PointBody<S>::explain(bool finite_state) {
  Index broken = -1;
  for (Index i = 0; i < size() && broken < 0; ++i)
    if (!points_.position.row(i).allFinite() || !points_.velocity.row(i).allFinite()) broken = i;
  take_back();
  watching_ = true, culprit_ = -1, fields_at_fault_ = false;
  run_tick();
  watching_ = false;
  take_back();
  const bool solver_failed = finite_state && !fields_at_fault_;
  StepReport report = report_of(solver_failed ? StepReport::Status::NotConverged : StepReport::Status::NotFinite);
  if (!solver_failed) report.point = culprit_ >= 0 ? culprit_ : broken;
  if (fields_at_fault_) {
    report.advice = "the force on it was not finite at ordinary positions and velocities; check its force fields";
    return report;
  }
  report.advice = step_advice();
  return report;
}

template <class S>
StepReport PointBody<S>::report_of(StepReport::Status status) const {
  StepReport report;
  report.status = status;
  report.body = name();
  report.time = tick_.start;
  return report;
}

template <class S>
std::string PointBody<S>::step_advice() const {
  const double stable = stable_step();
  const std::string limit = stable == 0             ? "0 (none undamped)"
                            : std::isfinite(stable) ? std::to_string(1e3 * stable) + " ms"
                                                    : "without bound";
  return "the substep was " + std::to_string(1e3 * (tick_.end - tick_.start) / double(std::max<Index>(substeps(), 1))) +
         " ms, the largest that is surely stable with " + std::string(settings_.method->name) + " is " + limit +
         "; lower dt, lower the stiffness or choose another method";
}

// tick_ with the present number of substeps; where it fails, the state is that of before.
template <class S>
StepReport PointBody<S>::try_tick() {
  const Work before = integrator_.work();
  const SolveResult solve = run_tick();
  // What is not finite anywhere is not finite in the velocities, and so in their energy.
  const double kinetic = points_.kinetic_energy();
  const bool good = std::isfinite(kinetic) || (points_.position.allFinite() && points_.velocity.allFinite());
  if (!good || !solve.converged) return explain(good);
  if (integrator_.work().unfinished > before.unfinished && !warned_of_step_) {
    StepReport report = report_of(StepReport::Status::NotConverged);
    report.advice = "its step was kept, which brings it nearer but not all the way; " + step_advice();
    warn(std::move(report), warned_of_step_);
  }
  // What rounding drops is kept where it shows.
  if (!slow_) energy_watch_.kicked(double(integrator_.work().evaluations - before.evaluations));
  if (StepReport report = watch_energy(kinetic); !report.good()) return report;
  rest(kinetic);
  return {};
}

// In float what is far from its origin has lost digits: springs of a net that flew 200 m gained energy from the
// rounding of places. So the origin goes after it, by multiples of a power of two that is no less than four times its
// size and no more than the way of any of its points: differences that float holds exactly, so no point moves.
template <class S>
void PointBody<S>::follow() {
  if (!std::is_same_v<S, float> || !settings_.compensated || !may_follow_) return;
  const double far = double(points_.position.row(0).abs().maxCoeff());
  if (far <= known_reach_) return;
  const Vec3 low = points_.position.colwise().minCoeff().matrix().transpose().template cast<double>();
  const Vec3 high = points_.position.colwise().maxCoeff().matrix().transpose().template cast<double>();
  const double step = std::exp2(std::ceil(std::log2(4 * std::max((high - low).maxCoeff(), kLeastSize))));
  Vec3 way;
  for (int k = 0; k < 3; ++k) way[k] = std::trunc((low[k] + high[k]) / 2 / step) * step;
  known_reach_ = 2 * std::max(far, step);
  if (way.isZero(0) || !(way.cwiseAbs().maxCoeff() < 1e6 * step)) return;
  for (int k = 0; k < 3; ++k) points_.position.col(k) -= S(way[k]);
  points_.origin += way;
  integrator_.drop_low();
  known_reach_ = 2 * step;
}

// What is found out before a tick, all of the same positions: bounds of rates are worked out once.
template <class S>
void PointBody<S>::begin_tick(const Tick& tick) {
  struct OneState {
    PointBody& body;
    explicit OneState(PointBody& b) : body(b) { body.before_tick_ = true; }
    ~OneState() { body.before_tick_ = false, body.rates_.reset(); }
  } one_state(*this);
  choose_substeps(tick);
  spend_bank(tick.end - tick.start);
  hold_fields(tick.start);
  bound_swing(tick);
  check_step();
  begin_energy_watch();
}

template <class S>
StepReport PointBody<S>::advance(const Tick& tick) {
  if (asleep_ && !disturbed(tick)) return {};
  if (asleep_) wake();
  tick_ = tick;
  if (size() > 0) follow();
  previous_position_ = points_.position;
  previous_velocity_ = points_.velocity;
  if (size() == 0) return {};
  if (tick.gravity != last_gravity_) energy_watch_.forget();
  last_gravity_ = tick.gravity;
  begin_tick(tick);
  StepReport report = try_tick();
  for (int retry = 0; retry < settings_.retries && !report.good() && substeps_ < settings_.max_substeps; ++retry) {
    substeps_ = std::min(2 * substeps_, settings_.max_substeps);
    report = try_tick();
  }
  if (!report.good()) return report;
  if (!moving_.empty() && tick.end >= frame_end_) {
    for (const Moving& pin : moving_) points_.velocity.row(pin.point).setZero();
    moving_.clear();
    energy_watch_.forget();
  }
  return {};
}

// What is asleep feels these.
template <class S>
bool PointBody<S>::disturbed(const Tick& tick) {
  if (tick.gravity != last_gravity_ || !bank_.empty()) return true;
  for (Driven& group : driven_) {
    group.motion(tick.end, group.place);
    for (std::size_t i = 0; i < group.points.size(); ++i)
      for (int k = 0; k < 3 && group.points[i] >= 0; ++k)
        if (S(group.place(Index(i), k) - points_.origin[k]) != points_.position(group.points[i], k)) return true;
  }
  if (!settings_.collides || tick.colliders.empty()) return false;
  if (!surroundings_known_) surroundings_.remember(tick.colliders, tick.start, positions(), settings_.thickness);
  surroundings_known_ = true;
  return surroundings_.changed(tick.colliders, tick.end);
}

template <class S>
bool PointBody<S>::loses_energy() const {
  const bool method_does = settings_.method->stability_limit != 0 && !settings_.method->symplectic;
  return uses_velocity_ || !held_fields_.empty() || damped_ || method_does || contacts_.any();
}

template <class S>
double PointBody<S>::free_mass() {
  if (free_mass_ < 0) free_mass_ = double((points_.inverse_mass > S(0)).select(points_.mass, S(0)).sum());
  return free_mass_;
}

// Falls asleep after a good tick at whose end nothing moves or wants to.
template <class S>
void PointBody<S>::rest(double kinetic) {
  if (!settings_.sleeps || !passive_ || !bank_.empty() || !moving_.empty()) return;
  if (2 * kinetic > kQuietSpeed * kQuietSpeed * free_mass()) {
    quiet_since_ = tick_.end;
    return;
  }
  if (tick_.end - quiet_since_ < kQuietTime * (1 - 1e-9)) return;
  quiet_since_ = tick_.end - 0.5 * kQuietTime;  // where it does not sleep yet, do not ask at every tick
  const bool quick = double(points_.velocity.square().sum()) > kQuietSpeed * kQuietSpeed * double(size());
  if (quick || !loses_energy() || !balanced()) return;
  asleep_ = true;
  damped_ = false;
  surroundings_known_ = false;
  points_.velocity.setZero();
  previous_position_ = points_.position;
  previous_velocity_ = points_.velocity;
}

// Σ m |a| at x, of what surfaces leave.
template <class S>
double PointBody<S>::unbalanced(const Points<S>& x, Points<S>& left) {
  const Points<S> still = Points<S>::Zero(size(), 3);
  left.resize(size(), 3);
  still_acceleration(x, still, tick_.end, left);
  integrator_.bear(left);
  settle(left);  // as it takes from velocities what surfaces stop, so it does from accelerations
  return double((points_.mass * left.square().rowwise().sum().sqrt()).sum());
}

template <class S>
double PointBody<S>::residual_force(const Vec3& gravity) {
  tick_.gravity = gravity;
  slow_ = true;
  Points<S> left;
  return unbalanced(points_.position, left);
}

// True where a share of the weight holds all forces, or nothing but the rounding of positions is left of them.
template <class S>
bool PointBody<S>::balanced() {
  Points<S> left, other;
  if (unbalanced(points_.position, left) <= kQuietForce * free_mass() * tick_.gravity.norm()) return true;
  // A rounding is off by 1/√12 of an ulp; neighbours must differ: signs from the bits of a multiplied index.
  Points<S> x = points_.position;
  const double residual = unbalanced(x, left);
  for (Index i = 0; i < x.size(); ++i) {
    const bool up = (std::uint32_t(i) * 2654435761u) >> 31;
    x.data()[i] = std::nextafter(x.data()[i], up ? std::numeric_limits<S>::max() : std::numeric_limits<S>::lowest());
  }
  unbalanced(x, other);
  other -= left;
  const double noise = double((points_.mass * other.square().rowwise().sum().sqrt()).sum()) / std::sqrt(12.0);
  return residual <= 2 * noise;
}

// Nothing gives it energy in the coming tick, as far as is known before it.
template <class S>
bool PointBody<S>::alone() const {
  return settings_.watches_energy && passive_ && !pushing_ && !prescribes();
}

// [J], with heights from the origin it began with. Near the largest stable step the energy of a fast oscillation swings
// by several times itself; what methods of first and second order keep of an oscillator, exactly, is added to:
// -h²/8 |a|² with Verlet, h/2 a·v with semi-implicit Euler, per unit of mass. What is added is never positive with
// Verlet, and not worked out where the energy is no more than `enough` without it.
template <class S>
double PointBody<S>::kept_energy(double enough) {
  const double energy = this->energy(tick_.gravity).total() + free_mass() * tick_.gravity.dot(start_origin_);
  const Method& method = *settings_.method;
  if (method.order == 2 && energy <= enough) return energy;
  if (!method.symplectic || method.order > 2 || std::isinf(method.stability_limit)) return energy;
  const double h = (tick_.end - tick_.start) / double(std::max<Index>(substeps_, 1));
  Points<S>& a = damping_product_;  // its memory
  acceleration(points_.position, points_.velocity, tick_.end, a);
  settle(a);
  if (method.order == 1)
    return energy + 0.5 * h * double((points_.mass * (a * points_.velocity).rowwise().sum()).sum());
  return energy - h * h / 8 * double((points_.mass * a.square().rowwise().sum()).sum());
}

template <class S>
void PointBody<S>::begin_energy_watch() {
  if (!alone()) {
    energy_watch_.forget();
    return;
  }
  if (energy_watch_.knows()) return;
  // Positions err by their rounding: so do heights, and springs by its square.
  const double off = double(std::numeric_limits<S>::epsilon()) * double(points_.position.abs().maxCoeff());
  const double omega = 2 / stable_step(velocity_verlet());  // of all forces, whatever moves it
  const double shaken = omega * omega * off * off, noise = shaken + tick_.gravity.norm() * off;
  // A surface takes gravity's part out of what Verlet keeps.
  const double h = (tick_.end - tick_.start) / double(substeps_), borne = h * tick_.gravity.norm();
  energy_watch_.start(kept_energy(), points_.kinetic_energy(), total_mass() * (64 * noise + borne * borne / 4),
                      kKick * total_mass() * shaken);
}

// After a tick that ended with this kinetic energy [J].
template <class S>
StepReport PointBody<S>::watch_energy(double kinetic) {
  if (contacts_.any()) {
    bool driven = contacts_.pushes_out();
    for (const Collider& collider : tick_.colliders) driven = driven || collider.motion || collider.distance;
    if (driven) energy_watch_.forget();
  }
  if (!energy_watch_.due(kinetic)) return {};
  const double total = kept_energy(energy_watch_.fine_up_to(kinetic));
  const auto finding = energy_watch_.judge(total, kinetic);
  if (finding == EnergyWatch::Finding::Fine) return {};
  StepReport report = report_of(StepReport::Status::EnergyGrew);
  points_.velocity.square().rowwise().sum().maxCoeff(&report.point);
  report.advice = std::to_string(energy_watch_.gain(total)) + " J since it was last given any, " +
                  std::to_string(kinetic) + " J are in its motion, most at this point; " + step_advice();
  // Of methods that no step makes stable without damping nobody expects anything else; those that are stable at any
  // step lose again what they gain.
  // Splittings of high order swing, too, near their limits.
  const Method& method = *settings_.method;
  const bool expected =
      method.stability_limit == 0 || !std::isfinite(method.stability_limit) || (method.symplectic && method.order > 2);
  if (finding == EnergyWatch::Finding::Grows || expected) {
    warn(std::move(report), warned_of_energy_);
    return {};
  }
  take_back();
  energy_watch_.forget();
  return report;
}

// Warns of substeps above the largest that is surely stable.
template <class S>
void PointBody<S>::check_step() {
  if (adapts() || (settings_.dt == 0 && substeps_ < settings_.max_substeps)) return;
  const double h = (tick_.end - tick_.start) / double(substeps_);
  if (step_checked_ < 0 || tick_.start - step_checked_ >= kStepCheckInterval * (1 - 1e-9)) {
    step_checked_ = tick_.start;
    checked_limit_ = stable_step();
  }
  if (!std::isfinite(checked_limit_)) return;
  if (h <= checked_limit_) {
    warned_of_step_ = false;
    return;
  }
  StepReport report = report_of(StepReport::Status::StepTooLong);
  report.advice = step_advice();
  warn(std::move(report), warned_of_step_);
}

template <class S>
void PointBody<S>::warn(StepReport warning, bool& warned) {
  if (!warned) warnings_.push_back(std::move(warning));
  warned = true;
}

template <class S>
void PointBody<S>::take_back() {
  points_.position = previous_position_;
  points_.velocity = previous_velocity_;
  integrator_.drop_low();
}

template <class S>
void PointBody<S>::damp(double factor) {
  if (asleep_) return;
  damped_ = damped_ || factor < 1;
  for (int k = 0; k < 3; ++k)
    points_.velocity.col(k) *= (points_.inverse_mass > S(0)).select(Values<S>::Constant(size(), S(factor)), S(1));
}

// ---- Checkpoints

template <class S>
void PointBody<S>::describe(Blueprint& out) const {
  out.add("precision", std::is_same_v<S, float> ? "float" : "double");
  out.add("points", size());
  CheckpointWriter mass;
  mass.add(points_.mass);
  out.add_sum("masses", mass);
  out.add("method", settings_.method->name);
  out.add("dt", settings_.dt);
  out.add("thickness", settings_.thickness);
  out.add("collides", settings_.collides);
  out.add("max_substeps", settings_.max_substeps);
  out.add("tolerance", settings_.tolerance);
  out.add("compensated", settings_.compensated);
  out.add("sleeps", settings_.sleeps);
  out.add("retries", Index(settings_.retries));
  out.add("number of force fields", Index(fields_.size()));
  out.add("number of held force fields", Index(held_fields_.size()));
  for (const auto* fields : {&fields_, &held_fields_})
    for (const auto& field : *fields) field->describe(out);
  out.add("stepper", stepper_ ? stepper_->precision() : "none");
  out.add("number of pin motions", Index(driven_.size()));
  for (const Driven& group : driven_) out.add("pins of a motion", Index(group.points.size()));
}

template <class S>
void PointBody<S>::save(CheckpointWriter& out) const {
  out.begin("points");
  out.add(points_.origin);
  out.add(start_origin_);
  out.add(known_reach_);
  for (const Points<S>* p : {&points_.position, &points_.velocity, &start_, &previous_position_, &previous_velocity_})
    out.add(*p);
  out.add(points_.inverse_mass);
  out.end();

  out.begin("pushes");
  const auto add = [&](const std::vector<Push>& pushes) {
    out.add(std::uint64_t(pushes.size()));
    for (const auto& [point, force] : pushes) {
      out.add(std::int64_t(point));
      out.add(force);
    }
  };
  add(pushed_);
  out.add(std::uint64_t(bank_.size()));
  for (const Banked& piece : bank_) {
    out.add(piece.seconds);
    add(piece.pushes);
  }
  out.end();

  out.begin("pins");
  for (const Driven& group : driven_)
    for (const Index point : group.points) out.add(std::int64_t(point));
  out.add(std::uint64_t(moving_.size()));
  for (const Moving& pin : moving_) {
    out.add(std::int64_t(pin.point));
    out.add(pin.from);
    out.add(pin.to);
  }
  out.add(frame_start_);
  out.add(frame_end_);
  out.end();

  out.begin("steps");
  out.add(std::int64_t(substeps_));
  out.add(wanted_dt_);
  out.add(last_estimate_);
  out.add(step_share_);
  out.add(swing_checked_);
  out.add(exchanged_);
  out.add(step_checked_);
  out.add(checked_limit_);
  integrator_.save(out);
  out.end();

  out.begin("rest");
  out.add(asleep_);
  out.add(damped_);
  out.add(quiet_since_);
  out.add(last_gravity_);
  out.end();
}

template <class S>
void PointBody<S>::load(CheckpointReader& in) {
  const Index n = size();
  in.begin("points");
  in.array("origin", points_.origin, 3);
  in.array("origin at the start", start_origin_, 3);
  known_reach_ = in.number<double>("reach", 0);
  in.array("position", points_.position, n);
  in.array("velocity", points_.velocity, n);
  in.array("start", start_, n);
  in.array("previous position", previous_position_, n);
  in.array("previous velocity", previous_velocity_, n);
  in.array("inverse mass", points_.inverse_mass, n);
  in.require((points_.inverse_mass >= S(0)).all(), "inverse mass", "must not be negative");
  in.end();

  in.begin("pushes");
  const auto get = [&](std::vector<Push>& pushes) {
    const Index count = in.count("number of pushes", std::numeric_limits<Index>::max(), 40);
    pushes.clear();
    for (Index i = 0; i < count; ++i) {
      Push& push = pushes.emplace_back();
      push.first = Index(in.number<std::int64_t>("pushed point", 0, n - 1));
      in.array("force", push.second, 3);
    }
  };
  get(pushed_);
  bank_.resize(std::size_t(in.count("number of banked frames", std::numeric_limits<Index>::max(), 16)));
  for (Banked& piece : bank_) {
    piece.seconds = in.number<double>("banked seconds", 0);
    get(piece.pushes);
  }
  in.end();

  in.begin("pins");
  for (Driven& group : driven_)
    for (Index& point : group.points) point = Index(in.number<std::int64_t>("driven point", -1, n - 1));
  moving_.resize(std::size_t(in.count("number of moving pins", n, 72)));
  for (Moving& pin : moving_) {
    pin.point = Index(in.number<std::int64_t>("moving pin", 0, n - 1));
    in.array("from", pin.from, 3);
    in.array("to", pin.to, 3);
  }
  frame_start_ = in.number<double>("frame's start");
  frame_end_ = in.number<double>("frame's end");
  in.end();

  in.begin("steps");
  substeps_ = Index(in.number<std::int64_t>("substeps", 0, settings_.max_substeps));
  wanted_dt_ = in.number<double>("wanted step", 0, std::numeric_limits<double>::infinity());
  last_estimate_ = in.number<double>("last estimate", -1);
  step_share_ = in.number<double>("share of the step", 0, 1);
  swing_checked_ = in.number<double>("last look at the swing", -1);
  exchanged_ = in.number<double>("energy exchanged", 0);
  step_checked_ = in.number<double>("last look at the step", -1);
  checked_limit_ = in.number<double>("largest stable step", 0, std::numeric_limits<double>::infinity());
  integrator_.load(in, n);
  in.end();

  in.begin("rest");
  asleep_ = in.number<bool>("asleep");
  damped_ = in.number<bool>("damped");
  quiet_since_ = in.number<double>("quiet since");
  in.array("last gravity", last_gravity_, 3);
  in.end();
  surroundings_known_ = false;
  energy_watch_.forget();
  free_mass_ = -1;
}

template class PointBody<float>;
template class PointBody<double>;

}  // namespace hooke
