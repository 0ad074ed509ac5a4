#include <hooke/body.hpp>

#include <stdexcept>

namespace hooke {

namespace {

void check_index(Index point, Index size) {
  if (point < 0 || point >= size)
    throw std::out_of_range("point " + std::to_string(point) + " of " + std::to_string(size));
}

}  // namespace

std::string StepReport::text() const {
  if (good()) return "good";
  const char* what = status == Status::NotFinite      ? "became infinite or NaN"
                     : status == Status::NotConverged ? "the implicit solve did not converge"
                     : status == Status::EnergyGrew   ? "gains energy from nowhere"
                                                      : "takes steps that may be unstable";
  std::string where = "body \"" + body + "\"" + (point >= 0 ? ", point " + std::to_string(point) : "");
  return where + ": " + what + " after " + std::to_string(time) + " s; " + advice;
}

// Nothing is known to oscillate.
double Body::stable_step(const Method& method) const { return largest_stable_step(method, 0, 0); }

void Body::describe(Blueprint&) const {}

void Body::save(CheckpointWriter&) const {
  throw std::invalid_argument("body \"" + name_ + "\": its kind has no checkpoints");
}

void Body::load(CheckpointReader&) {
  throw std::invalid_argument("body \"" + name_ + "\": its kind has no checkpoints");
}

Vec3 Body::displacement(Index point) const {
  check_index(point, size());
  return row(positions(), point) - row(start_positions(), point);
}

Vec3 Body::displacement() const {
  const Values<double> mass = masses();
  if (mass.size() == 0) return Vec3::Zero();
  const Points<double> moved = positions() - start_positions();
  return (moved.colwise() * mass).colwise().sum().matrix().transpose() / mass.sum();
}

double Body::speed(Index point) const {
  check_index(point, size());
  return row(velocities(), point).norm();
}

double Body::weight(Index point, const Vec3& gravity) const {
  check_index(point, size());
  return masses()[point] * gravity.norm();
}

}  // namespace hooke
