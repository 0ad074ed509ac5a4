#include <scene/cape.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace hooke::scene {

namespace {

// The heading of the cape lies on an ellipse around the neck, seen from above, and is gathered
// into pleats: more cloth than the way is long. All in metres and radians.
constexpr double kHalfWidth = 0.15, kHalfDepth = 0.066, kBehindNeck = 0.012;
constexpr double kEnd = 130 * std::numbers::pi / 180;  // how far around the neck, from the nape
constexpr int kPleats = 9;
// Layers of cloth in the hem of the sides and in the collar, for mass and stiffness alike, and how
// many rows of points the collar has below the heading: both spread what few pins would carry.
constexpr int kHemLayers = 4, kCollarLayers = 4, kCollarRows = 5;
constexpr double kFlatEnd = 0.12;  // share of the heading over which pleats grow from nothing

// The person from above: where the neck is, and which way it looks.
struct Shoulders {
  Vec3 neck, left, forward;
  std::vector<Capsule> capsules;  // without the head
};

Shoulders shoulders_of(const human::Human& human, double t) {
  std::vector<Capsule> capsules(std::size_t(human.capsule_count()));
  human.capsules(t, capsules);
  Shoulders out;
  Vec3 sum[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  int count[3] = {0, 0, 0};
  for (std::size_t i = 0; i < capsules.size(); ++i) {
    const std::string& bone = human.bones()[i].bone;
    if (bone.starts_with("Head")) continue;
    out.capsules.push_back(capsules[i]);
    const int which = bone == "Neck" ? 0 : bone == "LeftShoulder" ? 1 : bone == "RightShoulder" ? 2 : -1;
    if (which < 0) continue;
    sum[which] += which == 0 ? capsules[i].a : capsules[i].b;
    ++count[which];
  }
  if (!count[0] || !count[1] || !count[2])
    throw std::invalid_argument("cape: the human needs the joints Neck, LeftShoulder and RightShoulder");
  out.neck = sum[0] / count[0];
  out.left = sum[1] / count[1] - sum[2] / count[2];
  out.left.y() = 0;
  out.left.normalize();
  out.forward = out.left.cross(Vec3::UnitY());
  return out;
}

// The highest point at least `gap` off the capsules above (x, z).
Vec3 dropped(const Shoulders& s, double gap, Vec3 x) {
  x.y() = s.neck.y() + 0.12;
  for (int i = 0; i < 200; ++i) {
    double distance = std::numeric_limits<double>::infinity();
    for (const Capsule& capsule : s.capsules) distance = std::min(distance, signed_distance(capsule, x) - gap);
    if (distance < 1e-5) break;
    x.y() -= 0.7 * distance;
  }
  return x;
}

// The heading with pleats of that amplitude, as `columns` points of equal distance.
Points<double> heading(const Shoulders& s, const CapeSettings& settings, double amplitude) {
  constexpr int kFine = 1500;
  std::vector<Vec3> fine;
  std::vector<double> length{0};
  for (int i = 0; i <= kFine; ++i) {
    const double share = double(i) / kFine, angle = kEnd * (1 - 2 * share);
    // The ends lie flat: in a pleat they would take the load of their neighbours.
    const double end = std::min(1.0, std::min(share, 1 - share) / kFlatEnd);
    const double out = amplitude * end * end * (3 - 2 * end) * (1 - std::cos(2 * std::numbers::pi * kPleats * share));
    const double left = (kHalfWidth + out) * std::sin(angle);
    const double back = kBehindNeck + (kHalfDepth + out) * std::cos(angle);
    fine.push_back(dropped(s, settings.thickness, s.neck + left * s.left - back * s.forward));
    if (i > 0) length.push_back(length.back() + (fine[std::size_t(i)] - fine[std::size_t(i) - 1]).norm());
  }
  Points<double> out(settings.columns, 3);
  for (int c = 0; c < settings.columns; ++c) {
    const double wanted = length.back() * c / (settings.columns - 1);
    const auto after = std::lower_bound(length.begin() + 1, length.end() - 1, wanted);
    const std::size_t i = std::size_t(after - length.begin());
    const double share = (wanted - length[i - 1]) / std::max(1e-12, length[i] - length[i - 1]);
    out.row(c) = (fine[i - 1] + share * (fine[i] - fine[i - 1])).transpose();
  }
  return out;
}

double chord_length(const Points<double>& x) {
  double sum = 0;
  for (Index i = 1; i < x.rows(); ++i) sum += (x.row(i) - x.row(i - 1)).matrix().norm();
  return sum;
}

}  // namespace

Cape dress(const human::Human& human, const CapeSettings& s, double t0) {
  Cape cape;
  cape.cloth = softbody::cloth_from_grid(s.width, s.height, s.columns, s.rows, {1, 0, 0}, {0, -1, 0}, s.material);

  // Rest lengths are those of the flat cloth, not of the gathered one.
  softbody::SpringNetwork network = *cape.cloth.network;
  const std::vector<double> rest = rest_lengths(network, cape.cloth.positions);
  const auto layers = [&](int point) {
    const int row = point / s.columns, column = point % s.columns;
    return std::max(column == 0 || column == s.columns - 1 ? kHemLayers : 1, row <= kCollarRows ? kCollarLayers : 1);
  };
  for (std::size_t i = 0; i < rest.size(); ++i) {
    softbody::Spring& spring = network.springs[i];
    const int sewn = std::min(layers(spring.a), layers(spring.b));
    spring.rest_length = rest[i];
    spring.stiffness *= sewn;
    spring.damping *= sewn;
  }
  for (Index i = 0; i < cape.cloth.masses.size(); ++i) cape.cloth.masses[i] *= layers(int(i));
  cape.cloth.network = std::make_shared<const softbody::SpringNetwork>(std::move(network));

  const Shoulders shoulders = shoulders_of(human, t0);
  double low = 0, high = 0.04;
  for (int i = 0; i < 30; ++i) {
    const double middle = 0.5 * (low + high);
    (chord_length(heading(shoulders, s, middle)) < s.width ? low : high) = middle;
  }
  const Points<double> top = heading(shoulders, s, low);

  // The rest starts streaming out behind and falls into place.
  const Vec3 behind = (-shoulders.forward + Vec3(0, 0.2, 0)).normalized();
  for (int row = 0; row < s.rows; ++row)
    for (int column = 0; column < s.columns; ++column)
      cape.cloth.positions.row(Index(row) * s.columns + column) =
          top.row(column) + (s.height * row / (s.rows - 1) * behind).transpose().array();
  for (int c = 0; c < s.columns; ++c) cape.pins.push_back(c);
  cape.attachment = human.attach(top, t0);
  return cape;
}

}  // namespace hooke::scene
