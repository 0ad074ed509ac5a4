// Filtered leapfrog: large and stiff grids of cloth at steps that do not shrink with their
// resolution. Derivation, limits and measurements: docs/large-sheets.md.
#pragma once

#include <hooke/point_body.hpp>
#include <hooke/softbody/spring_network.hpp>

#include <memory>
#include <optional>
#include <string>

namespace hooke::softbody {

/// Leapfrog whose inertia is M F⁻¹ instead of M, with F a fixed low-pass filter over the points of a
/// grid: v' = v + h F (f(x)/m + g), x' = x + h v', half a kick first and last of a tick. Order 2 as
/// h → 0 (with a sudden start 1.3 at the steps it is meant for), symplectic and time-reversible
/// without drag, dampers and contacts, stable at any h. 1 evaluation (the last is the next tick's
/// first). Where h is below 0.9 of velocity Verlet's limit F is 1 and the method is velocity Verlet. Too
/// large steps do not explode, they freeze: FilteredFacts tells. Only bodies of make_soft_body
/// whose springs form a grid can be moved by it. Cost: 0.8 ns a spring and step in float with AVX-512, 1.2 ns with
/// AVX2. Instruction sets with fused multiply-add agree in every bit, and so do those without. Source: selective mass
/// scaling, Olovsson, Simonsson, Unosson, Int. J. Numer. Meth. Engng 63 (2005) 1436.
const Method& filtered_leapfrog();

/// What filtered leapfrog chose, and what to expect of it.
struct FilteredFacts {
  double step = 0;             ///< h [s], of the last tick; before the first, the wanted one
  double wave_speed = 0;       ///< c [m/s], of stretching waves, in the faster direction
  double travel = 0;           ///< c h / L, the larger of both directions; above 0.8 the motion freezes
  double stiffness_scale = 1;  ///< of all springs; below 1 where a wanted error allowed to lower it
  double expected_error =
      0;  ///< [m] RMS after a free fall under its weight: 0.11 L (c h / L)^1.33, and the cap's, added as squares
  bool filtered = false;  ///< false: plain leapfrog, the step is small enough

  static constexpr double kFreeze = 0.8;  ///< travel from which a step is too large
  bool freezes() const { return travel > kFreeze; }
  /// One line for people.
  std::string text() const;
};

/// The facts of a body moved by filtered leapfrog; nothing for other bodies.
std::optional<FilteredFacts> filtered_facts(const Body& body);

/// The energy [J] that filtered leapfrog keeps where nothing damps and nothing touches: ½ vᵀ M F⁻¹ v + V.
/// @throws std::invalid_argument for bodies that are moved otherwise
double filtered_energy(const Body& body, const Vec3& gravity);

/// Makes such a body. Pins may be anywhere and masses may differ: whole rows and columns cost nothing,
/// single points a term each (at most 1024).
/// @param wanted_error [m]; > 0: the step is chosen and the stiffness is lowered to meet it at the least
///        cost; 0: the stiffness is kept, and the step is `settings.dt` or the one of an error of 1 % of
///        the sheet
/// @throws std::invalid_argument where the network is no grid, or both a step and a wanted error are given
template <class S>
std::unique_ptr<PointBody<S>> make_filtered_sheet(std::string name, PointMasses<S> points,
                                                  const MotionSettings& settings,
                                                  std::shared_ptr<const SpringNetwork> network, double wanted_error);

}  // namespace hooke::softbody
