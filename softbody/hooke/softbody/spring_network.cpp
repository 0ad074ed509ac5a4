#include <hooke/softbody/spring_network.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

namespace hooke::softbody {

namespace {

double length(const Points<double>& x, const Spring& spring) {
  return (x.row(spring.b) - x.row(spring.a)).matrix().norm();
}

}  // namespace

void SpringNetwork::check(Index point_count) const {
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const Spring& s = springs[i];
    const auto fail = [&](const std::string& rule) {
      throw std::invalid_argument("spring " + std::to_string(i) + ": " + rule);
    };
    for (const int point : {s.a, s.b})
      if (point < 0 || point >= point_count)
        fail("points must be in [0, " + std::to_string(point_count) + "), got " + std::to_string(point));
    if (s.a == s.b) fail("joins point " + std::to_string(s.a) + " to itself");
    if (!(s.stiffness >= 0) || !std::isfinite(s.stiffness))
      fail("stiffness must not be negative, got " + std::to_string(s.stiffness) + " N/m");
    if (!(s.damping >= 0) || !std::isfinite(s.damping))
      fail("damping must not be negative, got " + std::to_string(s.damping) + " N s/m");
    if (s.rest_length != Spring::kFromStart && (!(s.rest_length >= 0) || !std::isfinite(s.rest_length)))
      fail("rest_length must not be negative, got " + std::to_string(s.rest_length) + " m");
  }
}

double damping_of_ratio(double ratio, double stiffness, double mass_a, double mass_b) {
  return 2 * ratio * std::sqrt(stiffness * mass_a * mass_b / (mass_a + mass_b));
}

std::vector<double> rest_lengths(const SpringNetwork& network, const Points<double>& start) {
  std::vector<double> rest;
  rest.reserve(network.springs.size());
  for (const Spring& spring : network.springs)
    rest.push_back(spring.rest_length == Spring::kFromStart ? length(start, spring) : spring.rest_length);
  return rest;
}

std::vector<double> strains(const SpringNetwork& network, const std::vector<double>& rest, Family family,
                            const Points<double>& positions, const std::vector<bool>& held) {
  std::vector<double> out;
  for (std::size_t i = 0; i < network.springs.size(); ++i) {
    const Spring& s = network.springs[i];
    if (s.family != family || rest[i] <= 0 || (held[std::size_t(s.a)] && held[std::size_t(s.b)])) continue;
    out.push_back(length(positions, s) / rest[i] - 1);
  }
  return out;
}

}  // namespace hooke::softbody
