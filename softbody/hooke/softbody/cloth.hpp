// Cloth: points, masses, springs and triangles from a rectangle or any triangle mesh. The
// material is given per area and per width, so the same cloth behaves the same at any
// resolution.
#pragma once

#include <hooke/softbody/spring_network.hpp>

namespace hooke::softbody {

/// Share of critical damping of each spring family; 1 stops a single spring fastest.
struct DampingRatios {
  double stretch = 0.05, shear = 0.05, bend = 0.2;
};

struct ClothMaterial {
  double density = 0.25;  ///< [kg/m²], > 0. More: heavier, swings longer in wind
  /// Tensile stiffness: force per width and strain along the threads [N/m]. More: stretches less,
  /// costs steps as its square root.
  double stretch = 1000;
  /// Shear stiffness: force per width and shear angle [N/m]. More: wrinkles like paper.
  double shear = 100;
  /// Tensile stiffness of springs that skip a point [N/m]; they resist folding, not the first bend.
  /// More: wider, rounder folds.
  double bend = 5;
  DampingRatios damping_ratio;
};

struct Cloth {
  Points<double> positions{0, 3};  ///< [m], (n, 3)
  Values<double> masses;           ///< [kg], (n)
  std::shared_ptr<const SpringNetwork> network;
  std::vector<Triangle> triangles;
};

/// A rectangle of `columns` × `rows` points; point index = row · columns + column, row 0 at the
/// edge through the middle of which the local origin lies, rows follow `down`:
///
///   (0,0) ──right──> (0,c)     x = (column / (columns - 1) - ½) width · right
///     │                          + row / (rows - 1) height · down
///    down
///     v
///
/// Border springs and points carry half of what inner ones do. For a strip of material,
/// tension = stretch · width · strain at any resolution (shear springs add to it).
/// @param width, height [m], > 0; columns, rows >= 2; right and down: not parallel, normalised here
/// @throws std::invalid_argument
Cloth cloth_from_grid(double width, double height, int columns, int rows, const Vec3& right, const Vec3& down,
                      const ClothMaterial& material);

/// Cloth from a triangle mesh; vertices keep their order. Edges are springs of stiffness
/// (material · area of the edge's triangles / edge length²) (Van Gelder 1998). Where both
/// triangles of an edge have it as their longest, it is the diagonal of a quadrilateral: the
/// edge and the other diagonal are shear springs. Over every other inner edge the two opposite
/// corners are joined by a bend spring.
/// @throws std::invalid_argument for triangles that index no vertex or have no area, for edges
///         of more than two triangles, and for vertices in no triangle
Cloth cloth_from_mesh(const TriangleMesh& mesh, const ClothMaterial& material);

}  // namespace hooke::softbody
