// Forces on particles: modules of a system, chosen at run time. Gravity is not here: it is the world's.
#pragma once

#include <hooke/particles/random.hpp>
#include <hooke/particles/tile.hpp>
#include <hooke/velocity_grid.hpp>

#include <functional>
#include <memory>
#include <vector>

namespace hooke::particles {

/// An acceleration of every particle. One virtual call a tile and stage; what is the same for all particles costs
/// nothing on top of gravity.
template <class S>
class Force {
 public:
  virtual ~Force() = default;

  /// A part that is the same for all: acceleration - rate v. It is integrated exactly, at any rate × step.
  struct Uniform {
    Vec3 acceleration{0, 0, 0};  ///< [m/s²]
    double rate = 0;             ///< [1/s], >= 0
  };
  /// @param inverse_mass [1/kg] of every particle; NaN where they differ
  virtual Uniform uniform(double t, double inverse_mass) const;

  /// True where add_acceleration adds anything.
  virtual bool varies(bool same_mass) const = 0;
  /// True where what add_acceleration adds depends on velocity.
  virtual bool uses_velocity() const { return false; }

  /// Called once a tick before any tile: `all` is the whole system as one tile.
  virtual void prepare(const Tile<S>& all, double t);

  /// a += acceleration [m/s²] of a tile's particles at t. Must do the same to a particle in any tile.
  /// @param first the tile's first particle in `all`, or -1 for one born since  @param origin world = origin + x
  virtual void add_acceleration(const Tile<S>& tile, Index first, const Vec3& origin, double t, S* const a[3]) const;
};

/// F = -c (v - wind), c in N·s/m. Exact at any step where all particles weigh the same; where masses differ it is
/// evaluated like any other force and needs steps below 2 m / c.
template <class S>
class LinearDrag final : public Force<S> {
 public:
  /// @param coefficient [N·s/m], >= 0  @param wind velocity of the air [m/s]
  explicit LinearDrag(double coefficient, const Vec3& wind = Vec3::Zero());
  typename Force<S>::Uniform uniform(double t, double inverse_mass) const override;
  bool varies(bool same_mass) const override { return !same_mass; }
  bool uses_velocity() const override { return true; }
  void add_acceleration(const Tile<S>& tile, Index first, const Vec3& origin, double t, S* const a[3]) const override;

 private:
  double coefficient_;
  Vec3 wind_;
};

/// F = -k |v - wind| (v - wind), k in N·s²/m² (k = ½ ρ C A).
template <class S>
class QuadraticDrag final : public Force<S> {
 public:
  /// @param coefficient [N·s²/m²], >= 0  @param wind velocity of the air [m/s]
  explicit QuadraticDrag(double coefficient, const Vec3& wind = Vec3::Zero());
  bool varies(bool) const override { return true; }
  bool uses_velocity() const override { return true; }
  void add_acceleration(const Tile<S>& tile, Index first, const Vec3& origin, double t, S* const a[3]) const override;

 private:
  double coefficient_;
  Vec3 wind_;
};

/// a = strength d / (|d|² + radius²)^{3/2} towards a point: Plummer's softened gravity. A negative strength repels.
template <class S>
class Attractor final : public Force<S> {
 public:
  /// @param strength [m³/s²]  @param radius softening length [m], > 0
  Attractor(const Vec3& place, double strength, double radius);
  bool varies(bool) const override { return true; }
  void add_acceleration(const Tile<S>& tile, Index first, const Vec3& origin, double t, S* const a[3]) const override;

 private:
  Vec3 place_;
  double strength_, radius_;
};

/// The velocity of a medium, a function of place and time.
template <class S>
class Flow {
 public:
  virtual ~Flow() = default;
  /// u += velocity [m/s] at the tile's places.
  virtual void add_velocity(const Tile<S>& tile, const Vec3& origin, double t, S* const u[3]) const = 0;
};

/// Takes particles along with a flow: a = rate (u(x, t) - v).
template <class S>
class FlowDrag final : public Force<S> {
 public:
  /// @param rate [1/s], >= 0: 1/rate is the time a particle needs to follow
  FlowDrag(std::unique_ptr<const Flow<S>> flow, double rate);
  typename Force<S>::Uniform uniform(double t, double inverse_mass) const override;
  bool varies(bool) const override { return true; }
  void add_acceleration(const Tile<S>& tile, Index first, const Vec3& origin, double t, S* const a[3]) const override;

 private:
  std::unique_ptr<const Flow<S>> flow_;
  double rate_;
};

/// Divergence-free turbulence: the curl of a vector noise, two octaves. RMS speed about `speed`.
/// Cost: about 100 operations a particle and octave. Source: Bridson, Hourihan, Nordenstam, SIGGRAPH 2007.
template <class S>
class CurlNoise final : public Flow<S> {
 public:
  struct Settings {
    double speed = 1;     ///< [m/s], >= 0
    double size = 0.5;    ///< of the largest eddies [m], > 0
    double turnover = 1;  ///< time in which the pattern moves on by its size [s], > 0
    std::uint32_t seed = 0;
  };
  explicit CurlNoise(const Settings& settings);
  void add_velocity(const Tile<S>& tile, const Vec3& origin, double t, S* const u[3]) const override;

 private:
  Settings settings_;
};

/// A straight vortex: u = circulation r / (2π (r² + core²)) around its axis.
template <class S>
class Vortex final : public Flow<S> {
 public:
  /// @param circulation [m²/s]  @param core radius [m], > 0  @param updraught along the axis at its centre [m/s], falls
  ///        off as core²/(r² + core²)
  Vortex(const Vec3& place, const Vec3& axis, double circulation, double core, double updraught = 0);
  void add_velocity(const Tile<S>& tile, const Vec3& origin, double t, S* const u[3]) const override;

 private:
  Vec3 place_, axis_;
  double circulation_, core_, updraught_;
};

/// A sampled velocity, trilinear, 0 outside of its grid: what hooke::vdb reads from a volume file.
template <class S>
class GridFlow final : public Flow<S> {
 public:
  /// @param offset where the grid's zero is in the world [m]  @param scale times the samples
  explicit GridFlow(std::shared_ptr<const VelocityGrid> grid, const Vec3& offset = Vec3::Zero(), double scale = 1);
  void add_velocity(const Tile<S>& tile, const Vec3& origin, double t, S* const u[3]) const override;

 private:
  std::shared_ptr<const VelocityGrid> grid_;
  Vec3 offset_;
  double scale_;
};

/// Pushes particles apart that are closer than `distance`: a = stiffness (distance - |d|) d/|d|, equal and opposite for
/// equal masses, held over a tick. Cost: one search grid a tick, and neighbours.
template <class S>
class Repulsion final : public Force<S> {
 public:
  /// @param stiffness [1/s²], >= 0; stable where stiffness × neighbours × tick² < 1  @param distance [m], > 0
  Repulsion(double stiffness, double distance);
  bool varies(bool) const override { return true; }
  void prepare(const Tile<S>& all, double t) override;
  void add_acceleration(const Tile<S>& tile, Index first, const Vec3& origin, double t, S* const a[3]) const override;

 private:
  std::uint32_t cell_of(const S place[3], const int step[3]) const;
  double stiffness_, distance_;
  std::uint32_t mask_ = 0;
  std::vector<std::uint32_t> cell_, start_;  // by particle; by cell, where its particles begin in sorted_
  std::vector<Index> sorted_;
  Points<S> places_, acceleration_;
};

}  // namespace hooke::particles
