#include <hooke/particles/curve.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace hooke::particles {

namespace {

void check_increasing(const std::vector<double>& at, const char* who) {
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (!std::isfinite(at[i]))
      throw std::invalid_argument(std::string(who) + " " + std::to_string(i) + " is not finite");
    if (i > 0 && !(at[i] > at[i - 1]))
      throw std::invalid_argument(std::string(who) + " " + std::to_string(i) + " must be above the one before, " +
                                  std::to_string(at[i - 1]) + ", got " + std::to_string(at[i]));
  }
}

// The interval of t: the number of entries that are <= t.
std::size_t after(const std::vector<double>& at, double t) {
  return std::size_t(std::upper_bound(at.begin(), at.end(), t) - at.begin());
}

}  // namespace

Curve::Curve(double constant) : times_{0}, values_{constant}, sums_{0} {
  if (!std::isfinite(constant)) throw std::invalid_argument("Curve: value is not finite");
}

Curve::Curve(std::vector<double> times, std::vector<double> values)
    : times_(std::move(times)), values_(std::move(values)), sums_(times_.size(), 0) {
  if (times_.empty() || times_.size() != values_.size())
    throw std::invalid_argument("Curve: needs as many values as times and at least one, got " +
                                std::to_string(times_.size()) + " times and " + std::to_string(values_.size()) +
                                " values");
  check_increasing(times_, "Curve: time");
  for (std::size_t i = 0; i < values_.size(); ++i)
    if (!std::isfinite(values_[i])) throw std::invalid_argument("Curve: value " + std::to_string(i) + " is not finite");
  for (std::size_t i = 1; i < times_.size(); ++i)
    sums_[i] = sums_[i - 1] + 0.5 * (values_[i] + values_[i - 1]) * (times_[i] - times_[i - 1]);
}

double Curve::operator()(double t) const {
  const std::size_t i = after(times_, t);
  if (i == 0) return values_.front();
  if (i == times_.size()) return values_.back();
  const double s = (t - times_[i - 1]) / (times_[i] - times_[i - 1]);
  return values_[i - 1] + s * (values_[i] - values_[i - 1]);
}

double Curve::least() const { return *std::min_element(values_.begin(), values_.end()); }
double Curve::most() const { return *std::max_element(values_.begin(), values_.end()); }

double Curve::integral(double t) const {
  const std::size_t i = after(times_, t);
  if (i == 0) return values_.front() * (t - times_.front());
  const double since = t - times_[i - 1];
  return sums_[i - 1] + 0.5 * (values_[i - 1] + (*this)(t)) * since;
}

double Curve::inverse_integral(double value) const {
  constexpr double never = std::numeric_limits<double>::infinity();
  const std::size_t i = std::size_t(std::lower_bound(sums_.begin(), sums_.end(), value) - sums_.begin());
  if (i == 0) return values_.front() > 0 ? times_.front() + (value - sums_.front()) / values_.front() : never;
  const double missing = value - sums_[i - 1], start = values_[i - 1];
  if (i == sums_.size()) return start > 0 ? times_.back() + missing / start : never;
  const double slope = (values_[i] - start) / (times_[i] - times_[i - 1]);
  // missing = start s + ½ slope s², without cancellation.
  const double root = std::sqrt(std::max(0.0, start * start + 2 * slope * missing));
  return std::min(times_[i], times_[i - 1] + (start + root > 0 ? 2 * missing / (start + root) : 0));
}

Vec3 ColorRamp::operator()(double age) const {
  const std::size_t i = after(ages, age);
  if (i == 0) return colors.front();
  if (i == ages.size()) return colors.back();
  const double s = (age - ages[i - 1]) / (ages[i] - ages[i - 1]);
  return (1 - s) * colors[i - 1] + s * colors[i];
}

void ColorRamp::check() const {
  if (ages.empty() || ages.size() != colors.size())
    throw std::invalid_argument("ColorRamp: needs as many colors as ages and at least one");
  check_increasing(ages, "ColorRamp: age");
  for (std::size_t i = 0; i < colors.size(); ++i)
    if (!colors[i].allFinite() || (colors[i].array() < 0).any())
      throw std::invalid_argument("ColorRamp: color " + std::to_string(i) + " must be finite and not negative");
}

}  // namespace hooke::particles
