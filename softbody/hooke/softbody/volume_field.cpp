#include <hooke/softbody/volume_field.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace hooke::softbody {

namespace {

template <class S>
Vec3 at(const Points<S>& x, int i) {
  return x.row(i).matrix().transpose().template cast<double>();
}

template <class S>
void add(Points<S>& x, int i, const Vec3& d) {
  for (int k = 0; k < 3; ++k) x(i, k) += S(d[k]);
}

// A sixth of (b - a) × (c - a): what a triangle adds to ∇V at each corner.
template <class S>
Vec3 gradient(const Points<S>& x, const Triangle& t) {
  const Vec3 a = at(x, t[0]);
  return (at(x, t[1]) - a).cross(at(x, t[2]) - a) / 6;
}

// In a closed surface whose triangles all face the same side, every edge is gone along once each way.
void require_closed(const std::vector<Triangle>& triangles, Index points) {
  std::vector<std::pair<int, int>> there, back;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = triangles[i][k], b = triangles[i][(k + 1) % 3];
      if (a < 0 || a >= points)
        throw std::invalid_argument("volume: triangle " + std::to_string(i) + " uses point " + std::to_string(a) +
                                    " of " + std::to_string(points));
      there.emplace_back(a, b);
      back.emplace_back(b, a);
    }
  std::sort(there.begin(), there.end());
  std::sort(back.begin(), back.end());
  const auto [open, other] = std::mismatch(there.begin(), there.end(), back.begin());
  if (open != there.end())
    throw std::invalid_argument(
        "volume: the surface must be closed and face one way; it is not at the edge between points " +
        std::to_string(open->first) + " and " + std::to_string(open->second));
}

}  // namespace

template <class S>
VolumeField<S>::VolumeField(double stiffness, const std::vector<Triangle>& triangles, const Points<S>& start)
    : stiffness_(stiffness), triangles_(triangles) {
  if (!(stiffness >= 0) || !std::isfinite(stiffness))
    throw std::invalid_argument("volume: stiffness must not be negative, got " + std::to_string(stiffness) + " Pa");
  require_closed(triangles_, start.rows());
  start_volume_ = volume(start);
  if (!(start_volume_ > 0))
    throw std::invalid_argument(
        "volume: the triangles must enclose a volume and be counter-clockwise from outside, got " +
        std::to_string(start_volume_) + " m3");
}

template <class S>
double VolumeField<S>::volume(const Points<S>& x) const {
  if (triangles_.empty()) return 0;
  // From a point of the body: cones to a far one would cancel.
  const Vec3 from = at(x, triangles_[0][0]);
  double sum = 0;
  for (const Triangle& t : triangles_) sum += (at(x, t[0]) - from).dot((at(x, t[1]) - from).cross(at(x, t[2]) - from));
  return sum / 6;
}

template <class S>
double VolumeField<S>::pressure(const Points<S>& x) const {
  return stiffness_ * (start_volume_ - volume(x)) / start_volume_;
}

template <class S>
void VolumeField<S>::add_force(const Points<S>& x, const Points<S>&, double, Points<S>& f) const {
  const double p = pressure(x);
  if (p == 0) return;
  for (const Triangle& t : triangles_) {
    const Vec3 force = p * gradient(x, t);
    for (const int corner : t) add(f, corner, force);
  }
}

template <class S>
void VolumeField<S>::add_stiffness_times(const Points<S>& x, const Points<S>& d, bool safe, Points<S>& out) const {
  double change = 0;  // of the volume, along d
  for (const Triangle& t : triangles_) change += gradient(x, t).dot(at(d, t[0]) + at(d, t[1]) + at(d, t[2]));
  const double rise = stiffness_ / start_volume_ * change, p = safe ? 0 : pressure(x);
  for (const Triangle& t : triangles_) {
    Vec3 sum = rise * gradient(x, t);
    if (p != 0) {
      const Vec3 a = at(x, t[0]), da = at(d, t[0]);
      sum -= p / 6 * ((at(d, t[1]) - da).cross(at(x, t[2]) - a) + (at(x, t[1]) - a).cross(at(d, t[2]) - da));
    }
    for (const int corner : t) add(out, corner, sum);
  }
}

template <class S>
double VolumeField<S>::potential_energy(const Points<S>& x) const {
  const double change = volume(x) - start_volume_;
  return 0.5 * stiffness_ * change * change / start_volume_;
}

template <class S>
typename ForceField<S>::Rates VolumeField<S>::rate_bounds(const Points<S>& x, const Points<S>&,
                                                          const Values<S>& inverse_mass) const {
  // The derivative of ∇V at point i by point j is [e/6]×, with e the line between the two corners opposite
  // the edge from i to j, no longer than the two edges from i that lead there.
  sums_.setZero(x.rows(), 4);
  for (const Triangle& t : triangles_) {
    const Vec3 g = gradient(x, t);
    const double sides[3] = {(at(x, t[1]) - at(x, t[0])).norm(), (at(x, t[2]) - at(x, t[1])).norm(),
                             (at(x, t[0]) - at(x, t[2])).norm()};
    for (std::size_t k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) sums_(t[k], axis) += g[axis];
      sums_(t[k], 3) += (sides[k] + sides[(k + 2) % 3]) / 6;
    }
  }
  double squares = 0, turning = 0;
  for (Index i = 0; i < x.rows(); ++i) {
    const double w = double(inverse_mass[i]);
    squares += w * (sums_(i, 0) * sums_(i, 0) + sums_(i, 1) * sums_(i, 1) + sums_(i, 2) * sums_(i, 2));
    turning = std::max(turning, w * sums_(i, 3));
  }
  return {stiffness_ / start_volume_ * squares + std::abs(pressure(x)) * turning, 0};
}

template <class S>
void VolumeField<S>::describe(Blueprint& out) const {
  CheckpointWriter surface;
  for (const Triangle& triangle : triangles_)
    for (const int corner : triangle) surface.add(corner);
  out.add("volume stiffness", stiffness_);
  out.add("volume", start_volume_);
  out.add_sum("volume's surface", surface);
}

template class VolumeField<float>;
template class VolumeField<double>;

}  // namespace hooke::softbody
