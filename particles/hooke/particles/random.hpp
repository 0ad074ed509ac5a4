// Random numbers that are functions of what they are for, not of the order in which they are asked.
#pragma once

#include <hooke/types.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace hooke::particles {

/// A counter-based generator: number `channel` of thing `counter`. The same bits at any thread count and in any
/// order. Mixing: the finaliser of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), once a word.
class Random {
 public:
  explicit Random(std::uint64_t seed = 0) : seed_(mix(seed + kStep)) {}

  std::uint64_t bits(std::uint64_t counter, std::uint64_t channel) const {
    return mix(mix(seed_ + kStep * counter) + kStep * (channel + 1));
  }
  /// In [0, 1).
  double uniform(std::uint64_t counter, std::uint64_t channel) const {
    return double(bits(counter, channel) >> 11) * 0x1p-53;
  }
  /// Uniform on the cap of the unit sphere within `angle` [rad] of the unit vector `axis`. Takes two channels.
  Vec3 within(const Vec3& axis, double angle, std::uint64_t counter, std::uint64_t channel) const {
    const double least = std::cos(angle);
    const double z = least + (1 - least) * uniform(counter, channel);
    const double turn = 2 * std::numbers::pi * uniform(counter, channel + 1);
    const double r = std::sqrt(std::fmax(0.0, 1 - z * z));
    const Vec3 side = any_normal(axis);
    return r * std::cos(turn) * side + r * std::sin(turn) * axis.cross(side) + z * axis;
  }

  /// A unit vector across `axis`, always the same.
  static Vec3 any_normal(const Vec3& axis) {
    const Vec3 least = std::abs(axis.x()) < 0.6 ? Vec3::UnitX() : Vec3::UnitY();
    return axis.cross(least).normalized();
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15;
  static constexpr std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  std::uint64_t seed_;
};

}  // namespace hooke::particles
