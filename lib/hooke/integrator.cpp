#include <hooke/integrator.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

namespace hooke {

namespace {

// Speeds below this count as none [m/s]: their squares leave the range of double.
template <class S>
constexpr double kStandstill = std::is_same_v<S, float> ? 1e-20 : 1e-100;

// How often compressed springs are met with the positive part of their stiffness.
constexpr int kSafeIterations = 10;

}  // namespace

template <class S>
SolveResult Integrator<S>::step(Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double h) {
  if (!method_->accepts_velocity_forces && dynamics.uses_velocity())
    throw std::invalid_argument(std::string(method_->name) + " needs forces of position alone, got drag or dampers");
  return std::visit([&](const auto& scheme) { return run(scheme, dynamics, x, v, t, h); }, method_->scheme);
}

// Pins and surfaces after a move from from_ at t0 to x at t1.
template <class S>
void Integrator<S>::finish(Dynamics<S>& dynamics, double t0, double t1, Points<S>& x, Points<S>& v) {
  if (dynamics.prescribes()) dynamics.prescribe(t0, from_, t1, x, v);
  if (dynamics.collides()) dynamics.collide(t0, from_, t1, x, v);
}

template <class S>
SolveResult Integrator<S>::run(const Splitting& table, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  const bool uses_velocity = dynamics.uses_velocity();
  double now = t;
  for (std::size_t i = 0; i < table.kick.size(); ++i) {
    if (table.kick[i] != 0) {
      const S kick = S(table.kick[i] * h);
      if (!acceleration_known_) {
        if (uses_velocity && i > 0) {
          // The velocity at the end of this kick, predicted with the last acceleration: taking
          // the one at its start instead would cost an order.
          predicted_ = v + kick * acceleration_;
          dynamics.acceleration(x, predicted_, now, acceleration_);
        } else {
          dynamics.acceleration(x, v, now, acceleration_);
        }
        acceleration_known_ = true;
      }
      v += kick * acceleration_;
    }
    if (table.drift[i] != 0) {
      const double next = i + 1 == table.drift.size() ? t + h : now + table.drift[i] * h;
      if (dynamics.prescribes() || dynamics.collides()) from_ = x;
      x += S(table.drift[i] * h) * v;
      finish(dynamics, now, next, x, v);
      now = next;
      acceleration_known_ = false;
    }
  }
  if (table.drift.back() == 0 && dynamics.collides()) dynamics.settle(v);
  return {};
}

template <class S>
SolveResult Integrator<S>::run(const Verlet&, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t, double h) {
  const S step = S(h);
  if (!acceleration_known_) dynamics.acceleration(x, v, t, acceleration_);
  if (increment_step_ != h) {
    increment_ = step * v - (S(0.5) * step * step) * acceleration_;
    increment_step_ = h;
  }
  increment_ += (step * step) * acceleration_;
  if (dynamics.prescribes() || dynamics.collides()) {
    from_ = x;
    x += increment_;
    v = increment_ / step;
    finish(dynamics, t, t + h, x, v);
    increment_ = step * v;
  } else {
    x += increment_;
  }
  if (dynamics.uses_velocity()) {
    predicted_ = increment_ / step + (S(0.5) * step) * acceleration_;
    dynamics.acceleration(x, predicted_, t + h, acceleration_);
  } else {
    dynamics.acceleration(x, v, t + h, acceleration_);
  }
  acceleration_known_ = true;
  // The velocity of the same time as x; the increment itself is half a step behind.
  v = increment_ / step + (S(0.5) * step) * acceleration_;
  if (dynamics.collides()) dynamics.settle(v);
  return {};
}

template <class S>
SolveResult Integrator<S>::run(const RungeKutta& table, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  const std::size_t stages = table.weight.size();
  stage_velocity_.resize(stages);
  stage_acceleration_.resize(stages);
  const bool held = dynamics.prescribes();
  from_ = x;
  for (std::size_t i = 0; i < stages; ++i) {
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
    dynamics.acceleration(stage_x_, stage_v_, t + time * h, stage_acceleration_[i]);
  }
  for (std::size_t i = 0; i < stages; ++i) {
    if (table.weight[i] == 0) continue;
    x += S(table.weight[i] * h) * stage_velocity_[i];
    v += S(table.weight[i] * h) * stage_acceleration_[i];
  }
  finish(dynamics, t, t + h, x, v);
  return {};
}

// (M + h²K + hD) solution = right on the free points, by conjugate gradients with M as
// preconditioner: errors count as velocities, so light points next to heavy ones are solved
// as well as those. Returns false where the matrix shows a direction of negative curvature (only possible without
// `safe`).
template <class S>
bool Integrator<S>::solve_linear(Dynamics<S>& dynamics, S h, bool safe, double tolerance, const Points<S>& x,
                                 const Points<S>& v, const Points<S>& right, Points<S>& solution) {
  const Values<S>& mass = dynamics.mass();
  const Values<S>& inverse_mass = dynamics.inverse_mass();
  const auto hold = [&](Points<S>& p) {
    for (int k = 0; k < 3; ++k) p.col(k) = (inverse_mass == S(0)).select(S(0), p.col(k));
  };
  const auto precondition = [&] {
    preconditioned_.resize(x.rows(), 3);
    for (int k = 0; k < 3; ++k) preconditioned_.col(k) = inverse_mass * residual_.col(k);
  };
  const auto dot = [](const Points<S>& p, const Points<S>& q) {
    return (p.template cast<double>() * q.template cast<double>()).sum();
  };
  solution.setZero(x.rows(), 3);
  residual_ = right;
  hold(residual_);
  precondition();
  direction_ = preconditioned_;
  double slope = dot(residual_, preconditioned_), size = dot(preconditioned_, preconditioned_);
  const double target = size * tolerance * tolerance;
  const Index limit = 10 * 3 * x.rows() + 100;
  for (Index i = 0; i < limit && size > target && slope > 0; ++i) {
    product_.resize(x.rows(), 3);
    for (int k = 0; k < 3; ++k) product_.col(k) = mass * direction_.col(k);
    dynamics.add_implicit_times(x, v, h, safe, direction_, product_);
    hold(product_);
    const double curvature = dot(direction_, product_);
    if (!(curvature > 0)) return false;
    const double alpha = slope / curvature;
    solution += S(alpha) * direction_;
    residual_ -= S(alpha) * product_;
    precondition();
    const double next = dot(residual_, preconditioned_);
    direction_ = preconditioned_ + S(next / slope) * direction_;
    slope = next;
    size = dot(preconditioned_, preconditioned_);
  }
  return true;
}

// How much h a at (stage_x_, stage_v_) moves when every coordinate is off by its rounding.
template <class S>
double Integrator<S>::rounding_of_force(Dynamics<S>& dynamics, S h) {
  if (stage_x_.size() == 0) return 0;
  // Neighbours must err in different directions: signs from the bits of a multiplied index.
  direction_ = (std::numeric_limits<S>::epsilon() / h) * stage_x_.abs();
  for (Index i = 0; i < direction_.size(); ++i)
    if ((std::uint32_t(i) * 2654435761u) >> 31) direction_.data()[i] *= S(-1);
  product_.setZero(stage_x_.rows(), 3);
  dynamics.add_implicit_times(stage_x_, stage_v_, h, true, direction_, product_);
  for (int k = 0; k < 3; ++k) product_.col(k) *= dynamics.inverse_mass();
  const double found = double(product_.abs().maxCoeff());
  return std::isfinite(found) ? found : 0;
}

template <class S>
SolveResult Integrator<S>::run(const Implicit& scheme, Dynamics<S>& dynamics, Points<S>& x, Points<S>& v, double t,
                               double h) {
  const double tolerance = scheme.tolerance > 0 ? scheme.tolerance : (std::is_same_v<S, float> ? 1e-6 : 1e-12);
  const Values<S>& mass = dynamics.mass();
  const Values<S>& inverse_mass = dynamics.inverse_mass();
  const S step = S(h);
  from_ = x;
  // Where the step would end with velocity u, and by how much u misses v + h a there.
  const auto miss = [&](Points<S>& u, Points<S>& end, Points<S>& out) {
    end = from_ + step * u;
    if (dynamics.prescribes()) dynamics.prescribe(t, from_, t + h, end, u);
    dynamics.acceleration(end, u, t + h, acceleration_);
    out = v + step * acceleration_ - u;
    for (int k = 0; k < 3; ++k) out.col(k) = (inverse_mass == S(0)).select(S(0), out.col(k));
    if (out.size() == 0) return 0.0;
    // A maximum may pass over a NaN.
    return out.allFinite() ? double(out.abs().maxCoeff()) : std::numeric_limits<double>::quiet_NaN();
  };
  stage_v_ = v;
  double residual = miss(stage_v_, stage_x_, right_);
  double rounding = -1;
  SolveResult result;
  for (int iteration = 0;; ++iteration) {
    const double scale = std::max({double(stage_v_.abs().maxCoeff()), double(v.abs().maxCoeff()),
                                   h * double(acceleration_.abs().maxCoeff()), kStandstill<S>});
    result.residual = residual / scale;
    result.converged = result.residual <= tolerance;
    if (result.converged || iteration == scheme.max_iterations || !std::isfinite(residual)) break;
    for (int k = 0; k < 3; ++k) right_.col(k) *= mass;
    // The exact stiffness converges quadratically but may be indefinite in compressed springs.
    const double inner = std::clamp(0.01 * result.residual, 0.1 * tolerance, 1e-3);
    // Where it is, the positive part alone leads downhill far away, and what the gradients found
    // before they met the negative direction leads home.
    const bool positive = solve_linear(dynamics, step, false, inner, stage_x_, stage_v_, right_, update_);
    if (!positive && (iteration < kSafeIterations || (update_ == S(0)).all()))
      solve_linear(dynamics, step, true, inner, stage_x_, stage_v_, right_, update_);
    // The step minimises an energy whose slope along the update is minus this product. A step is
    // good where the energy still falls or has just turned, however the residual jumps meanwhile.
    const auto slope = [&](const Points<S>& force) {
      return (force.template cast<double>() * update_.template cast<double>()).sum();
    };
    const double first_slope = slope(right_);
    double best = std::numeric_limits<double>::infinity();
    S length = 1;
    for (int halving = 0; halving < 12; ++halving, length *= S(0.5)) {
      trial_v_ = stage_v_ + length * update_;
      best = miss(trial_v_, trial_x_, right_);
      if (best < residual) break;
      for (int k = 0; k < 3; ++k) product_.col(k) = mass * right_.col(k);
      if (std::isfinite(best) && slope(product_) > -0.9 * first_slope) break;
    }
    if (iteration > 1 && !(best < 0.5 * residual)) {
      // Large forces that balance leave a rest that is nothing but the rounding of positions.
      if (rounding < 0) rounding = rounding_of_force(dynamics, step);
      if (residual <= std::max(100 * tolerance * scale, rounding)) {
        result.converged = true;
        miss(stage_v_, stage_x_, right_);
        break;
      }
    }
    stage_v_ = trial_v_;
    stage_x_ = trial_x_;
    residual = best;
  }
  x = stage_x_;
  v = stage_v_;
  if (dynamics.collides()) dynamics.collide(t, from_, t + h, x, v);
  return result;
}

template class Integrator<float>;
template class Integrator<double>;

}  // namespace hooke
