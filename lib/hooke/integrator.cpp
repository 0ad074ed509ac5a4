#include <hooke/integrator.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

namespace hooke {

namespace {

// Step control: exponents of this and the last error (PI, β = 0.04), what is kept of the step that they
// suggest, and the most that a step may shrink and grow.
constexpr double kPiBeta = 0.04, kStepShare = 0.9, kMostShrink = 0.2, kMostGrowth = 5;

}  // namespace

template <class S>
SolveResult Integrator<S>::step(Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double h) {
  if (!method_->accepts_velocity_forces && dynamics.uses_velocity())
    throw std::invalid_argument(std::string(method_->name) + " needs forces of position alone, got drag or dampers");
  return std::visit([&](const auto& scheme) { return run(scheme, dynamics, x, v, t, h); }, method_->scheme);
}

template <class S>
void Integrator<S>::save(CheckpointWriter& out) const {
  out.add(adapted_step_);
  out.add(adapted_error_);
  out.add(std::int64_t(adapted_steps_));
  out.add(work_.evaluations);
  out.add(work_.products);
  for (const Points<S>* low : {&low_.position, &low_.velocity}) {
    out.add(low->rows() > 0);
    if (low->rows() > 0) out.add(*low);
  }
}

template <class S>
void Integrator<S>::load(CheckpointReader& in, Index points) {
  restart();
  adapted_step_ = in.number<double>("adapted step", 0);
  adapted_error_ = in.number<double>("adapted error", 0);
  adapted_steps_ = Index(in.number<std::int64_t>("adapted steps", 0));
  work_.evaluations = in.number<std::int64_t>("evaluations", 0);
  work_.products = in.number<std::int64_t>("products", 0);
  for (Points<S>* low : {&low_.position, &low_.velocity}) {
    low->resize(0, 3);
    if (in.number<bool>("has low parts")) in.array("low parts", *low, points);
  }
}

template <class S>
void Integrator<S>::evaluate(Dynamics<S>& dynamics, const Points<S>& x, const Points<S>& v, double t, Points<S>& a) {
  ++work_.evaluations;
  dynamics.acceleration(x, v, t, a);
}

// sum += factor addend. What the sum's rounding drops waits in `low`.
template <class S>
void Integrator<S>::add(Points<S>& sum, Points<S>& low, double factor, const Points<S>& addend) {
  const S scale = S(factor);
  if (!compensated_) {
    sum += scale * addend;
    return;
  }
  if (low.rows() != sum.rows()) low.setZero(sum.rows(), 3);
  S* const high = sum.data();
  S* const kept = low.data();
  const S* const part = addend.data();
  for (Index i = 0; i < sum.size(); ++i) {
    const S more = scale * part[i] + kept[i];
    const S next = high[i] + more;
    const S taken = next - high[i];
    kept[i] = (high[i] - (next - taken)) + (more - taken);
    high[i] = next;
  }
}

template <class S>
void Integrator<S>::drop_low(Index point) {
  if (point < low_.position.rows()) low_.position.row(point).setZero();
  if (point < low_.velocity.rows()) low_.velocity.row(point).setZero();
}

// Dynamics' own, and what sums kept for coordinates that it has set is dropped.
template <class S>
void Integrator<S>::collide(Dynamics<S>& dynamics, double t0, double t1, Points<S>& x, Points<S>& v) {
  const bool keeps = compensated_ && low_.position.size() == x.size();
  if (keeps) touched_x_ = x, touched_v_ = v;
  dynamics.collide(t0, from_, t1, x, v);
  if (!keeps) return;
  low_.position = (x == touched_x_).select(low_.position, S(0));
  if (low_.velocity.size() == v.size()) low_.velocity = (v == touched_v_).select(low_.velocity, S(0));
}

template <class S>
void Integrator<S>::settle(Dynamics<S>& dynamics, Points<S>& v) {
  const bool keeps = compensated_ && low_.velocity.size() == v.size();
  if (keeps) touched_v_ = v;
  dynamics.settle(v);
  if (keeps) low_.velocity = (v == touched_v_).select(low_.velocity, S(0));
}

template <class S>
void Integrator<S>::prescribe(Dynamics<S>& dynamics, double t0, const Points<S>& from, double t1, Points<S>& x,
                              Points<S>& v) {
  dynamics.prescribe(t0, from, t1, x, v);
  if (!compensated_) return;
  const Values<S>& free = dynamics.inverse_mass();
  for (Points<S>* low : {&low_.position, &low_.velocity})
    for (int k = 0; k < 3 && low->rows() == free.size(); ++k) low->col(k) = (free == S(0)).select(S(0), low->col(k));
}

// Pins and surfaces after a move from from_ at t0 to x at t1.
template <class S>
void Integrator<S>::finish(Dynamics<S>& dynamics, double t0, double t1, Points<S>& x, Points<S>& v) {
  if (dynamics.prescribes()) prescribe(dynamics, t0, from_, t1, x, v);
  if (dynamics.collides()) collide(dynamics, t0, t1, x, v);
}

template <class S>
SolveResult Integrator<S>::run(const Splitting& table, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  const bool uses_velocity = dynamics.uses_velocity();
  const bool held = dynamics.prescribes(), collides = dynamics.collides();
  // Drifts that go back in time must not meet surfaces: those wait for the end of the step.
  if (collides) from_ = x;
  const std::size_t last_drift = table.drift.size() - (table.drift.back() == 0 ? 2 : 1);
  double now = t;
  for (std::size_t i = 0; i < table.kick.size(); ++i) {
    if (table.kick[i] != 0) {
      const double kick = table.kick[i] * h;
      if (!acceleration_known_) {
        if (uses_velocity && i > 0) {
          // The velocity at the end of this kick, predicted with the last acceleration: taking
          // the one at its start instead would cost an order.
          predicted_ = v + S(kick) * acceleration_;
          // What a surface holds does not move as its acceleration says: dampers would push for ever.
          if (collides) dynamics.settle(predicted_);
          evaluate(dynamics, x, predicted_, now, acceleration_);
        } else {
          evaluate(dynamics, x, v, now, acceleration_);
        }
        acceleration_known_ = true;
      }
      add(v, low_.velocity, kick, acceleration_);
    }
    if (table.drift[i] != 0) {
      const double next = i == last_drift ? t + h : now + table.drift[i] * h;
      if (held) drift_from_ = x;
      add(x, low_.position, table.drift[i] * h, v);
      if (held) prescribe(dynamics, now, drift_from_, next, x, v);
      now = next;
      acceleration_known_ = false;
      if (collides && i == last_drift) collide(dynamics, t, t + h, x, v);
    }
  }
  if (collides && table.drift.back() == 0) settle(dynamics, v);
  return {};
}

template <class S>
SolveResult Integrator<S>::run(const Verlet&, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double h) {
  const S step = S(h);
  if (!acceleration_known_) evaluate(dynamics, x, v, t, acceleration_);
  if (increment_step_ != h) {
    increment_ = step * v - (S(0.5) * step * step) * acceleration_;
    increment_step_ = h;
    low_.velocity.setZero();
  }
  // Here the low part of velocity is that of the increment.
  add(increment_, low_.velocity, h * h, acceleration_);
  if (dynamics.prescribes() || dynamics.collides()) {
    from_ = x;
    add(x, low_.position, 1, increment_);
    v = increment_ / step;
    finish(dynamics, t, t + h, x, v);
    increment_ = step * v;
  } else {
    add(x, low_.position, 1, increment_);
  }
  if (dynamics.uses_velocity()) {
    predicted_ = increment_ / step + (S(0.5) * step) * acceleration_;
    if (dynamics.collides()) dynamics.settle(predicted_);
    evaluate(dynamics, x, predicted_, t + h, acceleration_);
  } else {
    evaluate(dynamics, x, v, t + h, acceleration_);
  }
  acceleration_known_ = true;
  // The velocity of the same time as x; the increment itself is half a step behind.
  v = increment_ / step + (S(0.5) * step) * acceleration_;
  if (dynamics.collides()) dynamics.settle(v);
  return {};
}

// The stages of one step of h; the last stage is left in stage_x_ and stage_v_.
template <class S>
void Integrator<S>::run_stages(const RungeKutta& table, Dynamics<S>& dynamics, const Points<S>& x, const Points<S>& v,
                               double t, double h) {
  const std::size_t stages = table.weight.size();
  stage_velocity_.resize(stages);
  stage_acceleration_.resize(stages);
  const bool held = dynamics.prescribes();
  from_ = x;
  for (std::size_t i = 0; i < stages; ++i) {
    if (i == 0 && acceleration_known_) {
      stage_velocity_[0] = v;
      stage_acceleration_[0] = acceleration_;
      continue;
    }
    double time = 0;
    stage_x_ = x;
    stage_v_ = v;
    for (std::size_t j = 0; j < table.stage[i].size(); ++j) {
      const double weight = table.stage[i][j];
      time += weight;
      if (weight == 0) continue;
      stage_x_ += S(weight * h) * stage_velocity_[j];
      stage_v_ += S(weight * h) * stage_acceleration_[j];
    }
    if (held) dynamics.prescribe(t, from_, t + time * h, stage_x_, stage_v_);
    stage_velocity_[i] = stage_v_;
    evaluate(dynamics, stage_x_, stage_v_, t + time * h, stage_acceleration_[i]);
  }
}

template <class S>
SolveResult Integrator<S>::run(const RungeKutta& table, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  run_stages(table, dynamics, x, v, t, h);
  if (table.first_same_as_last) {
    x = stage_x_;
    v = stage_v_;
    acceleration_ = stage_acceleration_.back();
    acceleration_known_ = !dynamics.collides();
  } else {
    for (std::size_t i = 0; i < table.weight.size(); ++i) {
      if (table.weight[i] == 0) continue;
      add(x, low_.position, table.weight[i] * h, stage_velocity_[i]);
      add(v, low_.velocity, table.weight[i] * h, stage_acceleration_[i]);
    }
  }
  finish(dynamics, t, t + h, x, v);
  return {};
}

// max(|e_x|, h |e_v|) of the stages over free points and coordinates [m]; NaN where one is NaN.
template <class S>
double Integrator<S>::error_of_stages(const RungeKutta& table, const Values<S>& inverse_mass, double h) {
  double worst = 0;
  for (const auto* stages : {&stage_velocity_, &stage_acceleration_}) {
    predicted_.setZero(inverse_mass.size(), 3);
    for (std::size_t i = 0; i < table.error.size(); ++i)
      if (table.error[i] != 0) predicted_ += S(table.error[i] * h) * (*stages)[i];
    for (int k = 0; k < 3; ++k) predicted_.col(k) = (inverse_mass == S(0)).select(S(0), predicted_.col(k));
    if (!predicted_.allFinite()) return std::numeric_limits<double>::quiet_NaN();
    if (predicted_.size() == 0) return 0;
    worst = std::max(worst, double(predicted_.abs().maxCoeff()) * (stages == &stage_velocity_ ? 1 : h));
  }
  return worst;
}

template <class S>
SolveResult Integrator<S>::adapt(Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double span,
                                 double tolerance, double shortest) {
  const auto* table = std::get_if<RungeKutta>(&method_->scheme);
  if (!table || table->error.empty())
    throw std::invalid_argument(std::string(method_->name) + " has no error estimate to adapt its steps to");
  const double power = 1.0 / method_->order;
  adapted_steps_ = 0;
  double done = 0, h = adapted_step_ > 0 ? adapted_step_ : span;
  while (done < span) {
    // What is left in equal steps, so that none is tiny.
    const double left = span - done;
    const double count = std::ceil(left / std::max(h, shortest) - 1e-9);
    const bool last = !(count > 1);
    h = last ? left : left / count;
    run_stages(*table, dynamics, x, v, t + done, h);
    const double rounding = 8 * double(std::numeric_limits<S>::epsilon()) * (x.size() ? double(x.abs().maxCoeff()) : 0);
    const double error = error_of_stages(*table, dynamics.inverse_mass(), h) / std::max(tolerance, rounding);
    const double shrink = std::pow(error, power - 0.75 * kPiBeta);
    if (!(error <= 1) && h > 1.001 * shortest) {
      acceleration_ = stage_acceleration_[0];
      acceleration_known_ = true;
      h *= std::isfinite(shrink) ? std::clamp(kStepShare / shrink, kMostShrink, 1.0) : kMostShrink;
      continue;
    }
    x = stage_x_;
    v = stage_v_;
    acceleration_ = stage_acceleration_.back();
    acceleration_known_ = !dynamics.collides();
    finish(dynamics, t + done, last ? t + span : t + done + h, x, v);
    ++adapted_steps_;
    done = last ? span : done + h;
    if (!std::isfinite(error)) return {};  // the caller sees it in x and v
    const double growth = error > 0 ? kStepShare * std::pow(adapted_error_, kPiBeta) / shrink : kMostGrowth;
    h *= std::clamp(growth, kMostShrink, kMostGrowth);
    adapted_error_ = std::max(error, 1e-4);
    adapted_step_ = h;
  }
  return {};
}

template <class S>
SolveResult Integrator<S>::run(const Nystrom& table, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  const std::size_t stages = table.node.size();
  stage_acceleration_.resize(stages);
  const bool held = dynamics.prescribes();
  from_ = x;
  for (std::size_t i = 0; i < stages; ++i) {
    stage_x_ = x + S(table.node[i] * h) * v;
    for (std::size_t j = 0; j < table.stage[i].size(); ++j)
      if (table.stage[i][j] != 0) stage_x_ += S(table.stage[i][j] * h * h) * stage_acceleration_[j];
    stage_v_ = v;
    if (held) dynamics.prescribe(t, from_, t + table.node[i] * h, stage_x_, stage_v_);
    evaluate(dynamics, stage_x_, stage_v_, t + table.node[i] * h, stage_acceleration_[i]);
  }
  add(x, low_.position, h, v);
  for (std::size_t i = 0; i < stages; ++i) {
    if (table.position[i] != 0) add(x, low_.position, table.position[i] * h * h, stage_acceleration_[i]);
    add(v, low_.velocity, table.velocity[i] * h, stage_acceleration_[i]);
  }
  finish(dynamics, t, t + h, x, v);
  return {};
}

template <class S>
void Dynamics<S>::add_couplings(const Points<S>&, const Points<S>&, double, std::vector<Coupling>&) {}

template <class S>
SolveResult Integrator<S>::run(const Implicit& scheme, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  from_ = x;
  const SolveResult result = solver_.solve(scheme, dynamics, x, v, t, h, work_);
  if (scheme.theta == 1 && !scheme.linearised) {
    x = solver_.position();
    v = solver_.velocity();
  } else {
    x = from_ + S(h) * solver_.velocity();
    v += (solver_.velocity() - v) / S(scheme.theta);
    solver_.settle(v);
    if (dynamics.prescribes()) dynamics.prescribe(t, from_, t + h, x, v);
  }
  if (dynamics.collides()) dynamics.collide(t, from_, t + h, x, v);
  return result;
}

template <class S>
void Dynamics<S>::planes(double, const Points<S>&, double, S, std::vector<ContactPlane<S>>&) {}

template class Dynamics<float>;
template class Dynamics<double>;
template class Integrator<float>;
template class Integrator<double>;

}  // namespace hooke
