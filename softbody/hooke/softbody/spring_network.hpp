// Which points are joined by which springs. Topology and parameters only: constant once
// made and shared by any number of bodies.
#pragma once

#include <hooke/types.hpp>

#include <memory>
#include <vector>

namespace hooke::softbody {

/// What a spring is for; diagnostics tell them apart.
enum class Family { Raw, Stretch, Shear, Bend };

/// A linear spring with an optional damper along it:
/// F = [k (|d| - L) + c ḋ·n] n, with d from point a to point b and n = d / |d|.
struct Spring {
  static constexpr double kFromStart = -1;

  int a = 0, b = 0;                 ///< points, different
  double stiffness = 0;             ///< k [N/m], >= 0
  double damping = 0;               ///< c [N·s/m], >= 0
  double rest_length = kFromStart;  ///< L [m], >= 0, or the distance at the start
  Family family = Family::Raw;
};

struct SpringNetwork {
  std::vector<Spring> springs;

  /// @throws std::invalid_argument naming the spring, the rule and the value, for points outside
  ///         [0, point_count) or joined to themselves, and negative or infinite parameters
  void check(Index point_count) const;
};

/// The damping [N·s/m] of a spring of stiffness k [N/m] between masses m_a and m_b [kg] that is
/// `ratio` of critical: 2 ratio √(k μ), μ = m_a m_b / (m_a + m_b).
double damping_of_ratio(double ratio, double stiffness, double mass_a, double mass_b);

/// Rest lengths [m], with kFromStart resolved at these positions (n, 3).
std::vector<double> rest_lengths(const SpringNetwork& network, const Points<double>& start);

/// |d| / L - 1 of every spring of that family whose ends are not both held; springs without
/// length are left out. Unsorted.
std::vector<double> strains(const SpringNetwork& network, const std::vector<double>& rest, Family family,
                            const Points<double>& positions, const std::vector<bool>& held);

}  // namespace hooke::softbody
