// Lattices: solid boxes of points and springs, as jelly. The material is given per volume, so
// the same jelly weighs and yields the same at any resolution.
#pragma once

#include <hooke/softbody/spring_network.hpp>

#include <array>

namespace hooke::softbody {

struct LatticeMaterial {
  double density = 1000;  ///< [kg/m³], > 0. More: heavier, sags more
  /// Young's modulus: force per area and strain of a bar that is stretched [Pa], > 0. Jelly: 1e3 to
  /// 2e4. More: sags less, wobbles faster, costs steps as its square root.
  double young = 5000;
  /// Thinning of a stretched bar per lengthening, in [0.25, 0.5). Springs alone have 0.25; above it every
  /// cell resists changes of its volume, and comes back where a blow turned it inside out. More: bulges
  /// where it is pressed, costs steps.
  double poisson_ratio = 0.4;
  /// Share of critical damping of each spring; 1 stops a single spring fastest. The body's slow
  /// wobble is damped less, the more so the finer the lattice: as the spacing over its size.
  double damping_ratio = 0.2;
};

/// The classical cube of springs: the same constant on every spring, the same mass in every point.
/// What it weighs and how far it yields depends on the resolution.
struct FixedLatticeMaterial {
  double mass = 1;             ///< total [kg], > 0
  double stiffness = 2000;     ///< of every edge, face diagonal and body diagonal [N/m], >= 0
  double damping_ratio = 0.2;  ///< as LatticeMaterial
};

struct Lattice {
  Points<double> positions{0, 3};  ///< [m], (n, 3)
  Values<double> masses;           ///< [kg], (n)
  std::shared_ptr<const SpringNetwork> network;
  std::vector<Triangle> triangles;  ///< the closed surface
  std::array<int, 3> points{};      ///< along x, y and z
  double cell_stiffness = 0;        ///< [Pa], as CellVolumeField
};

/// A box of nx × ny × nz points over `size` around the local origin; x runs fastest: point index =
/// (z · ny + y) · nx + x, point 0 at the least x, y and z.
///
///        y
///        │          edges (Family::Stretch) and both diagonals of
///        o───o      every face of every cell, inner faces too
///       ╱│╲ ╱│      (Family::Shear)
///      o───o │
///      │╲│╱│ o── x
///      │╱ ╲│╱
///      o───o
///     ╱
///    z
///
/// Springs pull along their own direction only, so the moduli obey Cauchy's relation: an isotropic
/// lattice of springs has Poisson's ratio 1/4 and shear modulus μ = 2 E / 5. It is isotropic where, in
/// cells of sides d and volume V,
///   k = μ V (3/dx² - 1/dy² - 1/dz²)          for edges along x, and likewise along y and z,
///   k = μ V (dx² + dy²) / (2 dx² dy²)        for face diagonals in x and y, and likewise the others;
/// in cubes of side h both are 2 E h / 5. Springs and points on the border carry the share of the
/// cells that they belong to (on a face a half, on an edge a quarter, in a corner an eighth), which
/// makes a stretched bar yield E A / L at any resolution. Body diagonals are left out: isotropy
/// allows to trade them for the others, with the same stable step, and four springs of thirteen are
/// saved. Source: the moduli are Born and Huang's sums over springs, Σ k l² n n n n / 2V, set equal to
/// those of an isotropic body.
///
/// Above Poisson's ratio 1/4, μ = E / (2 (1 + ν)), and `cell_stiffness` is what is missing to the
/// bulk modulus, E / (3 (1 - 2ν)) - 5 μ / 3.
/// @param size [m], > 0; points >= 2 a side; cells must be nearly cubes, so that no k above is negative:
///        the third of two equal sides may be 0.71 to 1.22 times as long as they are
/// @param turn rotation of the box about its middle
/// @throws std::invalid_argument
Lattice lattice_from_box(const Vec3& size, const std::array<int, 3>& points, const LatticeMaterial& material,
                         const Mat3& turn = Mat3::Identity());

/// The same points with springs of one constant on edges, face diagonals and body diagonals (Family::Bend),
/// border or not. Cells may have any sides.
Lattice lattice_from_box(const Vec3& size, const std::array<int, 3>& points, const FixedLatticeMaterial& material,
                         const Mat3& turn = Mat3::Identity());

}  // namespace hooke::softbody
