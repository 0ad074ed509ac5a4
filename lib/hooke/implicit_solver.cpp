#include <hooke/implicit_solver.hpp>

#include <hooke/integrator.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hooke {

namespace {

// Speeds below this count as none [m/s]: their squares leave the range of double.
template <class S>
constexpr double kStandstill = std::is_same_v<S, float> ? 1e-20 : 1e-100;

// Planes nearer than this may be touched in a step, and points nearer than this lie on theirs [m].
constexpr double kReach = 5e-3, kLies = 1e-4;

// Most halvings of a step, and the share of the promised fall of Φ that is enough.
constexpr int kHalvings = 40;
constexpr double kEnoughFall = 1e-4;

// Products that a linear solve is expected to need, per square root of the stiffest point's rate.
constexpr double kProductsPerRate = 20;

// Multiplications of one product with the stiffness, per coupling.
constexpr double kProductCost = 40;

template <class S>
double tolerance_of(const Implicit& scheme) {
  const double least = std::is_same_v<S, float> ? 1e-6 : 1e-12;
  return std::max(scheme.tolerance, least);
}

template <class S>
double dot(const Points<S>& p, const Points<S>& q) {
  return (p.template cast<double>() * q.template cast<double>()).sum();
}

// A maximum may pass over a NaN.
template <class S>
double largest(const Points<S>& p) {
  if (p.size() == 0) return 0;
  return p.allFinite() ? double(p.abs().maxCoeff()) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

// Where the step would end with velocity u, and by how much u misses v + h a there.
template <class S>
double ImplicitSolver<S>::miss(const Step& step, Points<S>& u, Points<S>& end, Points<S>& out) {
  Dynamics<S>& dynamics = step.dynamics;
  end = step.from + S(step.h) * u;
  if (dynamics.prescribes()) dynamics.prescribe(step.t, step.from, step.t + step.h, end, u);
  ++step.work.evaluations;
  dynamics.acceleration(end, u, step.t + step.h, acceleration_);
  out = step.v + S(step.h) * acceleration_ - u;
  const Values<S>& inverse_mass = dynamics.inverse_mass();
  for (int k = 0; k < 3; ++k) out.col(k) = (inverse_mass == S(0)).select(S(0), out.col(k));
  return largest(out);
}

// What sliding friction takes.
template <class S>
void ImplicitSolver<S>::rub(const Step& step, const Points<S>& u, Points<S>& out) const {
  for (const Contact& contact : contacts_) {
    if (contact.touch != Touch::Slides) continue;
    const Index i = contact.point;
    const Vec slip = contact.slip(row(u, i));
    const S speed = slip.norm();
    const Vec against = speed > contact.still ? Vec(slip / speed) : contact.against;
    set_row<S>(out, i, row(out, i) - contact.friction * contact.pressure * step.dynamics.inverse_mass()[i] * against);
  }
}

// The planes of the coming step: what is near. Where a solid throws back, only what lies on it: the rest must hit
// first.
template <class S>
void ImplicitSolver<S>::find_planes(const Step& step, double whole) {
  planes_.clear(), contacts_.clear(), held_.clear(), rubs_.clear();
  rounds_ = 1;
  if (!step.dynamics.collides()) return;
  step.dynamics.planes(step.t, step.from, step.t + whole, S(kReach), planes_);
  const S h = S(whole);
  for (const ContactPlane<S>& plane : planes_) {
    if (plane.restitution > 0 && plane.gap > S(kLies)) continue;
    Contact contact;
    contact.point = plane.point;
    contact.normal = plane.normal;
    contact.surface_velocity = plane.carried / h;
    contact.friction = plane.friction;
    contact.least = (plane.normal.dot(plane.carried) - plane.gap) / h;
    contacts_.push_back(contact);
  }
  std::sort(contacts_.begin(), contacts_.end(), [](const Contact& a, const Contact& b) { return a.point < b.point; });
  for (std::size_t c = 1; c < contacts_.size(); ++c)
    if (contacts_[c].point == contacts_[c - 1].point) rounds_ = 4;
}

// Which planes hold their points, and how, from what u_ misses.
template <class S>
void ImplicitSolver<S>::find_touches(const Step& step, double tolerance) {
  held_.clear(), rubs_.clear();
  constexpr S kRounding = 16 * std::numeric_limits<S>::epsilon();
  for (Contact& contact : contacts_) {
    const Index i = contact.point;
    const S mass = step.dynamics.mass()[i];
    const Vec u = row(u_, i), missed = row(out_, i);
    const S along = u.dot(contact.normal), press = -missed.dot(contact.normal);
    contact.still = kRounding * std::max({u.template lpNorm<Eigen::Infinity>(), std::abs(contact.least),
                                          contact.surface_velocity.template lpNorm<Eigen::Infinity>()}) +
                    S(kStandstill<S>);
    const bool touches = along <= contact.least + contact.still;
    const bool held = touches && (contact.touch == Touch::Free ? press > 0 : press > -S(tolerance));
    contact.pressure = mass * std::max(press, S(0));
    if (!held || step.dynamics.inverse_mass()[i] == 0) {
      contact.touch = Touch::Free;
      continue;
    }
    Held hold{i, contact.normal, Vec::Zero(), 1};
    const Vec slip = contact.slip(u), pull = missed + press * contact.normal;
    const S speed = slip.norm(), strength = pull.norm();
    if (speed > contact.still && contact.touch != Touch::Sticks) {
      contact.touch = Touch::Slides;
      contact.against = slip / speed;
      rubs_.push_back({i, contact.friction * contact.pressure / speed, contact.normal, contact.against});
    } else if (mass * strength <= contact.friction * contact.pressure) {
      contact.touch = Touch::Sticks;
      hold.directions = 3;
    } else {
      contact.touch = Touch::Slides;
      contact.against = strength > 0 ? Vec(pull / strength) : Vec(0, 0, 0);
      if (contact.friction > 0 && strength > 0) {
        hold.second = contact.normal.cross(contact.against);
        hold.directions = 2;
      }
    }
    if (!held_.empty() && held_.back().point == i)
      hold_more(held_.back(), hold);
    else
      held_.push_back(hold);
  }
}

// A point that another plane holds already.
template <class S>
void ImplicitSolver<S>::hold_more(Held& held, const Held& more) {
  if (more.directions == 3) held.directions = 3;
  for (int d = 0; d < more.directions && held.directions < 3; ++d) {
    Vec n = d == 0 ? more.first : more.second;
    n -= n.dot(held.first) * held.first;
    if (held.directions == 2) n -= n.dot(held.second) * held.second;
    const S length = n.norm();
    if (length < S(1e-3)) continue;
    if (held.directions == 1) held.second = n / length;
    ++held.directions;
  }
}

template <class S>
void ImplicitSolver<S>::filter(Points<S>& p) const {
  for (const Held& held : held_) {
    if (held.directions == 3) {
      set_row<S>(p, held.point, Vec::Zero());
      continue;
    }
    Vec value = row(p, held.point);
    value -= value.dot(held.first) * held.first;
    if (held.directions == 2) value -= value.dot(held.second) * held.second;
    set_row(p, held.point, value);
  }
}

// Puts velocities on the right side of their planes; sliding ends where it would turn round.
template <class S>
void ImplicitSolver<S>::clip(Points<S>& u) const {
  for (int round = 0; round < rounds_; ++round)
    for (const Contact& contact : contacts_) {
      Vec value = row(u, contact.point);
      const S along = value.dot(contact.normal);
      const S normal = contact.touch == Touch::Sticks ? contact.least : std::max(along, contact.least);
      const Vec slip = contact.slip(value);
      const bool stops = contact.touch == Touch::Sticks || (contact.touch == Touch::Slides && contact.friction > 0 &&
                                                            normal <= contact.least && slip.dot(contact.against) <= 0);
      if (stops)
        set_row<S>(u, contact.point, value - slip + (normal - along) * contact.normal);
      else if (normal != along)
        set_row<S>(u, contact.point, value + (normal - along) * contact.normal);
    }
}

template <class S>
void ImplicitSolver<S>::settle(Points<S>& v) const {
  for (const Contact& contact : contacts_) {
    if (contact.touch == Touch::Free) continue;
    Vec relative = row(v, contact.point) - contact.surface_velocity;
    relative -= relative.dot(contact.normal) * contact.normal;
    if (contact.touch == Touch::Sticks) relative.setZero();
    set_row<S>(v, contact.point, contact.surface_velocity + relative);
  }
}

template <class S>
void ImplicitSolver<S>::bear(Points<S>& a) const {
  for (const Contact& contact : contacts_) {
    if (contact.touch == Touch::Free) continue;
    Vec value = row(a, contact.point);
    if (hooke::rub<S>(contact.normal, contact.friction, value) > 0) set_row<S>(a, contact.point, value);
  }
}

// product_ = (M + h²K + hD) direction_, on what is free.
template <class S>
void ImplicitSolver<S>::multiply(const Step& step, bool safe) {
  const Values<S>& mass = step.dynamics.mass();
  const Values<S>& inverse_mass = step.dynamics.inverse_mass();
  product_.resize(direction_.rows(), 3);
  for (int k = 0; k < 3; ++k) product_.col(k) = mass * direction_.col(k);
  ++step.work.products;
  step.dynamics.add_implicit_times(x_, u_, S(step.h), safe, direction_, product_);
  for (const Rub& rub : rubs_)
    set_row<S>(product_, rub.point, row(product_, rub.point) + rub.times(row(direction_, rub.point)));
  for (int k = 0; k < 3; ++k) product_.col(k) = (inverse_mass == S(0)).select(S(0), product_.col(k));
  filter(product_);
}

// The blocks of the positive part at (x_, u_).
template <class S>
void ImplicitSolver<S>::prepare(const Step& step) {
  couplings_.clear();
  step.dynamics.add_couplings(x_, u_, step.h, couplings_);
  const Index n = x_.rows();
  diagonal_.resize(std::size_t(n));
  for (Index i = 0; i < n; ++i) diagonal_[std::size_t(i)] = double(step.dynamics.mass()[i]) * Mat3::Identity();
  for (const Coupling& c : couplings_) {
    diagonal_[std::size_t(c.a)] += c.block;
    if (c.b >= 0) diagonal_[std::size_t(c.b)] += c.block;
  }
  for (const Rub& rub : rubs_) diagonal_[std::size_t(rub.point)] += rub.matrix();
  inverse_.resize(std::size_t(n));
  for (Index i = 0; i < n; ++i) inverse_[std::size_t(i)] = diagonal_[std::size_t(i)].inverse();
}

// The factors of the positive part at (x_, u_), with what is held taken out of the others' rows.
template <class S>
void ImplicitSolver<S>::factor(const Step& step) {
  prepare(step);
  projector_.assign(std::size_t(x_.rows()), Mat3::Identity());
  const Values<S>& inverse_mass = step.dynamics.inverse_mass();
  for (Index i = 0; i < x_.rows(); ++i)
    if (inverse_mass[i] == 0) projector_[std::size_t(i)].setZero();
  for (const Held& held : held_) {
    Mat3& p = projector_[std::size_t(held.point)];
    if (held.directions == 3) p.setZero();
    for (int d = 0; d < std::min(held.directions, 2); ++d) {
      Vec3 n = p * (d == 0 ? held.first : held.second).template cast<double>();
      const double length = n.norm();
      if (length > 1e-6) n /= length, p -= n * n.transpose();
    }
  }
  off_diagonal_.resize(couplings_.size());
  for (std::size_t k = 0; k < couplings_.size(); ++k) {
    const Coupling& c = couplings_[k];
    if (c.b >= 0) off_diagonal_[k] = -projector_[std::size_t(c.a)] * c.block * projector_[std::size_t(c.b)];
  }
  for (std::size_t i = 0; i < projector_.size(); ++i) {
    const Mat3 &p = projector_[i], rest = Mat3::Identity() - p, whole = diagonal_[i];
    diagonal_[i] = p * whole * p + rest * whole * rest;
  }
  factored_ = cholesky_.factor(diagonal_, off_diagonal_);
  ++step.work.factorisations;
}

// preconditioned_ from residual_.
template <class S>
void ImplicitSolver<S>::precondition(const Step& step) {
  const Index n = residual_.rows();
  if (factored_) {
    solved_ = residual_.template cast<double>();
    cholesky_.solve(solved_);
    preconditioned_ = solved_.template cast<S>();
  } else {
    preconditioned_.resize(n, 3);
    for (Index i = 0; i < n; ++i) {
      const Mat3& inverse = inverse_[std::size_t(i)];
      const double x = double(residual_(i, 0)), y = double(residual_(i, 1)), z = double(residual_(i, 2));
      for (int k = 0; k < 3; ++k) preconditioned_(i, k) = S(inverse(k, 0) * x + inverse(k, 1) * y + inverse(k, 2) * z);
    }
  }
  const Values<S>& inverse_mass = step.dynamics.inverse_mass();
  for (int k = 0; k < 3; ++k) preconditioned_.col(k) = (inverse_mass == S(0)).select(S(0), preconditioned_.col(k));
  filter(preconditioned_);
}

// (M + h²K + hD) update_ = M filtered_ on what is free, by conjugate gradients. Errors count as velocities. Ends on
// the border of the trust region in the preconditioner's norm, where it would leave it or where curvature is negative
// (Steihaug 1983). Without a region yet, the first direction of negative curvature makes one.
template <class S>
void ImplicitSolver<S>::solve_linear(const Step& step, bool safe, double tolerance) {
  const Values<S>& mass = step.dynamics.mass();
  const Values<S>& inverse_mass = step.dynamics.inverse_mass();
  const auto size = [&] {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += (inverse_mass * residual_.col(k)).template cast<double>().square().sum();
    return sum;
  };
  if (spent_ > patience_) {
    factor(step);
    spent_ = 0;
  }
  update_.setZero(x_.rows(), 3);
  residual_.resize(x_.rows(), 3);
  for (int k = 0; k < 3; ++k) residual_.col(k) = mass * filtered_.col(k);
  const double target = size() * tolerance * tolerance;
  precondition(step);
  direction_ = preconditioned_;
  double slope = dot(residual_, preconditioned_);
  // Squares and product, in the preconditioner's norm, of update_ and direction_.
  double length2 = 0, along = 0, direction2 = slope;
  const Index limit = 10 * 3 * x_.rows() + 100;
  on_border_ = false;
  for (Index i = 0; i < limit && size() > target && slope > 0; ++i) {
    multiply(step, safe);
    ++spent_;
    const double curvature = dot(direction_, product_);
    double alpha = slope / curvature;
    const double next2 = length2 + 2 * alpha * along + alpha * alpha * direction2;
    if (!(curvature > 0) || next2 > radius_ * radius_) {
      if (!std::isfinite(radius_)) radius_ = std::sqrt(std::max(direction2, 4 * length2));
      const double rest = std::max(0.0, radius_ * radius_ - length2);
      alpha = rest / (along + std::sqrt(along * along + direction2 * rest));
      update_ += S(alpha) * direction_;
      on_border_ = true;
      length_ = radius_;
      return;
    }
    length2 = next2;
    update_ += S(alpha) * direction_;
    residual_ -= S(alpha) * product_;
    precondition(step);
    const double next = dot(residual_, preconditioned_);
    const double beta = next / slope;
    direction_ = preconditioned_ + S(beta) * direction_;
    along = beta * (along + alpha * direction2);
    direction2 = next + beta * beta * direction2;
    slope = next;
  }
  length_ = std::sqrt(length2);
}

// How much h a at (x_, u_) moves when every coordinate is off by its rounding.
template <class S>
double ImplicitSolver<S>::rounding_of_force(const Step& step) {
  if (x_.size() == 0) return 0;
  // Neighbours must err in different directions: signs from the bits of a multiplied index.
  direction_ = S(double(std::numeric_limits<S>::epsilon()) / step.h) * x_.abs();
  for (Index i = 0; i < direction_.size(); ++i)
    if ((std::uint32_t(i) * 2654435761u) >> 31) direction_.data()[i] *= S(-1);
  product_.setZero(x_.rows(), 3);
  ++step.work.products;
  step.dynamics.add_implicit_times(x_, u_, S(step.h), true, direction_, product_);
  for (int k = 0; k < 3; ++k) product_.col(k) *= step.dynamics.inverse_mass();
  const double found = double(product_.abs().maxCoeff());
  return std::isfinite(found) ? found : 0;
}

// How fast Φ falls along step_ where velocities miss by `out`.
template <class S>
double ImplicitSolver<S>::fall(const Step& step, const Points<S>& out) const {
  const Values<S>& mass = step.dynamics.mass();
  double sum = 0;
  for (int k = 0; k < 3; ++k)
    sum += (mass.template cast<double>() * out.col(k).template cast<double>() * step_.col(k).template cast<double>())
               .sum();
  return sum;
}

template <class S>
SolveResult ImplicitSolver<S>::solve(const Implicit& scheme, Dynamics<S>& dynamics, const Points<S>& x,
                                     const Points<S>& v, double t, double whole, Work& work) {
  // With u = vθ and the end at t + θh both unknowns are those of a backward Euler step of θh.
  const double h = scheme.theta * whole;
  const Step step{dynamics, x, v, t, h, work};
  const double tolerance = tolerance_of<S>(scheme);
  // One linear solve cannot know the pressure that friction needs: its contacts come afterwards.
  planes_.clear(), contacts_.clear(), held_.clear();
  if (!scheme.linearised) find_planes(step, whole);
  u_ = v;
  clip(u_);
  SolveResult result;
  if (!std::isfinite(miss(step, u_, x_, out_))) {
    result.converged = false;
    result.residual = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  bool prepared = false;
  radius_ = std::numeric_limits<double>::infinity();
  spent_ = 0;
  double rounding = -1, gone = 0;  // gone: by how much Φ fell
  for (int iteration = 0;; ++iteration) {
    const double scale = std::max({largest(u_), largest(v), h * largest(acceleration_), kStandstill<S>});
    find_touches(step, tolerance * scale);
    filtered_ = out_;
    rub(step, u_, filtered_);
    filter(filtered_);
    const double residual = largest(filtered_);
    result.residual = residual / scale;
    result.converged = scheme.linearised ? residual == 0 : result.residual <= tolerance;
    if (!result.converged && iteration == scheme.max_iterations && gone > 0) {
      // Not the minimum, but downhill from where it began: bounded, and the next step goes on from there.
      result.converged = true;
      ++work.unfinished;
    }
    if (result.converged || iteration == scheme.max_iterations) break;
    if (!prepared) {
      prepare(step);
      prepared = true;
      cholesky_.analyse(x_.rows(), couplings_);
      double rate = 0;
      for (Index i = 0; i < x_.rows(); ++i)
        rate = std::max(rate, double(dynamics.inverse_mass()[i]) * diagonal_[std::size_t(i)].trace());
      patience_ = couplings_.empty() ? std::numeric_limits<double>::infinity()
                                     : cholesky_.cost() / (kProductCost * double(couplings_.size()));
      if (!factored_ && kProductsPerRate * std::sqrt(rate) > patience_) factor(step);
    }
    const double inner = scheme.linearised ? tolerance : std::clamp(result.residual, 0.1 * tolerance, 0.1);
    solve_linear(step, false, inner);
    if (scheme.linearised && on_border_) {
      radius_ = std::numeric_limits<double>::infinity();
      solve_linear(step, true, inner);
    }
    if (scheme.linearised) {
      u_ += update_;
      clip(u_);
      result.converged = true;
      break;
    }
    // The exact stiffness first; should its step fail, one with the positive part.
    bool found = false;
    double best = 0;
    for (const bool safe : {false, true}) {
      if (safe) solve_linear(step, true, inner);
      trial_u_ = u_ + update_;
      clip(trial_u_);
      step_ = trial_u_ - u_;
      const auto look = [&](double length, Points<S>& end_u, Points<S>& end_x, Points<S>& end_out) {
        end_u = u_ + S(length) * step_;
        const double worst = miss(step, end_u, end_x, end_out);
        whole_ = end_out;
        rub(step, end_u, whole_);
        const double slope = fall(step, whole_);
        filter(whole_);
        best = largest(whole_);
        return std::isfinite(worst) ? slope : std::numeric_limits<double>::quiet_NaN();
      };
      whole_ = out_;
      rub(step, u_, whole_);
      const double start = fall(step, whole_);
      double length = 1, end = look(1, trial_u_, trial_x_, trial_out_), fallen = 0;
      for (int halving = 0; halving < kHalvings && start > 0; ++halving) {
        const double end_best = best;
        if (best < 0.5 * residual) {
          found = true;
          fallen = length * (start + end) / 2;
          break;
        }
        const double middle = look(0.5 * length, middle_u_, middle_x_, middle_out_);
        fallen = length * (start + 4 * middle + end) / 6;
        if (fallen >= kEnoughFall * length * start) {
          best = end_best;
          found = true;
          break;
        }
        std::swap(trial_u_, middle_u_), std::swap(trial_x_, middle_x_), std::swap(trial_out_, middle_out_);
        length *= 0.5;
        end = middle;
      }
      // The next region: as far as this step was good, and farther where it fell short of nothing.
      if (length < 1)
        radius_ = length * length_;
      else if (found && on_border_ && end > -0.5 * start)
        radius_ *= end > 0.25 * start ? 4 : 2;
      else if (!on_border_)
        radius_ = std::isfinite(radius_) ? std::max(radius_, 2 * length_) : 4 * length_;
      if (found) {
        gone += fallen;
        break;
      }
    }
    if (!found || (iteration > 1 && !(best < 0.5 * residual))) {
      // Large forces that balance leave a rest that is nothing but the rounding of positions.
      if (rounding < 0) rounding = rounding_of_force(step);
      const double shift = h * largest(step_);
      const double smallest = 2 * double(std::numeric_limits<S>::epsilon()) * largest(x_);
      if (residual <= std::max(100 * tolerance * scale, rounding) || shift <= smallest) {
        result.converged = true;
        break;
      }
      if (!found) {
        // Friction that depends on the pressure of the last iteration need not come to rest.
        result.converged = gone > 0 || !held_.empty();
        work.unfinished += result.converged;
        break;
      }
    }
    std::swap(u_, trial_u_), std::swap(x_, trial_x_), std::swap(out_, trial_out_);
  }
  return result;
}

template class ImplicitSolver<float>;
template class ImplicitSolver<double>;

}  // namespace hooke
