#include <render/particles.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hooke::render {

namespace {

[[noreturn]] void refuse(const char* array, Index i, const std::string& rule, double value) {
  throw std::invalid_argument(std::string(array) + "[" + std::to_string(i) + "] must be " + rule + ", got " +
                              std::to_string(value));
}

template <class A>
void require_rows(const char* name, const A* array, Index n) {
  if (array && array->rows() != n)
    throw std::invalid_argument(std::string(name) + " must have one row a particle (" + std::to_string(n) + "), got " +
                                std::to_string(array->rows()));
}

template <class A>
void require_within(const char* name, const A* array, double least, double most, const std::string& rule) {
  if (!array) return;
  for (Index i = 0; i < array->rows(); ++i)
    for (Index k = 0; k < array->cols(); ++k)
      if (const auto value = double((*array)(i, k)); !(value >= least && value <= most)) refuse(name, i, rule, value);
}

// One lobe of Wyman, Sloan and Shirley's fits.
double lobe(double x, double middle, double below, double above) {
  const double t = (x - middle) / (x < middle ? below : above);
  return std::exp(-0.5 * t * t);
}

Vec3 black_body_xyz(double kelvin) {
  constexpr double c2 = 1.438776877e-2;  // h c / k [m K]
  Vec3 sum(0, 0, 0);
  for (int nm = 360; nm <= 830; nm += 5) {
    const double metres = 1e-9 * nm;
    const double radiance = std::pow(560.0 / nm, 5) / std::expm1(c2 / (metres * kelvin));
    sum += radiance * Vec3(1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
                               0.065 * lobe(nm, 501.1, 20.4, 26.2),
                           0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1),
                           1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8));
  }
  return sum;
}

struct Source {
  Vec3 place, power;
  double weight;
};

}  // namespace

void require_drawable(const Particles& p) {
  const bool sparks = p.kind == Particles::Kind::Sparks;
  if (!p.positions || !p.radii || (sparks && (!p.velocities || !p.colors)))
    throw std::invalid_argument(sparks ? "sparks need positions, velocities, colors and radii"
                                       : "smoke and drops need positions and radii");
  const Index n = p.positions->rows();
  require_rows("velocities", p.velocities, n);
  require_rows("colors", p.colors, n);
  require_rows("radii", p.radii, n);
  require_rows("opacities", p.opacities, n);
  require_rows("turns", p.turns, n);
  require_rows("ages", p.ages, n);
  constexpr double far = 1e9;
  require_within("positions", p.positions, -far, far, "finite");
  require_within("velocities", p.velocities, -far, far, "finite");
  require_within("colors", p.colors, 0, sparks ? far : 1, sparks ? "finite and not negative" : "in [0, 1]");
  require_within("radii", p.radii, 0, far, "finite and not negative");
  require_within("opacities", p.opacities, 0, 1, "in [0, 1]");
  require_within("turns", p.turns, -far, far, "finite");
  require_within("ages", p.ages, 0, HUGE_VAL, "not negative");
  if (!(p.shutter >= 0 && p.shutter <= far))
    throw std::invalid_argument("shutter must be finite and not negative, got " + std::to_string(p.shutter));
  if (p.texture && (p.texture->width < 1 || p.texture->height < 1 ||
                    p.texture->rgb.size() != 3 * std::size_t(p.texture->width) * std::size_t(p.texture->height)))
    throw std::invalid_argument("texture must have three bytes a pixel and at least one pixel");
}

Vec3 black_body(double kelvin) {
  if (!(kelvin >= 500 && kelvin <= 50000))
    throw std::invalid_argument("black_body: the temperature must be in [500, 50000] K, got " + std::to_string(kelvin));
  static const double reference = black_body_xyz(2000).y();
  Mat3 to_srgb;  // IEC 61966-2-1
  to_srgb << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259, 1.0572252;
  return (to_srgb * black_body_xyz(kelvin) / reference).cwiseMax(0);
}

// Far away the mean of 1 / distance² is (1 + size² / (3 distance²)) / distance²; in the
// middle of a ball or a Gaussian cloud 1.8 or 3 / size².
double Lamp::falloff(const Vec3& from, double least) const {
  const double d2 = (place - from).squaredNorm(), s2 = size * size + least * least;
  return (d2 + s2) / (d2 * d2 + s2 * (0.667 * d2 + 0.42 * s2));
}

// Means by energy (Lloyd's iteration) from starts that lie far apart. Which spark belongs
// to which lamp may jump from frame to frame; what the lamps give together does not, since
// each is as wide as its sparks are.
std::vector<Lamp> lamps_of(std::span<const Particles> particles, int most) {
  std::vector<Source> sources;
  Vec3 middle(0, 0, 0);
  double total = 0;
  for (const Particles& p : particles) {
    if (p.kind != Particles::Kind::Sparks) continue;
    for (Index i = 0; i < p.positions->rows(); ++i) {
      double share = (*p.radii)(i) * double((*p.radii)(i)), way = 0.5 * p.shutter;
      if (p.ages && (*p.ages)(i) < p.shutter) {
        way = 0.5 * (*p.ages)(i);
        share *= (*p.ages)(i) / p.shutter;
      }
      const Vec3 power = share * p.colors->row(i).matrix().transpose().cast<double>();
      const double weight = power.dot(Vec3(0.2126, 0.7152, 0.0722));
      if (!(weight > 0)) continue;
      const Vec3 x = p.positions->row(i).matrix().transpose().cast<double>();
      const Vec3 v = p.velocities->row(i).matrix().transpose().cast<double>();
      sources.push_back({x - way * v, power, weight});
      middle += weight * sources.back().place;
      total += weight;
    }
  }
  if (sources.empty()) return {};
  middle /= total;

  std::vector<Vec3> centers;
  std::vector<double> gap(sources.size(), HUGE_VAL);
  std::vector<std::size_t> nearest(sources.size(), 0);
  const auto add_center = [&](const Vec3& center) {
    for (std::size_t i = 0; i < sources.size(); ++i)
      if (const double d2 = (sources[i].place - center).squaredNorm(); d2 < gap[i]) {
        gap[i] = d2;
        nearest[i] = centers.size();
      }
    centers.push_back(center);
  };
  add_center(middle);
  while (int(centers.size()) < most) {
    std::size_t worst = 0;
    for (std::size_t i = 1; i < sources.size(); ++i)
      if (sources[i].weight * gap[i] > sources[worst].weight * gap[worst]) worst = i;
    if (!(gap[worst] > 1e-12)) break;
    add_center(sources[worst].place);
  }
  std::vector<double> weights(centers.size());
  for (int round = 0; round < 8; ++round) {
    std::vector<Vec3> sums(centers.size(), Vec3::Zero());
    std::fill(weights.begin(), weights.end(), 0);
    for (std::size_t i = 0; i < sources.size(); ++i) {
      sums[nearest[i]] += sources[i].weight * sources[i].place;
      weights[nearest[i]] += sources[i].weight;
    }
    for (std::size_t k = 0; k < centers.size(); ++k)
      if (weights[k] > 0) centers[k] = sums[k] / weights[k];
    for (std::size_t i = 0; i < sources.size(); ++i) {
      gap[i] = HUGE_VAL;
      for (std::size_t k = 0; k < centers.size(); ++k)
        if (const double d2 = (sources[i].place - centers[k]).squaredNorm(); d2 < gap[i]) gap[i] = d2, nearest[i] = k;
    }
  }
  std::vector<Lamp> lamps(centers.size());
  std::fill(weights.begin(), weights.end(), 0);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    lamps[nearest[i]].power += sources[i].power;
    lamps[nearest[i]].place += sources[i].weight * sources[i].place;
    weights[nearest[i]] += sources[i].weight;
  }
  for (std::size_t k = 0; k < lamps.size(); ++k)
    if (weights[k] > 0) lamps[k].place /= weights[k];
  for (std::size_t i = 0; i < sources.size(); ++i)
    lamps[nearest[i]].size += sources[i].weight * (sources[i].place - lamps[nearest[i]].place).squaredNorm();
  for (std::size_t k = 0; k < lamps.size(); ++k)
    if (weights[k] > 0) lamps[k].size = std::sqrt(lamps[k].size / weights[k]);
  std::erase_if(lamps, [](const Lamp& lamp) { return !(lamp.power.maxCoeff() > 0); });
  return lamps;
}

}  // namespace hooke::render
