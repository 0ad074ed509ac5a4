#include <hooke/softbody/wind.hpp>

#include <hooke/softbody/kernels.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

namespace hooke::softbody {

namespace {

constexpr Index kShortestRun = 8;

// In [-1, 1]: three waves whose periods share no common multiple.
double gust_wave(double t, double period, std::uint32_t seed) {
  std::minstd_rand random(seed);
  double sum = 0;
  for (const auto& [share, speed] : {std::pair{0.5, 1.0}, {0.3, 2.618}, {0.2, 5.331}}) {
    const double phase = 2 * std::numbers::pi * double(random()) / double(std::minstd_rand::max());
    sum += share * std::sin(2 * std::numbers::pi * speed * t / period + phase);
  }
  return sum;
}

}  // namespace

Vec3 Wind::velocity_at(double t) const {
  t -= start;
  if (t >= stop || velocity.isZero(0)) return Vec3::Zero();
  double strength = 1;
  if (gust > 0) strength += gust * gust_wave(t, gust_period, seed);
  if (fade > 0 && t > stop - fade) {
    const double s = (stop - t) / fade;
    strength *= s * s * (3 - 2 * s);
  }
  Vec3 out = strength * velocity;
  if (swing != 0) {
    const double angle = swing * gust_wave(t, 1.3 * gust_period, seed + 1);
    const double c = std::cos(angle), s = std::sin(angle);
    out = Vec3(c * out.x() + s * out.z(), out.y(), c * out.z() - s * out.x());
  }
  return out;
}

template <class S>
WindField<S>::WindField(const Wind& wind, const std::vector<Triangle>& triangles, Index point_count)
    : wind_(wind), triangles_(triangles) {
  const auto require = [](bool holds, const char* rule) {
    if (!holds) throw std::invalid_argument(std::string("wind: ") + rule);
  };
  require(wind.velocity.allFinite(), "velocity must be finite");
  require(wind.gust >= 0 && std::isfinite(wind.gust), "gust must not be negative");
  require(wind.gust_period > 0, "gust_period must be positive");
  require(std::isfinite(wind.swing) && std::isfinite(wind.start), "swing and start must be finite");
  require(wind.air_density >= 0 && wind.drag >= 0 && wind.lift >= 0 && wind.fade >= 0,
          "air_density, drag, lift and fade must not be negative");
  for (const Triangle& t : triangles)
    for (const int corner : t)
      if (corner < 0 || corner >= point_count)
        throw std::invalid_argument("wind: triangle corner " + std::to_string(corner) + " of " +
                                    std::to_string(point_count) + " points");
  // Triangles of a grid come as two interleaved sequences; sorting by shape untangles them.
  std::vector<Triangle> sorted = triangles;
  const auto shape = [](const Triangle& t) { return std::array{t[1] - t[0], t[2] - t[0], t[0]}; };
  std::sort(sorted.begin(), sorted.end(), [&](const Triangle& s, const Triangle& t) { return shape(s) < shape(t); });
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t end = i + 1;
    const auto follows = [&](std::size_t j) {
      const int step = int(j - i);
      return sorted[j] == Triangle{sorted[i][0] + step, sorted[i][1] + step, sorted[i][2] + step};
    };
    while (end < sorted.size() && follows(end)) ++end;
    if (Index(end - i) >= kShortestRun)
      runs_.push_back({{sorted[i][0], sorted[i][1], sorted[i][2]}, Index(end - i)});
    else
      loose_.insert(loose_.end(), sorted.begin() + std::ptrdiff_t(i), sorted.begin() + std::ptrdiff_t(end));
    i = end;
  }
}

template <class S>
void WindField<S>::add_force(const Points<S>& x, const Points<S>& v, double t, Points<S>& f) const {
  WindBlock<S> block;
  const Vec3 wind = wind_.velocity_at(t);
  for (int k = 0; k < 3; ++k) block.wind[k] = S(wind[k]);
  block.drag = S(wind_.air_density * wind_.drag / 6);
  block.lift = S(wind_.air_density * wind_.lift / 6);
  for (const Run& run : runs_) {
    for (Index done = 0; done < run.count; done += kBlock) {
      block.n = int(std::min<Index>(kBlock, run.count - done));
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k) {
          block.x[c][k] = x.col(k).data() + run.corner[c] + done;
          block.v[c][k] = v.col(k).data() + run.corner[c] + done;
          block.sum[c][k] = f.col(k).data() + run.corner[c] + done;
        }
      wind_forces(block);
    }
  }
  S gathered[18][kBlock];
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) block.sum[c][k] = nullptr;
  for (std::size_t first = 0; first < loose_.size(); first += kBlock) {
    block.n = int(std::min<std::size_t>(kBlock, loose_.size() - first));
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) {
        S *px = gathered[3 * c + k], *pv = gathered[9 + 3 * c + k];
        for (int i = 0; i < block.n; ++i) {
          const int corner = loose_[first + std::size_t(i)][std::size_t(c)];
          px[i] = x(corner, k), pv[i] = v(corner, k);
        }
        block.x[c][k] = px, block.v[c][k] = pv;
      }
    wind_forces(block);
    for (int i = 0; i < block.n; ++i)
      for (const int corner : loose_[first + std::size_t(i)])
        for (int k = 0; k < 3; ++k) f(corner, k) += block.f[k][i];
  }
}

// Per point, an upper bound of the derivative of the force by velocity [N·s/m].
template <class S>
const Values<S>& WindField<S>::damping(const Points<S>& x, const Points<S>& v) const {
  Values<S>& out = damping_;
  out.setZero(x.rows());
  const double mean = wind_.velocity.norm() * (1 + wind_.gust);
  const double scale = wind_.air_density * (wind_.drag + wind_.lift) / 3;
  for (const Triangle& t : triangles_) {
    const auto at = [](const Points<S>& p, int i) -> Vec3 {
      return p.row(i).matrix().transpose().template cast<double>();
    };
    const double area = 0.5 * (at(x, t[1]) - at(x, t[0])).cross(at(x, t[2]) - at(x, t[0])).norm();
    const double speed = mean + (at(v, t[0]) + at(v, t[1]) + at(v, t[2])).norm() / 3;
    for (const int corner : t) out[corner] += S(scale * area * speed);
  }
  return out;
}

template <class S>
void WindField<S>::add_damping_times(const Points<S>& x, const Points<S>& v, const Points<S>& d, Points<S>& out) const {
  out += d.colwise() * damping(x, v);
}

template <class S>
typename ForceField<S>::Rates WindField<S>::rate_bounds(const Points<S>& x, const Points<S>& v,
                                                        const Values<S>& inverse_mass) const {
  if (x.rows() == 0) return {};
  return {0, double((damping(x, v) * inverse_mass).maxCoeff())};
}

template <class S>
void WindField<S>::describe(Blueprint& out) const {
  CheckpointWriter wind;
  wind.add(wind_.velocity);
  for (const double value : {wind_.gust, wind_.gust_period, wind_.swing, wind_.start, wind_.stop, wind_.fade,
                             wind_.air_density, wind_.drag, wind_.lift})
    wind.add(value);
  wind.add(wind_.seed);
  for (const Triangle& triangle : triangles_)
    for (const int corner : triangle) wind.add(corner);
  out.add_sum("wind", wind);
}

template class WindField<float>;
template class WindField<double>;

}  // namespace hooke::softbody
