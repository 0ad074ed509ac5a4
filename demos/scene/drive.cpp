#include <scene/drive.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hooke::scene {

namespace {

// Cubic Hermite through the keys; slopes from the neighbours, zero at both ends.
Vec3 along_keys(const std::vector<Key>& keys, double t) {
  if (t <= keys.front().time) return keys.front().offset;
  if (t >= keys.back().time) return keys.back().offset;
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), t, [](double at, const Key& key) { return at < key.time; });
  const auto slope = [&](std::vector<Key>::const_iterator key) -> Vec3 {
    if (key == keys.begin() || key + 1 == keys.end()) return Vec3::Zero();
    return ((key + 1)->offset - (key - 1)->offset) / ((key + 1)->time - (key - 1)->time);
  };
  const auto before = after - 1;
  const double h = after->time - before->time, s = (t - before->time) / h;
  const double s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * before->offset + (s3 - 2 * s2 + s) * h * slope(before) +
         (3 * s2 - 2 * s3) * after->offset + (s3 - s2) * h * slope(after);
}

}  // namespace

Vec3 Drive::offset(double t) const {
  if (!keys.empty()) return along_keys(keys, t);
  if (t <= 0) return Vec3::Zero();
  return t * translate + std::sin(2 * std::numbers::pi * t / period) * swing;
}

}  // namespace hooke::scene
