#include <hooke/force_field.hpp>

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace hooke {

namespace {

double checked_coefficient(const char* who, double coefficient) {
  if (!(coefficient >= 0) || !std::isfinite(coefficient))
    throw std::invalid_argument(std::string(who) + ": coefficient must not be negative, got " +
                                std::to_string(coefficient));
  return coefficient;
}

}  // namespace

template <class S>
void ForceField<S>::add_fine_force(const Points<S>& x, const Points<S>&, const Points<S>& v, double t,
                                   Points<S>& f) const {
  add_force(x, v, t, f);
}

template <class S>
void ForceField<S>::add_stiffness_times(const Points<S>&, const Points<S>&, bool, Points<S>&) const {}

template <class S>
void ForceField<S>::add_damping_times(const Points<S>&, const Points<S>&, const Points<S>&, Points<S>&) const {}

template <class S>
void ForceField<S>::add_couplings(const Points<S>&, const Points<S>&, double, std::vector<Coupling>&) const {}

template <class S>
double ForceField<S>::potential_energy(const Points<S>&) const {
  return 0;
}

template <class S>
typename ForceField<S>::Rates ForceField<S>::rate_bounds(const Points<S>&, const Points<S>&, const Values<S>&) const {
  return {};
}

template <class S>
LinearDrag<S>::LinearDrag(double coefficient) : coefficient_(S(checked_coefficient("LinearDrag", coefficient))) {}

template <class S>
void LinearDrag<S>::add_force(const Points<S>&, const Points<S>& v, double, Points<S>& f) const {
  f -= coefficient_ * v;
}

template <class S>
void LinearDrag<S>::add_damping_times(const Points<S>&, const Points<S>&, const Points<S>& d, Points<S>& out) const {
  out += coefficient_ * d;
}

template <class S>
typename ForceField<S>::Rates LinearDrag<S>::rate_bounds(const Points<S>&, const Points<S>&,
                                                         const Values<S>& inverse_mass) const {
  return {0, inverse_mass.size() ? double(coefficient_ * inverse_mass.maxCoeff()) : 0};
}

template <class S>
QuadraticDrag<S>::QuadraticDrag(double coefficient)
    : coefficient_(S(checked_coefficient("QuadraticDrag", coefficient))) {}

template <class S>
void QuadraticDrag<S>::add_force(const Points<S>&, const Points<S>& v, double, Points<S>& f) const {
  for (Index i = 0; i < v.rows(); ++i) {
    const S speed = std::sqrt(v(i, 0) * v(i, 0) + v(i, 1) * v(i, 1) + v(i, 2) * v(i, 2));
    for (int k = 0; k < 3; ++k) f(i, k) -= coefficient_ * speed * v(i, k);
  }
}

template <class S>
void QuadraticDrag<S>::add_damping_times(const Points<S>&, const Points<S>& v, const Points<S>& d,
                                         Points<S>& out) const {
  // ∂(|v| v)/∂v = |v| I + v vᵀ / |v|, positive for any v.
  for (Index i = 0; i < v.rows(); ++i) {
    const S speed = std::sqrt(v(i, 0) * v(i, 0) + v(i, 1) * v(i, 1) + v(i, 2) * v(i, 2));
    const S along = v(i, 0) * d(i, 0) + v(i, 1) * d(i, 1) + v(i, 2) * d(i, 2);
    const S scale = speed > 0 ? along / speed : S(0);
    for (int k = 0; k < 3; ++k) out(i, k) += coefficient_ * (speed * d(i, k) + scale * v(i, k));
  }
}

template <class S>
typename ForceField<S>::Rates QuadraticDrag<S>::rate_bounds(const Points<S>&, const Points<S>& v,
                                                            const Values<S>& inverse_mass) const {
  double gamma = 0;
  for (Index i = 0; i < v.rows(); ++i)
    gamma = std::max(
        gamma, 2 * double(coefficient_) * double(inverse_mass[i]) * v.row(i).matrix().template cast<double>().norm());
  return {0, gamma};
}

template <class S>
TimeForce<S>::TimeForce(std::function<Vec3(double)> force) : force_(std::move(force)) {}

template <class S>
void TimeForce<S>::add_force(const Points<S>&, const Points<S>&, double t, Points<S>& f) const {
  const Vec3 force = force_(t);
  for (int k = 0; k < 3; ++k) f.col(k) += S(force[k]);
}

template class ForceField<float>;
template class ForceField<double>;
template class LinearDrag<float>;
template class LinearDrag<double>;
template class QuadraticDrag<float>;
template class QuadraticDrag<double>;
template class TimeForce<float>;
template class TimeForce<double>;

}  // namespace hooke
