#include <scene/figures.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>

namespace hooke::scene {

namespace {

constexpr double kSettlingInterval = 0.5;  // [s]

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

}  // namespace

double worst_stretch(const SceneBody& body) {
  double worst = 0;
  const Points<double> x = body.body->positions();
  for (const auto family : {softbody::Family::Stretch, softbody::Family::Raw})
    for (const double strain : softbody::strains(*body.network, body.rest, family, x, body.held))
      worst = std::max(worst, strain);
  return worst;
}

double worst_stretch(const Scene& scene) {
  double worst = 0;
  for (const SceneBody& body : scene.bodies) worst = std::max(worst, worst_stretch(body));
  return worst;
}

double worst_penetration(const Scene& scene) {
  double worst = 0;
  for (const Collider& collider : scene.world.colliders()) {
    std::vector<Shape> shapes = collider.shapes;
    if (collider.motion) collider.motion(scene.world.time(), shapes);
    for (const SceneBody& body : scene.bodies) {
      const Points<double> x = body.body->positions();
      for (Index i = 0; i < x.rows(); ++i)
        for (const Shape& shape : shapes)
          if (!body.held[std::size_t(i)])
            worst = std::max(worst, body.thickness - signed_distance(shape, Vec3(x.row(i).matrix().transpose())));
    }
  }
  return worst;
}

CapeFigures::CapeFigures(const Scene& scene, std::size_t body)
    : body_(body),
      name_(scene.bodies[body].body->name()),
      thickness_(scene.bodies[body].thickness),
      freeze_(scene.humans[std::size_t(scene.bodies[body].wears)].human.freeze_time()) {}

void CapeFigures::measure(const Scene& scene) {
  const SceneBody& cape = scene.bodies[body_];
  const human::Human& human = scene.humans[std::size_t(cape.wears)].human;
  const Points<double> x = cape.body->positions();
  const double t = scene.shown_time();
  std::vector<Capsule> capsules(std::size_t(human.capsule_count()));
  human.capsules(t, capsules);
  for (Index i = 0; i < x.rows(); ++i) {
    if (cape.held[std::size_t(i)]) continue;
    const Vec3 point = x.row(i).matrix().transpose();
    double nearest = 1e300;
    int touched = 0;
    for (const Capsule& capsule : capsules) {
      const double distance = signed_distance(capsule, point);
      nearest = std::min(nearest, distance);
      touched += distance < thickness_;
    }
    if (touched >= 2) continue;
    if (thickness_ - nearest > depth_) depth_ = thickness_ - nearest, depth_time_ = t;
    if (-nearest > bare_depth_) bare_depth_ = -nearest, bare_depth_time_ = t;
  }
  Points<double> targets(Index(cape.driven.size()), 3);
  cape.targets(scene.world.time(), targets);
  for (Index i = 0; i < targets.rows(); ++i)
    pin_error_ = std::max(pin_error_, (x.row(cape.driven[std::size_t(i)]) - targets.row(i)).matrix().norm());
  if (t <= freeze_ + 1e-9) return;
  const Points<double> v = cape.body->velocities();
  for (Index i = 0; i < v.rows(); ++i)
    if (!cape.held[std::size_t(i)]) speed_squared_ += v.row(i).matrix().squaredNorm(), ++speeds_;
  if (t >= freeze_ + kSettlingInterval * double(settling_.size() + 1) - 1e-9) {
    settling_.emplace_back(t, speeds_ ? std::sqrt(speed_squared_ / double(speeds_)) : 0);
    speed_squared_ = 0, speeds_ = 0;
  }
}

void CapeFigures::measure_frame(const Scene& scene) {
  measure(scene);
  const SceneBody& cape = scene.bodies[body_];
  for (const double strain :
       softbody::strains(*cape.network, cape.rest, softbody::Family::Stretch, cape.body->positions(), cape.held)) {
    strains_.push_back(float(strain));
    if (float(strain) > worst_) worst_ = float(strain), worst_time_ = scene.shown_time();
  }
}

double CapeFigures::worst_stretch() const { return worst_; }

double CapeFigures::stretch_percentile(double share) const {
  if (strains_.empty()) return 0;
  const auto at = strains_.begin() + std::ptrdiff_t(share * double(strains_.size() - 1));
  std::nth_element(strains_.begin(), at, strains_.end());
  return *at;
}

std::string CapeFigures::text() const {
  const auto depth = [](const char* what, double value, double time) {
    return value > 0 ? format("  deepest free point inside %s: %.2f mm at %.3f s\n", what, 1e3 * value, time)
                     : format("  no free point was ever inside %s\n", what);
  };
  std::string out = "cape \"" + name_ + "\" over the shown time:\n";
  out += depth("the thickened capsules", depth_, depth_time_);
  out += depth("the bare capsules", bare_depth_, bare_depth_time_);
  out += format("  structural stretch: 99.9 %% of springs and frames below %.2f %%, worst %.2f %% at %.3f s\n",
                100 * stretch_percentile(0.999), 100 * worst_stretch(), worst_time_);
  out += format("  greatest pin error: %.3g mm\n", 1e3 * pin_error_);
  for (const auto& [time, speed] : settling_)
    out += format("  RMS speed in the half second to %.1f s after the last step: %.4f m/s\n", time - freeze_, speed);
  return out;
}

void CapeFigures::save(CheckpointWriter& out) const {
  for (const double value :
       {depth_, bare_depth_, pin_error_, depth_time_, bare_depth_time_, worst_time_, speed_squared_})
    out.add(value);
  out.add(worst_);
  out.add(std::int64_t(speeds_));
  out.add(std::uint64_t(strains_.size()));
  out.add(strains_);
  out.add(std::uint64_t(settling_.size()));
  for (const auto& [time, speed] : settling_) {
    out.add(time);
    out.add(speed);
  }
}

void CapeFigures::load(CheckpointReader& in) {
  for (double* value :
       {&depth_, &bare_depth_, &pin_error_, &depth_time_, &bare_depth_time_, &worst_time_, &speed_squared_})
    *value = in.number<double>("figure");
  worst_ = in.number<float>("worst strain");
  speeds_ = Index(in.number<std::int64_t>("number of speeds", 0));
  constexpr Index kMany = std::numeric_limits<Index>::max();
  strains_.resize(std::size_t(in.count("number of strains", kMany, sizeof(float))));
  in.fill("strains", std::span(strains_));
  settling_.resize(std::size_t(in.count("number of half seconds", kMany, 16)));
  for (auto& [time, speed] : settling_) {
    time = in.number<double>("time");
    speed = in.number<double>("speed");
  }
}

}  // namespace hooke::scene
