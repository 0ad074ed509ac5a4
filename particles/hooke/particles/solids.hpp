// Particles against the world's colliders. Half-spaces are the business of flight.hpp; everything else is here.
// Internal to hooke::particles and not installed.
#pragma once

#include <hooke/collider.hpp>
#include <hooke/particles/flight.hpp>

#include <mutex>

namespace hooke::particles {

/// What happens at a contact.
struct ContactRule {
  double radius = 0;       ///< distance kept from surfaces [m]
  double restitution = 0;  ///< the larger of this and the collider's counts
  double rest_speed = 0;   ///< approach speed below which nothing bounces [m/s]
  double step = 0;         ///< the method's step, whatever its legs [s]
};

/// The colliders of one tick, placed at the ends of its legs.
template <class S>
class Solids {
 public:
  /// @param ends the times at which legs end, the first of them the tick's start: legs + 1 numbers
  void place(std::span<const Collider> colliders, const Vec3& origin, const Vec3& gravity, const ContactRule& rule,
             std::span<const double> ends);

  bool any() const { return plane_count_ > 0 || !bodies_.empty() || !callbacks_.empty(); }
  Index plane_count() const { return plane_count_; }
  const Plane<S>* planes(int leg) const { return planes_.data() + leg * plane_count_; }
  /// Solids other than half-spaces, that a particle may pass through in a leg.
  bool bodies() const { return !bodies_.empty(); }
  bool callbacks() const { return !callbacks_.empty(); }

  /// Marks (a number that is not positive) the particles that may meet a body on the way from x - drift v (or `from`)
  /// to x. Returns whether there is one.
  bool mark(const Tile<S>& tile, int leg, S drift, const S* const* from, S* marks) const;

  /// Takes marked particles along their way again, this time with everything that is in it, half-spaces included.
  void resolve(const Tile<S>& tile, int leg, S drift, const S* const* from, const S* marks,
               std::vector<Hit<S>>* hits) const;

  /// The way is x0 + v0 s + ½ a s², a from the velocities before (v0) and after: impact times are solved on it, as
  /// many as there are.
  void resolve_exactly(const Tile<S>& tile, int leg, double h, const S* const x0[3], const S* const v0[3],
                       std::vector<Hit<S>>* hits) const;

  /// Marked particles that press slowly into a body stop doing so.
  void settle(const Tile<S>& tile, int leg, const S* marks) const;

  /// Colliders of somebody else's engine, at the end of a leg.
  void call_back(const Tile<S>& tile, int leg, std::vector<Hit<S>>* hits) const;

  /// Marks particles that are beyond a plane at the end of a leg, for ways that flight did not take.
  bool mark_planes(const Tile<S>& tile, int leg, S* marks) const;

 private:
  // A solid in the frame of a leg's start; it moves by `move` within the leg.
  struct Pose {
    Shape shape;
    Vec3 move{0, 0, 0};
    Vec3 skew{0, 0, 0};  // a capsule's: by how much more b moves than a
    Vec3 move_at(const Vec3& place) const;
    Vec3 lower, upper;  // swept, with the radius [m]
  };
  struct Body {
    const Collider* collider;
    double bounce, friction;
    bool moves;
    std::size_t pose;  // first of its poses; one a leg where it moves
  };
  struct Meeting {
    double when = 2;  // share of the way
    Vec3 normal{0, 0, 0}, wall{0, 0, 0};
    double bounce = 0, friction = 0, depth = 0;
  };

  const Pose& pose(const Body& body, int leg) const { return poses_[body.pose + (body.moves ? std::size_t(leg) : 0)]; }
  double slow(const Vec3& normal) const;
  void meet(const Pose& pose, const Body& body, const Vec3& p, const Vec3& way, double done, double left, double drift,
            bool pushed, Meeting& first) const;
  Vec3 answer(const Meeting& at, const Vec3& v, Index i, int leg, const Vec3& place, std::vector<Hit<S>>* hits) const;

  std::vector<Plane<S>> planes_;
  Index plane_count_ = 0;
  std::vector<Body> bodies_;
  std::vector<Pose> poses_;
  std::vector<const Collider*> callbacks_;
  std::vector<Shape> now_, next_;
  Vec3 origin_{0, 0, 0}, gravity_{0, 0, 0};
  ContactRule rule_;
  std::vector<double> ends_;
  mutable std::mutex callback_mutex_;
};

}  // namespace hooke::particles
