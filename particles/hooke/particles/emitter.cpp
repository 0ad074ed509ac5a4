#include <hooke/particles/emitter.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke::particles {

namespace {

constexpr double kPi = std::numbers::pi;
// Bursts and rates count apart, so that one does not shift the other's random numbers.
constexpr std::uint64_t kBurst = std::uint64_t(1) << 62;
constexpr double kMostRate = 1e9;
// Half of the difference that gives a path's velocity [s].
constexpr double kPathStep = 1e-4;

[[noreturn]] void fail(const std::string& rule) { throw std::invalid_argument("Emitter: " + rule); }

void check(const char* name, const Range& range, double least, bool least_allowed, const char* rule) {
  const bool low = least_allowed ? range.least >= least : range.least > least;
  if (!low || !(range.most >= range.least) || std::isnan(range.most))
    fail(std::string(name) + " must be " + rule + " and in order, got [" + std::to_string(range.least) + ", " +
         std::to_string(range.most) + "]");
}

void check(const char* name, double value, bool good, const char* rule) {
  if (!good) fail(std::string(name) + " must be " + rule + ", got " + std::to_string(value));
}

Vec3 vertex(const TriangleMesh& mesh, int i) { return mesh.vertices.row(i).matrix().transpose(); }

std::vector<double> check_mesh(const MeshSource& source) {
  if (!source.mesh || source.mesh->triangles.empty()) fail("the mesh has no triangles");
  std::vector<double> sums;
  double sum = 0;
  for (std::size_t i = 0; i < source.mesh->triangles.size(); ++i) {
    const Triangle& t = source.mesh->triangles[i];
    for (const int v : t)
      if (v < 0 || v >= source.mesh->vertices.rows())
        fail("triangle " + std::to_string(i) + " of the mesh has vertex " + std::to_string(v) + " of " +
             std::to_string(source.mesh->vertices.rows()));
    const Vec3 a = vertex(*source.mesh, t[0]);
    sum += 0.5 * (vertex(*source.mesh, t[1]) - a).cross(vertex(*source.mesh, t[2]) - a).norm();
    sums.push_back(sum);
  }
  if (!(sum > 0) || !std::isfinite(sum)) fail("the mesh has no area, or is not finite");
  return sums;
}

}  // namespace

Emitter::Emitter(EmitterSettings settings) : settings_(std::move(settings)), random_(settings_.seed) {
  auto& s = settings_;
  if (!s.position.allFinite()) fail("position must be finite");
  if (!s.axis.allFinite() || !(s.axis.norm() > 1e-12)) fail("axis must be a direction, not of length 0");
  s.axis.normalize();
  check("spread", s.spread, s.spread >= 0 && s.spread <= kPi + 1e-9, "from 0 to π rad");
  check("rate", s.rate.least(), s.rate.least() >= 0, "0 or more");
  check("rate", s.rate.most(), s.rate.most() <= kMostRate, "at most 1e9 a second");
  check("start", s.start, std::isfinite(s.start), "finite");
  check("stop", s.stop, s.stop >= s.start, "no earlier than start");
  check("inherit", s.inherit, std::isfinite(s.inherit), "finite");
  check("kind", s.kind, s.kind >= 0 && s.kind < 256, "from 0 to 255");
  check("speed", s.speed, -1e9, true, "finite");
  check("speed", s.speed.most, s.speed.most <= 1e9, "finite");
  check("lifetime", s.lifetime, 0, false, "positive");
  check("mass", s.mass, 0, false, "positive");
  check("mass", s.mass.most, std::isfinite(s.mass.most), "finite");
  check("size", s.size, 0, true, "0 or more");
  check("size", s.size.most, std::isfinite(s.size.most), "finite");
  for (std::size_t i = 0; i < s.bursts.size(); ++i) {
    const std::string name = "bursts[" + std::to_string(i) + "].";
    check((name + "time").c_str(), s.bursts[i].time, s.bursts[i].time >= 0 && std::isfinite(s.bursts[i].time),
          "0 or more");
    check((name + "count").c_str(), double(s.bursts[i].count), s.bursts[i].count >= 0, "0 or more");
    check((name + "period").c_str(), s.bursts[i].period, s.bursts[i].period >= 0 && std::isfinite(s.bursts[i].period),
          "0 or more");
  }
  if (const auto* disc = std::get_if<DiscSource>(&s.source)) {
    check("radius", disc->radius, disc->radius >= 0 && std::isfinite(disc->radius), "0 or more");
    check("inner_radius", disc->inner_radius, disc->inner_radius >= 0 && disc->inner_radius <= disc->radius,
          "from 0 to radius");
  } else if (const auto* ball = std::get_if<SphereSource>(&s.source)) {
    check("radius", ball->radius, ball->radius >= 0 && std::isfinite(ball->radius), "0 or more");
    check("inner_radius", ball->inner_radius, ball->inner_radius >= 0 && ball->inner_radius <= ball->radius,
          "from 0 to radius");
  } else if (const auto* cone = std::get_if<ConeSource>(&s.source)) {
    check("radius", cone->radius, cone->radius >= 0 && std::isfinite(cone->radius), "0 or more");
    check("angle", cone->angle, cone->angle >= 0 && cone->angle < kPi / 2, "from 0 to below π/2 rad");
  } else if (const auto* box = std::get_if<BoxSource>(&s.source)) {
    if (!box->half_extent.allFinite() || (box->half_extent.array() < 0).any()) fail("half_extent must be 0 or more");
  } else if (const auto* line = std::get_if<LineSource>(&s.source)) {
    if (!line->to.allFinite()) fail("line must be finite");
  } else if (const auto* mesh = std::get_if<MeshSource>(&s.source)) {
    area_sums_ = check_mesh(*mesh);
  }
}

Birth Emitter::birth(double time, std::uint64_t number) const {
  const auto& s = settings_;
  const auto share = [&](std::uint64_t channel) { return random_.uniform(number, channel); };
  const Vec3 side = Random::any_normal(s.axis), other = s.axis.cross(side);
  Vec3 place = Vec3::Zero(), normal = s.axis;
  bool own_direction = s.along_normal;
  const double turn = 2 * kPi * share(1);
  const auto on_disc = [&](double inner, double outer) {
    const double r = std::sqrt(inner * inner + share(0) * (outer * outer - inner * inner));
    return std::pair(Vec3(std::cos(turn) * side + std::sin(turn) * other), r);
  };
  if (const auto* line = std::get_if<LineSource>(&s.source)) {
    place = share(0) * line->to;
  } else if (const auto* disc = std::get_if<DiscSource>(&s.source)) {
    const auto [out, r] = on_disc(disc->inner_radius, disc->radius);
    place = r * out;
  } else if (const auto* cone = std::get_if<ConeSource>(&s.source)) {
    const auto [out, r] = on_disc(0, cone->radius);
    place = r * out;
    const double tilt = cone->radius > 0 ? cone->angle * r / cone->radius : 0;
    normal = std::cos(tilt) * s.axis + std::sin(tilt) * out;
    own_direction = true;
  } else if (const auto* ball = std::get_if<SphereSource>(&s.source)) {
    const double low = std::pow(ball->inner_radius, 3), high = std::pow(ball->radius, 3);
    normal = random_.within(Vec3::UnitY(), kPi, number, 1);
    place = std::cbrt(low + share(0) * (high - low)) * normal;
  } else if (const auto* box = std::get_if<BoxSource>(&s.source)) {
    place = box->half_extent.cwiseProduct(Vec3(2 * share(0) - 1, 2 * share(1) - 1, 2 * share(2) - 1));
  } else if (const auto* source = std::get_if<MeshSource>(&s.source)) {
    const double wanted = share(0) * area_sums_.back();
    const std::size_t i =
        std::min(area_sums_.size() - 1,
                 std::size_t(std::upper_bound(area_sums_.begin(), area_sums_.end(), wanted) - area_sums_.begin()));
    const Triangle& t = source->mesh->triangles[i];
    const Vec3 a = vertex(*source->mesh, t[0]), u = vertex(*source->mesh, t[1]) - a,
               w = vertex(*source->mesh, t[2]) - a;
    double p = share(1), q = share(2);
    if (p + q > 1) p = 1 - p, q = 1 - q;
    place = a + p * u + q * w;
    normal = u.cross(w).normalized();
  }
  Vec3 direction = own_direction ? normal : s.axis;
  if (s.spread > 0) direction = random_.within(direction, s.spread, number, 3);

  Birth birth;
  birth.time = time;
  birth.position = s.position + place;
  birth.velocity = s.speed.at(share(5)) * direction;
  if (s.path) {
    const double clock = time;
    birth.position += s.path(clock);
    if (s.inherit != 0)
      birth.velocity += s.inherit / (2 * kPathStep) * (s.path(clock + kPathStep) - s.path(clock - kPathStep));
  }
  // Infinite ranges have no share of the way.
  birth.lifetime = std::isinf(s.lifetime.most) ? s.lifetime.most : s.lifetime.at(share(6));
  birth.mass = s.mass.at(share(7));
  birth.size = s.size.at(share(8));
  birth.kind = s.kind;
  birth.number = number;
  return birth;
}

void Emitter::births(double t0, double t1, std::vector<Birth>& out) const {
  const auto& s = settings_;
  t0 = std::max(t0, s.start), t1 = std::min(t1, s.stop);
  if (!(t1 > t0)) return;
  const std::size_t first = out.size();
  for (std::size_t b = 0; b < s.bursts.size(); ++b) {
    const Burst& burst = s.bursts[b];
    const double begin = s.start + burst.time;
    double repeat = burst.period > 0 ? std::max(0.0, std::ceil((t0 - begin) / burst.period - 1e-9)) : 0;
    for (;; ++repeat) {
      const double time = begin + repeat * burst.period;
      if (time >= t1) break;
      if (time >= t0)
        for (Index k = 0; k < burst.count; ++k)
          out.push_back(
              birth(time, kBurst + (std::uint64_t(b) << 54) + (std::uint64_t(repeat) << 24) + std::uint64_t(k)));
      if (burst.period == 0) break;
    }
  }
  const double low = s.rate.integral(t0 - s.start) - s.rate.integral(0);
  const double high = s.rate.integral(t1 - s.start) - s.rate.integral(0);
  for (double k = std::max(0.0, std::ceil(low - 0.5)); k + 0.5 < high; ++k) {
    const double time = s.start + s.rate.inverse_integral(s.rate.integral(0) + k + 0.5);
    out.push_back(birth(std::clamp(time, t0, t1), std::uint64_t(k)));
  }
  // Without memory of its own, as a stable sort would need.
  if (!s.bursts.empty())
    std::sort(out.begin() + std::ptrdiff_t(first), out.end(),
              [](const Birth& a, const Birth& b) { return a.time != b.time ? a.time < b.time : a.number < b.number; });
}

}  // namespace hooke::particles
