// Rigid bodies with linear motion only: a shape that never turns, carried by a point mass.
// They are moved by the same integrator core as everything else; here are their impacts.
#pragma once

#include <hooke/point_body.hpp>

namespace hooke {

/// The shape of a linear rigid body around its centre.
struct BallShape {
  double radius = 1;  ///< [m], > 0
};
struct BoxShape {
  Vec3 half_extent{0.5, 0.5, 0.5};  ///< [m], > 0, along the axes for ever
};

struct LinearBody {
  std::variant<BallShape, BoxShape> shape = BallShape{};
  double mass = 1;           ///< [kg], > 0
  Vec3 position{0, 0, 0};    ///< [m], of the centre
  Vec3 velocity{0, 0, 0};    ///< [m/s]
  double restitution = 0.5;  ///< 0 = stays, 1 = bounces without loss; the larger of two counts
  bool collidable = true;    ///< others meet it
  bool reacts = true;        ///< false: inverse mass 0, nothing moves it
};

/// One impact of the last tick.
struct Impact {
  double time = 0;  ///< [s]
  Index body = 0;
  Index other = -1;       ///< another body, or -1: a collider
  Vec3 impulse{0, 0, 0};  ///< on `body` [kg m/s]; the other gets the opposite
  double approach = 0;    ///< speed at which they met [m/s], >= 0
};

/// A set of linear rigid bodies that meet each other and the world's static half-spaces.
///
/// Impact times are solved within the substep, as many as there are, on the parabola that
/// the method's step defines (exact where the acceleration is constant). Impulses are
/// equal and opposite; an immovable body takes its impulse without moving. A body that
/// would leave a half-space slower than `rest_speed` stays on it. Pairs that meet: ball and ball, ball
/// or box and half-space. No friction and no rotation. Cost: all pairs, every substep.
template <class S>
class LinearBodies final : public PointBody<S> {
 public:
  /// @param rest_speed [m/s], >= 0
  /// @throws std::invalid_argument naming the body and the rule
  LinearBodies(std::string name, const std::vector<LinearBody>& bodies, MotionSettings settings = {},
               double rest_speed = 1e-3);

  const std::vector<LinearBody>& bodies() const { return bodies_; }
  const std::vector<Impact>& impacts() const { return impacts_; }  ///< of the last tick, in order

  StepReport advance(const Tick& tick) override;
  void describe(Blueprint& out) const override;
  void save(CheckpointWriter& out) const override;
  void load(CheckpointReader& in) override;

 protected:
  SolveResult substep(double t, double h) override;

 private:
  // Where a body is within the substep: x + v s + ½ a s² from `since` on.
  struct Flight {
    Vec3 x, v, a;
    double since = 0;
    bool touched = false;
    Vec3 place(double s) const { return x + (s - since) * v + 0.5 * (s - since) * (s - since) * a; }
    Vec3 speed(double s) const { return v + (s - since) * a; }
    void restart(double s) { x = place(s), v = speed(s), since = s; }
  };
  struct Event {
    double when;
    Index body, other;  // other: a body, or -1
    std::size_t collider;
  };

  double support(Index body, const Vec3& normal) const;
  Event next_event(double now, double h) const;
  double meet_plane(Index body, const HalfSpace& plane, double now, double h) const;
  double meet_ball(Index a, Index b, double now, double h) const;
  void answer(const Event& event, double t);

  std::vector<LinearBody> bodies_;
  double rest_speed_;
  std::vector<Flight> flights_;
  std::vector<HalfSpace> planes_;
  std::vector<double> plane_restitution_;
  std::vector<Impact> impacts_;
};

extern template class LinearBodies<float>;
extern template class LinearBodies<double>;

}  // namespace hooke
