// One-way contact of a body's points with prescribed colliders, inside the substeps.
#pragma once

#include <hooke/collider.hpp>
#include <hooke/point_masses.hpp>

namespace hooke {

/// A plane that one point may not cross within a substep: normal · Δx >= normal · carried - gap, with Δx from
/// where it began.
template <class S>
struct ContactPlane {
  Index point;
  Eigen::Matrix<S, 3, 1> normal;   ///< unit, out of the solid
  S gap;                           ///< [m], how far it may come nearer; negative: how far it must leave
  Eigen::Matrix<S, 3, 1> carried;  ///< [m], the way on which the solid takes its start along
  S friction, restitution;
};

/// Removes the approach from a velocity relative to a surface, and of the sliding what Coulomb's friction takes.
/// @param normal unit, out of the solid  @returns the approach, 0 where there was none
template <class S>
S rub(const Eigen::Matrix<S, 3, 1>& normal, S friction, Eigen::Matrix<S, 3, 1>& relative) {
  const S approach = -relative.dot(normal);
  if (!(approach > 0)) return S(0);
  relative += approach * normal;
  const S sliding = relative.norm();
  if (sliding > 0) relative *= std::max(S(0), 1 - friction * approach / sliding);
  return approach;
}

/// Keeps points at least `thickness` outside of the colliders' surfaces.
///
/// Candidates (point, shape) are found once a tick from swept bounds, and again in the
/// rare tick in which a point outruns its bound. Within a substep the shape carries the
/// point's start along, so a fast limb meets a slow cloth as a slow limb would; what passed
/// through a shape within the substep is brought back to where it went in. The point is put
/// on the surface, its normal velocity is removed (or reflected), and Coulomb friction acts
/// on position and velocity alike, so that what sticks does not creep. A start inside is
/// pushed out at a bounded speed. What enters a box leaves by the face it came through, however
/// thin the box is; a level set stops what is thicker than a voxel. Boxes may move and turn, level
/// sets move. Cost: one distance a candidate and substep.
template <class S>
class Contacts {
 public:
  /// Finds candidates for the tick from t0 to t1. `colliders` must stay where it is until the next call.
  void begin_tick(std::span<const Collider> colliders, const PointMasses<S>& points, double t0, double t1,
                  double thickness);

  /// True where anything may touch in this tick.
  bool any() const { return !candidates_.empty() || !callbacks_.empty(); }

  /// Resolves contacts after a move from `from` at t0 to x at t1.
  void resolve(double t0, const Points<S>& from, double t1, const Values<S>& inverse_mass, Points<S>& x, Points<S>& v);

  /// Takes from v what presses into the surfaces touched by the last `resolve`, and rubs: for
  /// methods that end with a kick, which knows nothing of contacts.
  void settle(Points<S>& v) const;

  /// For methods that solve for contacts together with forces: appends, by solid and point, the planes that free
  /// points at x must not cross between t0 and t1, as far as they are within `reach` [m] of them at t1. Curved solids
  /// are planes at the point nearest to where they carry the start; what starts inside must leave at no more than the
  /// push speed. Only what its speed lets a point meet in the tick is looked at
  /// (and what is within 5 mm); `resolve` afterwards finds what went farther. Between begin_tick and the tick's end.
  void planes(double t0, const Points<S>& x, double t1, S reach, const Values<S>& inverse_mass,
              std::vector<ContactPlane<S>>& out);
  /// True where the last `resolve` pushed out a point that had started well inside a solid: that costs the
  /// solid energy.
  bool pushes_out() const { return pushes_out_; }

  /// Speed at which points that start inside a solid are pushed out [m/s].
  static constexpr double kPushSpeed = 2;

 private:
  using Vec = Eigen::Matrix<S, 3, 1>;
  using Mat = Eigen::Matrix<S, 3, 3>;
  enum class Kind { HalfSpace, Sphere, Capsule, Box, LevelSet };
  // A shape relative to the body's origin. HalfSpace: a = normal; a sphere is a capsule with a == b.
  // Box: a = centre, b = half extent. LevelSet: a = where the grid's zero is.
  struct Solid {
    Kind kind = Kind::Sphere;
    Vec a{0, 0, 0}, b{0, 0, 0};
    S radius = 0;  // or the half-space's offset; of boxes and level sets the thickness alone
    S friction = 0, restitution = 0;
    Mat axes = Mat::Identity();          // of a box: its own axes as columns
    const DistanceGrid* grid = nullptr;  // of a level set
  };
  struct Surface {
    S gap;  // distance to the thickened surface
    Vec normal;
  };
  struct Candidate {
    int point, solid;
  };
  struct Touch {
    Index point;
    Vec normal, solid_velocity;
    S friction;
  };

  void find_candidates(const Points<S>& x, const Points<S>& v, double seconds);
  void find_box_gaps(const Solid& solid, const Points<S>& x, Index first, Index n);
  void find_grid_gaps(const Solid& solid, const Points<S>& x, Index first, Index n, S near);
  void place_solids(double t, std::vector<Solid>& out);
  void place_both(double t0, double t1);
  void ask(const Collider& callback, double t, const Points<S>& x);
  static S moved(const Solid& before, const Solid& after);
  static void bounds(const Solid& solid, Vec& low, Vec& high);
  static S clearance(const Solid& solid, const Vec& x, S near);
  static S nearest_is_right(const Solid& solid);
  static S skin(const Solid& solid);
  Surface surface(const Solid& solid, const Vec& x) const;
  S gap(const Solid& solid, const Vec& x) const;
  Vec normal(const Solid& solid, const Vec& x) const;
  static Vec carried(const Solid& before, const Solid& after, const Vec& x);
  bool entry(const Solid& solid, const Vec& from, const Vec& to, Vec& hit) const;
  S box_entry(const Solid& solid, const Vec& from, const Vec& way) const;
  S grid_entry(const Solid& solid, const Vec& from, const Vec& way) const;
  void touch(Index point, const Solid& before, const Solid& after, const Vec& from, S move, S h, Vec& x, Vec& v);

  std::span<const Collider> colliders_;
  Vec3 origin_{0, 0, 0};
  S thickness_ = 0;
  double tick_end_ = 0, before_ = 0, now_ = 0;  // previous_ and solids_ belong to before_ and now_
  std::vector<Shape> shapes_;
  std::vector<Solid> solids_, previous_;
  std::vector<S> solid_move_;
  std::vector<Candidate> candidates_;
  Points<S> average_velocity_;
  std::vector<Touch> touches_;  // of the last resolve
  bool pushes_out_ = false;
  std::vector<const Collider*> callbacks_;
  Points<S> start_, lower_, upper_;
  Values<S> reach_, farthest_;
  static constexpr Index kRun = 64;  // points that are looked at together
  Eigen::Array<S, Eigen::Dynamic, 1, 0, kRun, 1> gap_, along_;
  Points<double> world_, normal_;
  Values<double> distance_;
};

extern template class Contacts<float>;
extern template class Contacts<double>;

}  // namespace hooke
