#include <hooke/linear_bodies.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hooke {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// A pile that would bounce for ever within one substep is left as it is after so many impacts.
constexpr int kMostImpacts = 20'000;

template <class S>
PointMasses<S> point_masses(const std::vector<LinearBody>& bodies) {
  PointMasses<S> points;
  const Index n = Index(bodies.size());
  points.position.resize(n, 3), points.velocity.resize(n, 3), points.mass.resize(n), points.inverse_mass.resize(n);
  for (Index i = 0; i < n; ++i) {
    const LinearBody& body = bodies[std::size_t(i)];
    const auto fail = [&](const char* rule) {
      throw std::invalid_argument("LinearBodies: body " + std::to_string(i) + ": " + rule);
    };
    if (const auto* ball = std::get_if<BallShape>(&body.shape); ball && !(ball->radius > 0))
      fail("radius must be positive");
    if (const auto* box = std::get_if<BoxShape>(&body.shape); box && !(box->half_extent.array() > 0).all())
      fail("half_extent must be positive");
    if (!(body.mass > 0)) fail("mass must be positive");
    if (!(body.restitution >= 0 && body.restitution <= 1)) fail("restitution must be in [0, 1]");
    points.position.row(i) = body.position.transpose().cast<S>();
    points.velocity.row(i) = body.velocity.transpose().cast<S>();
    points.mass[i] = S(body.mass);
    points.inverse_mass[i] = body.reacts ? S(1 / body.mass) : S(0);
  }
  return points;
}

MotionSettings without_point_contacts(MotionSettings settings) {
  settings.collides = false;
  settings.compensated = settings.sleeps = false;  // impacts set positions; the tick of a ball is cheap
  return settings;
}

// The root of f + g s + ½ a s² at which it falls through zero, if it is in [0, end].
double falling_root(double f, double g, double a, double end) {
  double s = kNever;
  if (a == 0) {
    if (g < 0) s = -f / g;
  } else {
    const double discriminant = g * g - 2 * a * f;
    if (discriminant >= 0) {
      const double root = std::sqrt(discriminant);
      if (a < 0) s = (g + root) / -a;
      // The same root for a > 0, without cancellation.
      else if (g < 0)
        s = 2 * f / (-g + root);
    }
  }
  // What already is a rounding error below falls through at once.
  if (s < 0 && f <= 0 && g < 0) s = 0;
  return s >= 0 && s <= end ? s : kNever;
}

}  // namespace

template <class S>
LinearBodies<S>::LinearBodies(std::string name, const std::vector<LinearBody>& bodies, MotionSettings settings,
                              double rest_speed)
    : PointBody<S>(std::move(name), point_masses<S>(bodies), without_point_contacts(settings)),
      bodies_(bodies),
      rest_speed_(rest_speed) {
  if (!(rest_speed >= 0)) throw std::invalid_argument("LinearBodies: rest_speed must not be negative");
  this->may_follow_ = false;  // each flies its own way
}

template <class S>
double LinearBodies<S>::support(Index body, const Vec3& normal) const {
  const auto& shape = bodies_[std::size_t(body)].shape;
  if (const auto* ball = std::get_if<BallShape>(&shape)) return ball->radius;
  return std::get<BoxShape>(shape).half_extent.dot(normal.cwiseAbs());
}

template <class S>
double LinearBodies<S>::meet_plane(Index body, const HalfSpace& plane, double now, double h) const {
  const Flight& flight = flights_[std::size_t(body)];
  const double gap = plane.normal.dot(flight.place(now)) - support(body, plane.normal) - plane.offset;
  const double speed = plane.normal.dot(flight.speed(now)), a = plane.normal.dot(flight.a);
  // Resting: neither in motion nor pushed.
  if (gap <= 0 && speed == 0 && a >= 0) return kNever;
  if (gap <= 0 && speed <= 0) return now;
  return now + falling_root(gap, speed, a, h - now);
}

template <class S>
double LinearBodies<S>::meet_ball(Index a, Index b, double now, double h) const {
  const auto *ball_a = std::get_if<BallShape>(&bodies_[std::size_t(a)].shape),
             *ball_b = std::get_if<BallShape>(&bodies_[std::size_t(b)].shape);
  if (!ball_a || !ball_b) return kNever;
  const Flight &fa = flights_[std::size_t(a)], &fb = flights_[std::size_t(b)];
  const double reach = ball_a->radius + ball_b->radius;
  const Vec3 d = fb.place(now) - fa.place(now), v = fb.speed(now) - fa.speed(now), acc = fb.a - fa.a;
  const double end = h - now;
  if (acc.squaredNorm() == 0) {
    const double closing = d.dot(v), speed2 = v.squaredNorm(), c = d.squaredNorm() - reach * reach;
    if (closing >= 0) return kNever;
    if (c <= 0) return now;
    const double discriminant = closing * closing - speed2 * c;
    if (discriminant < 0) return kNever;
    const double s = c / (-closing + std::sqrt(discriminant));
    return s <= end ? now + s : kNever;
  }
  // Accelerations differ: look along the way in small pieces, then halve.
  const auto gap = [&](double s) { return (d + s * v + 0.5 * s * s * acc).norm() - reach; };
  if (gap(0) <= 0) return d.dot(v) < 0 ? now : kNever;
  constexpr int kPieces = 32;
  double low = 0;
  for (int i = 1; i <= kPieces; ++i) {
    double high = end * i / kPieces;
    if (gap(high) <= 0) {
      for (int k = 0; k < 60; ++k) (gap(0.5 * (low + high)) <= 0 ? high : low) = 0.5 * (low + high);
      return now + high;
    }
    low = high;
  }
  return kNever;
}

template <class S>
typename LinearBodies<S>::Event LinearBodies<S>::next_event(double now, double h) const {
  Event first{kNever, -1, -1, 0};
  const auto& w = this->points_.inverse_mass;
  for (Index i = 0; i < this->size(); ++i) {
    if (!bodies_[std::size_t(i)].collidable) continue;
    if (w[i] != 0)
      for (std::size_t p = 0; p < planes_.size(); ++p)
        if (const double when = meet_plane(i, planes_[p], now, h); when < first.when) first = {when, i, -1, p};
    for (Index j = i + 1; j < this->size(); ++j)
      if (bodies_[std::size_t(j)].collidable && w[i] + w[j] != 0)
        if (const double when = meet_ball(i, j, now, h); when < first.when) first = {when, i, j, 0};
  }
  return first;
}

template <class S>
void LinearBodies<S>::answer(const Event& event, double t) {
  Flight& flight = flights_[std::size_t(event.body)];
  flight.restart(event.when);
  flight.touched = true;
  const double wa = double(this->points_.inverse_mass[event.body]);
  const double e_a = bodies_[std::size_t(event.body)].restitution;
  if (event.other < 0) {
    const Vec3& n = planes_[event.collider].normal;
    const double approach = -n.dot(flight.v);
    const double e = std::max(e_a, plane_restitution_[event.collider]);
    if (e * approach <= rest_speed_) {
      // Stays: no normal velocity, and nothing presses it in for the rest of the substep.
      flight.v += approach * n;
      // Rounding must not leave a trace of the normal velocity, or rest would never be exact.
      if (n.cwiseAbs().maxCoeff() == 1) flight.v = (n.array() != 0).select(0, flight.v);
      if (n.dot(flight.a) < 0) flight.a -= n.dot(flight.a) * n;
      if (n.cwiseAbs().maxCoeff() == 1) flight.a = (n.array() != 0).select(0, flight.a);
      if (approach > 0) impacts_.push_back({t + event.when, event.body, -1, approach / wa * n, approach});
      return;
    }
    flight.v += (1 + e) * approach * n;
    impacts_.push_back({t + event.when, event.body, -1, (1 + e) * approach / wa * n, approach});
    return;
  }
  Flight& other = flights_[std::size_t(event.other)];
  other.restart(event.when);
  other.touched = true;
  const double wb = double(this->points_.inverse_mass[event.other]);
  const Vec3 n = (other.x - flight.x).normalized();
  const double approach = (flight.v - other.v).dot(n);
  double e = std::max(e_a, bodies_[std::size_t(event.other)].restitution);
  if (e * approach <= rest_speed_) e = 0;
  const Vec3 impulse = -(1 + e) * approach / (wa + wb) * n;
  flight.v += wa * impulse;
  other.v -= wb * impulse;
  impacts_.push_back({t + event.when, event.body, event.other, impulse, approach});
}

template <class S>
SolveResult LinearBodies<S>::substep(double t, double h) {
  auto& points = this->points_;
  const std::size_t n = std::size_t(this->size());
  flights_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    flights_[i] = {};
    flights_[i].x = points.position.row(Index(i)).matrix().transpose().template cast<double>();
    flights_[i].v = points.velocity.row(Index(i)).matrix().transpose().template cast<double>();
  }
  const SolveResult result = PointBody<S>::substep(t, h);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 v = points.velocity.row(Index(i)).matrix().transpose().template cast<double>();
    flights_[i].a = (v - flights_[i].v) / h;
  }
  double now = 0;
  for (int i = 0; i < kMostImpacts; ++i) {
    const Event event = next_event(now, h);
    if (!(event.when <= h)) break;
    now = std::max(now, event.when);
    answer(event, t);
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!flights_[i].touched || points.inverse_mass[Index(i)] == 0) continue;
    points.position.row(Index(i)) = flights_[i].place(h).transpose().array().template cast<S>();
    points.velocity.row(Index(i)) = flights_[i].speed(h).transpose().array().template cast<S>();
  }
  return result;
}

template <class S>
StepReport LinearBodies<S>::advance(const Tick& tick) {
  impacts_.clear();
  planes_.clear();
  plane_restitution_.clear();
  for (const Collider& collider : tick.colliders) {
    if (collider.motion) continue;
    for (const Shape& shape : collider.shapes)
      if (const auto* plane = std::get_if<HalfSpace>(&shape)) {
        planes_.push_back({plane->normal, plane->offset - plane->normal.dot(this->points_.origin)});
        plane_restitution_.push_back(collider.restitution);
      }
  }
  return PointBody<S>::advance(tick);
}

template <class S>
void LinearBodies<S>::describe(Blueprint& out) const {
  PointBody<S>::describe(out);
  out.add("rest_speed", rest_speed_);
  CheckpointWriter bodies;
  for (const LinearBody& body : bodies_) {
    bodies.add(std::uint8_t(body.shape.index()));
    if (const auto* ball = std::get_if<BallShape>(&body.shape))
      bodies.add(ball->radius);
    else
      bodies.add(std::get<BoxShape>(body.shape).half_extent);
    bodies.add(body.restitution);
    bodies.add(body.collidable);
  }
  out.add_sum("linear bodies", bodies);
}

template <class S>
void LinearBodies<S>::save(CheckpointWriter& out) const {
  PointBody<S>::save(out);
  out.begin("impacts");
  out.add(std::uint64_t(impacts_.size()));
  for (const Impact& impact : impacts_) {
    out.add(impact.time);
    out.add(std::int64_t(impact.body));
    out.add(std::int64_t(impact.other));
    out.add(impact.impulse);
    out.add(impact.approach);
  }
  out.end();
}

template <class S>
void LinearBodies<S>::load(CheckpointReader& in) {
  PointBody<S>::load(in);
  in.begin("impacts");
  impacts_.resize(std::size_t(in.count("number of impacts", std::numeric_limits<Index>::max(), 64)));
  for (Impact& impact : impacts_) {
    impact.time = in.number<double>("time");
    impact.body = Index(in.number<std::int64_t>("body", 0, this->size() - 1));
    impact.other = Index(in.number<std::int64_t>("other", -1, this->size() - 1));
    in.array("impulse", impact.impulse, 3);
    impact.approach = in.number<double>("approach");
  }
  in.end();
}

template class LinearBodies<float>;
template class LinearBodies<double>;

}  // namespace hooke
