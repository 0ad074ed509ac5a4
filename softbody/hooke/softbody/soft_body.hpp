// Soft bodies: point masses joined by springs, with what acts on their surface.
#pragma once

#include <hooke/point_body.hpp>
#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/filtered_leapfrog.hpp>
#include <hooke/softbody/lattice.hpp>
#include <hooke/softbody/wind.hpp>
#include <hooke/softbody/xpbd.hpp>

#include <optional>
#include <string_view>

namespace hooke::softbody {

/// In double-float, positions and velocities are held in two floats each: on undamped springs of a grid,
/// by splitting methods; for machines that are slow at double. The body's own numbers are double then; ticks with
/// contacts or driven pins are computed in double.
///
/// Automatic is float, or double for undamped springs so stiff that float's rounding would heat them: where the
/// gain expected in a minute is above a thousandth of the energy that a fall over the body's size exchanges. Every
/// substep rounds positions by δ, which costs ½ k δ² a spring: Σ k δ² / h in a second, of which a sixth was measured.
enum class Precision { Automatic, Float, Double, DoubleFloat };

/// The precision of that name: automatic, float, double, double-float.
/// @throws std::invalid_argument that lists them
Precision precision_named(std::string_view name);
std::string_view precision_name(Precision precision);

/// Everything a soft body is made from. Positions are relative to `origin`.
struct SoftBodySettings {
  std::string name = "soft body";
  Vec3 origin{0, 0, 0};                          ///< [m], in the world
  Points<double> positions{0, 3};                ///< [m], (n, 3)
  Points<double> velocities{0, 3};               ///< [m/s], (n, 3); empty: at rest
  Values<double> masses;                         ///< [kg], (n), > 0
  std::shared_ptr<const SpringNetwork> network;  ///< may be shared by many bodies; null: no springs
  std::vector<Triangle> triangles;               ///< for wind and drawing
  std::vector<Index> pins;                       ///< held from the start
  double volume_stiffness = 0;                   ///< of what the triangles enclose [Pa], as VolumeField; 0: none
  std::array<int, 3> cells{};                    ///< points of a lattice along x, y and z
  double cell_stiffness = 0;                     ///< of each of its cells [Pa], as CellVolumeField; 0: none
  std::optional<Wind> wind;                      ///< absent: no air at all
  double linear_drag = 0;                        ///< on every point [N·s/m]
  double quadratic_drag = 0;                     ///< on every point [N·s²/m²]
  MotionSettings motion;                         ///< method: those of method.hpp, filtered_leapfrog() or xpbd()
  double wanted_error = 0;                       ///< of filtered leapfrog [m]; may lower the stiffness; 0: none
  Precision precision = Precision::Automatic;
};

/// What Automatic stands for in a body of these settings; any other precision as it is.
Precision resolved_precision(const SoftBodySettings& settings);

/// Takes points, masses, springs and triangles from a cloth.
SoftBodySettings settings_of(const Cloth& cloth);
/// The same from a lattice, with the stiffness of its cells.
SoftBodySettings settings_of(const Lattice& lattice);

/// Builds the body. A soft body is a PointBody with a SpringField and, where asked for, volume, wind
/// and drag.
/// @throws std::invalid_argument naming the body, the rule and the value
std::unique_ptr<Body> make_soft_body(const SoftBodySettings& settings);

}  // namespace hooke::softbody
