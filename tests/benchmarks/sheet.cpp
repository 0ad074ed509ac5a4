#include "sheet.hpp"

#include <scene/scene.hpp>
#include <scene/standard.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace hooke::bench {

using softbody::Spring;
using softbody::SpringNetwork;

namespace {

// Where every point goes.
std::vector<int> places(Index n) {
  std::vector<int> out(static_cast<std::size_t>(n));
  std::iota(out.begin(), out.end(), 0);
  std::shuffle(out.begin(), out.end(), std::mt19937(3));
  return out;
}

}  // namespace

Points<double> shuffle(const Points<double>& x) {
  const std::vector<int> place = places(x.rows());
  Points<double> out(x.rows(), 3);
  for (Index i = 0; i < x.rows(); ++i) out.row(place[std::size_t(i)]) = x.row(i);
  return out;
}

SoftBodySettings hanging_sheet(int n, Form form) {
  scene::SceneDescription description = scene::hanging_sheet(n);
  description.bodies[0].solver.precision = Precision::Double;
  const scene::Scene scene = scene::build(description);
  const scene::SceneBody& sheet = scene.bodies[0];
  SoftBodySettings out;
  out.name = sheet.body->name();
  out.positions = sheet.body->positions();
  out.masses = sheet.body->masses();
  out.network = sheet.network;
  out.triangles = sheet.triangles;
  for (std::size_t i = 0; i < sheet.held.size(); ++i)
    if (sheet.held[i]) out.pins.push_back(Index(i));
  if (form == Form::Grid) return out;

  const std::vector<int> place = places(out.positions.rows());
  const auto at = [&](auto i) { return place[std::size_t(i)]; };
  SpringNetwork network = *out.network;
  for (Spring& spring : network.springs) spring.a = at(spring.a), spring.b = at(spring.b);
  if (form == Form::Mesh) network.springs.push_back({at(0), at(std::size_t(out.positions.rows() - 1)), 0});
  std::shuffle(network.springs.begin(), network.springs.end(), std::mt19937(4));
  out.network = std::make_shared<const SpringNetwork>(std::move(network));
  out.positions = shuffle(out.positions);
  const Values<double> m = out.masses;
  for (Index i = 0; i < m.size(); ++i) out.masses[at(i)] = m[i];
  for (Index& pin : out.pins) pin = at(pin);
  for (Triangle& triangle : out.triangles)
    for (auto& corner : triangle) corner = at(corner);
  return out;
}

PlainSheet plain(const SoftBodySettings& settings) {
  PlainSheet out;
  for (Index i = 0; i < settings.positions.rows(); ++i) {
    for (int k = 0; k < 3; ++k) out.positions.push_back(settings.positions(i, k));
    out.inverse_masses.push_back(1 / settings.masses[i]);
  }
  for (const Index pin : settings.pins) out.inverse_masses[std::size_t(pin)] = 0;
  const std::vector<double> rest = softbody::rest_lengths(*settings.network, settings.positions);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const Spring& s = settings.network->springs[i];
    out.springs.push_back({s.a, s.b, s.stiffness, rest[i]});
  }
  return out;
}

double yardstick_step(int n) { return n == 32 ? 1.0 / 1440 : n == 64 ? 1.0 / 2880 : 1.0 / (45.0 * n); }

World world_of(const SoftBodySettings& settings, double tick_rate) {
  World world(tick_rate);
  world.add(softbody::make_soft_body(settings));
  return world;
}

double rms(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().sum() / double(a.rows()));
}

double rms(const std::vector<double>& a, const Points<double>& b) {
  double sum = 0;
  for (Index i = 0; i < b.rows(); ++i)
    for (int k = 0; k < 3; ++k) sum += std::pow(a[std::size_t(3 * i + k)] - b(i, k), 2);
  return std::sqrt(sum / double(b.rows()));
}

SoftBodySettings softened(const SoftBodySettings& settings, double factor) {
  SoftBodySettings out = settings;
  SpringNetwork network = *settings.network;
  for (Spring& spring : network.springs) spring.stiffness *= factor;
  out.network = std::make_shared<const SpringNetwork>(std::move(network));
  return out;
}

}  // namespace hooke::bench
