#include <hooke/particles/solids.hpp>

#include <hooke/clones.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hooke::particles {

namespace {

// Contacts of one particle in one leg. What still moves into something after so many stops there.
constexpr int kMostContacts = 12;
constexpr double kNever = 2;  // shares of a way end at 1
// A particle that starts inside of a solid is pushed out this fast [m/s].
constexpr double kPushSpeed = 2;
// Approach that rounding leaves behind, relative to the speed.
constexpr double kNone = 1e-12;

Shape moved(Shape shape, const Vec3& by) {
  if (auto* sphere = std::get_if<Sphere>(&shape)) sphere->center += by;
  if (auto* capsule = std::get_if<Capsule>(&shape)) capsule->a += by, capsule->b += by;
  if (auto* box = std::get_if<Box>(&shape)) box->center += by;
  if (auto* level = std::get_if<LevelSet>(&shape)) level->offset += by;
  if (auto* plane = std::get_if<HalfSpace>(&shape)) plane->offset += plane->normal.dot(by);
  return shape;
}

Vec3 place_of(const Shape& shape) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return sphere->center;
  if (const auto* capsule = std::get_if<Capsule>(&shape)) return 0.5 * (capsule->a + capsule->b);
  if (const auto* box = std::get_if<Box>(&shape)) return box->center;
  if (const auto* level = std::get_if<LevelSet>(&shape)) return level->offset;
  return Vec3::Zero();
}

void bounds(const Shape& shape, double radius, Vec3& lower, Vec3& upper) {
  Vec3 reach = Vec3::Constant(radius);
  lower = upper = place_of(shape);
  if (const auto* sphere = std::get_if<Sphere>(&shape)) reach.array() += sphere->radius;
  if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    lower = capsule->a.cwiseMin(capsule->b), upper = capsule->a.cwiseMax(capsule->b);
    reach.array() += capsule->radius;
  }
  if (const auto* box = std::get_if<Box>(&shape)) reach += box->axes.cwiseAbs() * box->half_extent;
  if (const auto* level = std::get_if<LevelSet>(&shape)) {
    upper += level->grid->upper();
    lower += level->grid->lower();
  }
  lower -= reach;
  upper += reach;
}

// ---- Where the way p + s w, s in [0, 1], enters a solid grown by `radius`; kNever if it does not. p is outside.

double enter_sphere(const Vec3& p, const Vec3& w, double r) {
  const double a = w.squaredNorm(), b = p.dot(w);
  if (a == 0 || b >= 0) return kNever;
  // By the closest approach: b² - a c would cancel where the way is long and the solid small.
  const double closest2 = (p - (b / a) * w).squaredNorm();
  if (closest2 > r * r) return kNever;
  const double s = -b / a - std::sqrt((r * r - closest2) / a);
  return s <= 1 ? std::max(s, 0.0) : kNever;
}

double enter(const Sphere& shape, const Vec3& p, const Vec3& w, double radius) {
  return enter_sphere(p - shape.center, w, shape.radius + radius);
}

double enter(const Capsule& shape, const Vec3& p, const Vec3& w, double radius) {
  const double r = shape.radius + radius;
  double first = std::min(enter_sphere(p - shape.a, w, r), enter_sphere(p - shape.b, w, r));
  const Vec3 axis = shape.b - shape.a;
  const double length2 = axis.squaredNorm();
  if (length2 > 0) {
    const Vec3 d = p - shape.a;
    const Vec3 across = d - (d.dot(axis) / length2) * axis, way = w - (w.dot(axis) / length2) * axis;
    const double s = enter_sphere(across, way, r);
    if (s <= 1) {
      const double along = (d + s * w).dot(axis) / length2;
      if (along >= 0 && along <= 1) first = std::min(first, s);
    }
  }
  return first;
}

double enter(const Box& shape, const Vec3& p, const Vec3& w, double radius) {
  const Vec3 q = shape.axes.transpose() * (p - shape.center), v = shape.axes.transpose() * w;
  double in = -std::numeric_limits<double>::infinity(), out = 1;
  for (int k = 0; k < 3; ++k) {
    const double reach = shape.half_extent[k] + radius;
    if (v[k] == 0) {
      if (std::abs(q[k]) >= reach) return kNever;
      continue;
    }
    const double a = (-reach - q[k]) / v[k], b = (reach - q[k]) / v[k];
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  return in <= out && in >= 0 && in <= 1 ? in : kNever;
}

double enter(const LevelSet& shape, const Vec3& p, const Vec3& w, double radius) {
  const DistanceGrid& grid = *shape.grid;
  const Vec3 start = p - shape.offset;
  // The part of the way that is near the grid.
  double s = 0, end = 1;
  for (int k = 0; k < 3; ++k) {
    const double low = grid.lower()[k] - radius, high = grid.upper()[k] + radius;
    if (w[k] == 0) {
      if (start[k] < low || start[k] > high) return kNever;
      continue;
    }
    const double a = (low - start[k]) / w[k], b = (high - start[k]) / w[k];
    s = std::max(s, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  const double length = w.norm();
  if (!(s <= end) || length == 0) return kNever;
  // Sphere tracing, with steps of a quarter voxel at least.
  const double least = 0.25 * grid.voxel() / length;
  double before = s;
  for (; s <= end;) {
    const double gap = grid.distance(start + s * w) - radius;
    if (gap < 0) {
      double low = before, high = s;
      for (int i = 0; i < 30 && low < high; ++i) {
        const double middle = 0.5 * (low + high);
        (grid.distance(start + middle * w) - radius < 0 ? high : low) = middle;
      }
      return low;
    }
    before = s;
    if (s == end) break;
    s = std::min(end, s + std::max(least, 0.7 * gap / length));
  }
  return kNever;
}

double enter(const HalfSpace& shape, const Vec3& p, const Vec3& w, double radius) {
  const double gap = shape.normal.dot(p) - shape.offset - radius, speed = shape.normal.dot(w);
  return speed < 0 && gap + speed < 0 ? gap / -speed : kNever;
}

Vec3 normal_at(const HalfSpace& shape, const Vec3&) { return shape.normal; }
Vec3 normal_at(const Sphere& shape, const Vec3& p) {
  const Vec3 d = p - shape.center;
  return d.norm() > 0 ? Vec3(d.normalized()) : Vec3(0, 1, 0);
}
Vec3 normal_at(const Capsule& shape, const Vec3& p) {
  const Vec3 d = p - nearest_on_segment(shape.a, shape.b, p);
  if (d.norm() > 0) return d.normalized();
  const Vec3 axis = shape.b - shape.a;
  return axis.norm() > 0 ? Vec3(axis.unitOrthogonal()) : Vec3(0, 1, 0);
}
Vec3 normal_at(const Box& shape, const Vec3& p) {
  const Vec3 q = shape.axes.transpose() * (p - shape.center);
  const Vec3 gap = q.cwiseAbs() - shape.half_extent;
  Eigen::Index k;
  gap.maxCoeff(&k);
  return (q[k] < 0 ? -1 : 1) * shape.axes.col(k);
}
Vec3 normal_at(const LevelSet& shape, const Vec3& p) { return shape.grid->normal(p - shape.offset); }

// Boxes grow by flat faces, everything else by its distance.
double gap_to(const Box& shape, const Vec3& p, double radius) {
  return ((shape.axes.transpose() * (p - shape.center)).cwiseAbs() - shape.half_extent).maxCoeff() - radius;
}
double gap_to(const LevelSet& shape, const Vec3& p, double radius) {
  const Vec3 q = p - shape.offset;
  const double away = shape.grid->away(q);
  // The solid is inside of its grid.
  if (away > 0) return std::max(away - radius, std::numeric_limits<double>::min());
  return shape.grid->distance(q) - radius;
}
template <class Form>
double gap_to(const Form& shape, const Vec3& p, double radius) {
  return signed_distance(shape, p) - radius;
}

// What is left of v after an impact with restitution and Coulomb's friction; `relative` is v seen from the wall.
Vec3 bounced(const Vec3& v, const Vec3& relative, const Vec3& normal, double approach, double bounce, double friction) {
  const double impulse = (1 + bounce) * approach;
  const Vec3 slip = relative + approach * normal;
  const double speed = slip.norm(), rub = speed > 0 ? std::min(1.0, friction * impulse / speed) : 0;
  return v + impulse * normal - rub * slip;
}

template <class S>
void tell(std::vector<Hit<S>>& hits, Index i, int leg, double approach, const Vec3& place, const Vec3& normal) {
  hits.push_back(
      {i, leg, S(approach), {S(place[0]), S(place[1]), S(place[2])}, {S(normal[0]), S(normal[1]), S(normal[2])}});
}

// A component that is nothing but the rounding of its vector.
double without_rounding(double component, const Vec3& of) {
  return std::abs(component) <= 1e-14 * of.norm() ? 0 : component;
}

// Marks the particles whose way from x - drift v (or from) to x comes into the box: by how far it stays away from it.
// Returns whether there is one.
template <class S>
HOOKE_INLINE bool mark_loop(Index n, const S* const x[3], const S* const other[3], S drift, bool back, const S lower[3],
                            const S upper[3], S* marks) {
  const S *x0 = x[0], *x1 = x[1], *x2 = x[2], *o0 = other[0], *o1 = other[1], *o2 = other[2];
  const S l0 = lower[0], l1 = lower[1], l2 = lower[2], u0 = upper[0], u1 = upper[1], u2 = upper[2];
  // The other end is x - drift v, or given.
  const S keep = back ? S(1) : S(0), add = back ? -drift : S(1);
  const auto larger = [](S a, S b) { return a < b ? b : a; };
  const auto smaller = [](S a, S b) { return a < b ? a : b; };
  int found = 0;
  HOOKE_INDEPENDENT
  for (Index i = 0; i < n; ++i) {
    const S b0 = keep * x0[i] + add * o0[i], b1 = keep * x1[i] + add * o1[i], b2 = keep * x2[i] + add * o2[i];
    const S away0 = larger(l0 - larger(x0[i], b0), smaller(x0[i], b0) - u0);
    const S away1 = larger(l1 - larger(x1[i], b1), smaller(x1[i], b1) - u1);
    const S away2 = larger(l2 - larger(x2[i], b2), smaller(x2[i], b2) - u2);
    const S mark = smaller(marks[i], larger(away0, larger(away1, away2)));
    marks[i] = mark;
    found |= mark <= 0 ? 1 : 0;
  }
  return found != 0;
}
HOOKE_CLONES bool mark_ways(Index n, const float* const x[3], const float* const other[3], float drift, bool back,
                            const float l[3], const float u[3], float* marks) {
  return mark_loop(n, x, other, drift, back, l, u, marks);
}
HOOKE_CLONES bool mark_ways(Index n, const double* const x[3], const double* const other[3], double drift, bool back,
                            const double l[3], const double u[3], double* marks) {
  return mark_loop(n, x, other, drift, back, l, u, marks);
}

template <class S>
Vec3 at(const S* const p[3], Index i) {
  return {double(p[0][i]), double(p[1][i]), double(p[2][i])};
}

template <class S>
void put(S* const p[3], Index i, const Vec3& value) {
  for (int k = 0; k < 3; ++k) p[k][i] = S(value[k]);
}

template <class S>
Plane<S> plane_of(const HalfSpace& shape, double moved, double h, const Collider& collider, const ContactRule& rule,
                  const Vec3& origin, const Vec3& gravity) {
  Plane<S> plane;
  for (int k = 0; k < 3; ++k) {
    plane.normal[k] = S(shape.normal[k]);
    plane.wall[k] = h > 0 ? S(moved / h * shape.normal[k]) : S(0);
  }
  const double offset = shape.offset - shape.normal.dot(origin) + rule.radius;
  plane.offset = S(offset);
  plane.bounce = S(std::max(collider.restitution, rule.restitution));
  plane.friction = S(collider.friction);
  const double slow = std::max(rule.rest_speed, 2 * rule.step * std::abs(shape.normal.dot(gravity)));
  plane.slow = S(slow);
  plane.near =
      S(0.05 * slow * rule.step + 8 * double(std::numeric_limits<S>::epsilon()) * std::max(1e-3, std::abs(offset)));
  return plane;
}

}  // namespace

// How far the solid's part next to a place moves within the leg.
template <class S>
Vec3 Solids<S>::Pose::move_at(const Vec3& place) const {
  const auto* capsule = std::get_if<Capsule>(&shape);
  if (!capsule || skew.squaredNorm() == 0) return move;
  const Vec3 axis = capsule->b - capsule->a;
  const double length2 = axis.squaredNorm();
  const double along = length2 > 0 ? std::clamp((place - capsule->a).dot(axis) / length2, 0.0, 1.0) : 0.5;
  return move + (along - 0.5) * skew;
}

template <class S>
double Solids<S>::slow(const Vec3& normal) const {
  return std::max(rule_.rest_speed, 2 * rule_.step * std::abs(normal.dot(gravity_)));
}

template <class S>
void Solids<S>::place(std::span<const Collider> colliders, const Vec3& origin, const Vec3& gravity,
                      const ContactRule& rule, std::span<const double> ends) {
  origin_ = origin, gravity_ = gravity, rule_ = rule;
  ends_.assign(ends.begin(), ends.end());
  const std::size_t legs = ends.size() - 1;
  bodies_.clear(), poses_.clear(), callbacks_.clear(), planes_.clear();
  plane_count_ = 0;
  for (const Collider& collider : colliders) {
    if (collider.distance) {
      callbacks_.push_back(&collider);
      continue;
    }
    for (const Shape& shape : collider.shapes) plane_count_ += std::holds_alternative<HalfSpace>(shape);
  }
  planes_.resize(std::size_t(plane_count_) * legs);
  Index plane = 0;
  for (const Collider& collider : colliders) {
    if (collider.distance) continue;
    const bool moves = bool(collider.motion);
    now_ = collider.shapes;
    if (moves) collider.motion(ends[0], now_);
    const std::size_t first = poses_.size(), many = moves ? legs : 1;
    Index solids = 0;
    for (const Shape& shape : now_)
      if (!std::holds_alternative<HalfSpace>(shape)) {
        const double bounce = std::max(collider.restitution, rule.restitution);
        bodies_.push_back({&collider, bounce, collider.friction, moves, first + std::size_t(solids) * many});
        ++solids;
      }
    poses_.resize(first + std::size_t(solids) * many);
    next_ = now_;
    for (std::size_t leg = 0; leg < legs; ++leg) {
      if (moves) collider.motion(ends[leg + 1], next_);
      const double h = ends[leg + 1] - ends[leg];
      Index solid = 0, here = plane;
      for (std::size_t s = 0; s < now_.size(); ++s) {
        if (const auto* half = std::get_if<HalfSpace>(&next_[s])) {
          const double step = half->offset - std::get<HalfSpace>(now_[s]).offset;
          planes_[leg * std::size_t(plane_count_) + std::size_t(here++)] =
              plane_of<S>(*half, moves ? step : 0, h, collider, rule, origin, gravity);
          continue;
        }
        if (moves || leg == 0) {
          Pose& pose = poses_[first + std::size_t(solid) * many + leg];
          pose.shape = moved(now_[s], -origin);
          pose.move = place_of(next_[s]) - place_of(now_[s]);
          bounds(pose.shape, rule.radius, pose.lower, pose.upper);
          // Where it is at the leg's end counts as well; what turns in between is a little larger.
          Vec3 lower, upper;
          bounds(moved(next_[s], -origin), rule.radius, lower, upper);
          pose.lower = pose.lower.cwiseMin(lower), pose.upper = pose.upper.cwiseMax(upper);
          if (const auto* from = std::get_if<Capsule>(&now_[s])) {
            const auto& to = std::get<Capsule>(next_[s]);
            pose.skew = (to.b - from->b) - (to.a - from->a);
          } else {
            pose.skew.setZero();
          }
        }
        ++solid;
      }
      std::swap(now_, next_);
      if (!moves) next_ = now_;
    }
    for (const Shape& shape : collider.shapes) plane += std::holds_alternative<HalfSpace>(shape);
  }
}

template <class S>
bool Solids<S>::mark(const Tile<S>& tile, int leg, S drift, const S* const* from, S* marks) const {
  std::fill_n(marks, (tile.count + Tile<S>::kLanes - 1) / Tile<S>::kLanes * Tile<S>::kLanes, S(1));
  bool found = false;
  for (const Body& body : bodies_) {
    const Pose& p = pose(body, leg);
    S lower[3], upper[3];
    for (int k = 0; k < 3; ++k) {
      // What rests on a face must stay marked whatever its rounding.
      const double slack = 1e-4 + 8 * double(std::numeric_limits<S>::epsilon()) * std::abs(p.lower[k] + p.upper[k]);
      lower[k] = S(p.lower[k] - slack), upper[k] = S(p.upper[k] + slack);
    }
    found |= mark_ways(tile.count, tile.x, from ? from : tile.v, drift, !from, lower, upper, marks);
  }
  return found;
}

template <class S>
bool Solids<S>::mark_planes(const Tile<S>& tile, int leg, S* marks) const {
  bool found = false;
  for (const Plane<S>* p = planes(leg); p < planes(leg) + plane_count_; ++p)
    for (Index i = 0; i < tile.count; ++i) {
      const S gap = p->normal[0] * tile.x[0][i] + p->normal[1] * tile.x[1][i] + p->normal[2] * tile.x[2][i] - p->offset;
      if (gap >= p->near) continue;
      marks[i] = 0;
      found = true;
    }
  return found;
}

// The way p + s way, s in [0, 1], takes the last `left` seconds of a leg of `drift`; `done` is the share of the leg
// that is over.
template <class S>
void Solids<S>::meet(const Pose& pose, const Body& body, const Vec3& p, const Vec3& way, double done, double left,
                     double drift, bool pushed, Meeting& first) const {
  const Vec3 move = pose.move_at(p);
  const Vec3 wall = drift != 0 ? Vec3(move / drift) : Vec3(Vec3::Zero());
  const Vec3 start = p - done * move, relative = way - left * wall;
  std::visit(
      [&](const auto& shape) {
        const double gap = gap_to(shape, start, rule_.radius);
        double when;
        Vec3 normal;
        if (gap < 0) {
          normal = normal_at(shape, start);
          // Out once a leg; what then leaves is on its way.
          if (relative.dot(normal) >= -kNone * relative.norm() && (pushed || gap > -1e-9)) return;
          when = 0;
        } else {
          // A trilinear distance falls by at most √3 of the way.
          if (std::is_same_v<std::decay_t<decltype(shape)>, LevelSet> && gap > 1.7321 * relative.norm()) return;
          when = enter(shape, start, relative, rule_.radius);
          if (!(when < first.when)) return;
          normal = normal_at(shape, start + when * relative);
        }
        if (when < first.when) first = {when, normal, wall, body.bounce, body.friction, std::max(0.0, -gap)};
      },
      pose.shape);
}

template <class S>
Vec3 Solids<S>::answer(const Meeting& at, const Vec3& v, Index i, int leg, const Vec3& place,
                       std::vector<Hit<S>>* hits) const {
  const Vec3 relative = v - at.wall;
  const double approach = -relative.dot(at.normal);
  if (approach <= 0) return v;
  const double limit = slow(at.normal);
  const double bounce = approach < limit ? 0 : at.bounce;
  if (hits && approach >= limit) tell(*hits, i, leg, approach, place, at.normal);
  return bounced(v, relative, at.normal, approach, bounce, at.friction);
}

template <class S>
void Solids<S>::resolve(const Tile<S>& tile, int leg, S drift, const S* const* from, const S* marks,
                        std::vector<Hit<S>>* hits) const {
  const double h = ends_[std::size_t(leg) + 1] - ends_[std::size_t(leg)];
  for (Index i = 0; i < tile.count; ++i) {
    if (marks[i] > 0) continue;
    const Vec3 end = at<S>(tile.x, i);
    Vec3 v = at<S>(tile.v, i);
    Vec3 p = from ? at<S>(from, i) : Vec3(end - double(drift) * v);
    Vec3 way = end - p;
    double left = h;
    bool touched = false, pushed = false;
    for (int contact = 0; contact < kMostContacts; ++contact) {
      Meeting first;
      const double done = h != 0 ? 1 - left / h : 1;
      for (const Body& body : bodies_) {
        const Pose& pose_now = pose(body, leg);
        const Vec3 low = p.cwiseMin(p + way), high = p.cwiseMax(p + way);
        if ((high.array() < pose_now.lower.array()).any() || (low.array() > pose_now.upper.array()).any()) continue;
        meet(pose_now, body, p, way, done, left, h, pushed, first);
      }
      for (Index k = 0; k < plane_count_; ++k) {
        const Plane<S>& plane = planes(leg)[k];
        const Vec3 n(plane.normal[0], plane.normal[1], plane.normal[2]),
            wall(plane.wall[0], plane.wall[1], plane.wall[2]);
        const double gap = n.dot(p + left * wall) - double(plane.offset), speed = n.dot(way) - left * n.dot(wall);
        if (!(speed < 0) || gap + speed >= 0) continue;
        const double when = std::max(0.0, gap / -speed);
        if (when < first.when)
          first = {when, n, wall, double(plane.bounce), double(plane.friction), std::max(0.0, -gap)};
      }
      if (first.when > 1) {
        if (touched) p += way;
        break;
      }
      touched = true;
      p += first.when * way;
      left *= 1 - first.when;
      if (first.depth > 0 && !pushed)
        p += std::min(first.depth, kPushSpeed * std::abs(h)) * first.normal, pushed = true;
      const Vec3 after = answer(first, v, i, leg, p, hits);
      v = after;
      way = left * v;
      // What keeps pressing into a corner stays where it is.
      if (contact + 2 >= kMostContacts) way = Vec3::Zero();
    }
    if (!touched) continue;
    put(tile.x, i, p);
    put(tile.v, i, v);
  }
}

template <class S>
void Solids<S>::resolve_exactly(const Tile<S>& tile, int leg, double h, const S* const x0[3], const S* const v0[3],
                                std::vector<Hit<S>>* hits) const {
  // As many impacts as a ball that comes to rest makes within a step.
  constexpr int kMostImpacts = 10'000;
  constexpr int kPieces = 32;
  for (Index i = 0; i < tile.count; ++i) {
    Vec3 x = at<S>(x0, i), v = at<S>(v0, i);
    Vec3 a = (at<S>(tile.v, i) - v) / h;
    double now = 0;
    bool touched = false;
    for (int impact = 0; impact < kMostImpacts; ++impact) {
      const double left = h - now;
      double when = std::numeric_limits<double>::infinity();
      Meeting first;
      const auto take = [&](double s, const Vec3& normal, const Vec3& wall, double bounce, double friction) {
        if (!(s < when)) return;
        when = s;
        first = {0, normal, wall, bounce, friction, 0};
      };
      for (Index k = 0; k < plane_count_; ++k) {
        const Plane<S>& plane = planes(leg)[k];
        const Vec3 n(plane.normal[0], plane.normal[1], plane.normal[2]),
            wall(plane.wall[0], plane.wall[1], plane.wall[2]);
        const double gap = n.dot(x + left * wall) - double(plane.offset);
        const double speed = without_rounding(n.dot(v - wall), v), pull = without_rounding(n.dot(a), a);
        double s = std::numeric_limits<double>::infinity();
        const double rounding = 1e-13 * std::max(1.0, std::abs(double(plane.offset)));
        if (gap <= rounding) {
          if (speed < 0 || (speed == 0 && pull < 0))
            s = 0;
          else if (pull < 0)
            s = 2 * speed / -pull;  // up and down again
        } else if (const double disc = speed * speed - 2 * pull * gap; pull == 0) {
          if (speed < 0) s = gap / -speed;
        } else if (disc >= 0) {
          const double root = std::sqrt(disc);
          if (pull < 0)
            s = (speed + root) / -pull;
          else if (speed < 0)
            s = 2 * gap / (root - speed);
        }
        if (s >= 0 && s <= left) take(s, n, wall, double(plane.bounce), double(plane.friction));
      }
      for (const Body& body : bodies_) {
        const Pose& p = pose(body, leg);
        const Vec3 move = p.move_at(x), wall = move / h;
        std::visit(
            [&](const auto& shape) {
              const auto place = [&](double s) { return Vec3(x + s * v + 0.5 * s * s * a - (now + s) / h * move); };
              const auto gap = [&](double s) { return gap_to(shape, place(s), rule_.radius); };
              double low = 0;
              if (const double depth = gap(0); depth <= 1e-12) {
                const Vec3 n = normal_at(shape, place(0));
                // What rounding or the solid's bend left inside comes out.
                if (depth < -1e-12) x += std::min(-depth, kPushSpeed * h) * n, touched = true;
                const double speed = without_rounding((v - wall).dot(n), v), pull = without_rounding(a.dot(n), a);
                if (speed < 0 || (speed == 0 && pull < 0))
                  take(0, n, wall, body.bounce, body.friction);
                else if (pull < 0 &&
                         2 * speed / -pull <= left)  // up and down again, as on the plane that touches there
                  take(2 * speed / -pull, n, wall, body.bounce, body.friction);
                return;
              }
              for (int piece = 1; piece <= kPieces; ++piece) {
                const double high_end = left * piece / kPieces;
                // Chords are swept, so that nothing thin is passed by.
                const Vec3 from = place(low), chord = place(high_end) - from;
                const double s = enter(shape, from, chord, rule_.radius);
                if (s <= 1) {
                  double high = low + s * (high_end - low), before = low;
                  if (gap(high) > 0) high = high_end, before = low + s * (high_end - low);
                  if (gap(high) > 0) high = before;
                  for (int k = 0; k < 60 && gap(high) <= 0; ++k) {
                    const double middle = 0.5 * (before + high);
                    (gap(middle) <= 0 ? high : before) = middle;
                  }
                  take(high, normal_at(shape, place(high)), wall, body.bounce, body.friction);
                  return;
                }
                low = high_end;
              }
            },
            p.shape);
      }
      if (!(when <= left)) break;
      touched = true;
      x += when * v + 0.5 * when * when * a;
      v += when * a;
      now += when;
      const double approach = -(v - first.wall).dot(first.normal);
      if (first.bounce * approach <= rule_.rest_speed) {
        // Stays: no normal velocity, and nothing presses it in for the rest of the step.
        v += std::max(0.0, approach) * first.normal;
        const double pressed = std::max(0.0, -a.dot(first.normal));
        a += pressed * first.normal;
        if (hits && approach > slow(first.normal)) tell(*hits, i, leg, approach, x, first.normal);
        // Dry friction: against what slips, or, where nothing does, against what would make it.
        const Vec3 slip = (v - first.wall) - (v - first.wall).dot(first.normal) * first.normal;
        const double speed = slip.norm(), loss = first.friction * (std::max(0.0, approach) + pressed * (h - now));
        if (speed > loss) {
          v -= loss / speed * slip;
        } else {
          v -= slip;
          const double along = a.norm();
          if (along > 0) a -= std::min(1.0, first.friction * pressed / along) * a;
        }
        continue;
      }
      v = bounced(v, v - first.wall, first.normal, approach, first.bounce, first.friction);
      if (hits) tell(*hits, i, leg, approach, x, first.normal);
    }
    if (!touched) continue;
    const double left = h - now;
    put(tile.x, i, x + left * v + 0.5 * left * left * a);
    put(tile.v, i, v + left * a);
  }
}

template <class S>
void Solids<S>::settle(const Tile<S>& tile, int leg, const S* marks) const {
  const double h = ends_[std::size_t(leg) + 1] - ends_[std::size_t(leg)];
  for (Index i = 0; i < tile.count; ++i) {
    if (marks[i] > 0) continue;
    const Vec3 x = at<S>(tile.x, i);
    Vec3 v = at<S>(tile.v, i);
    bool changed = false;
    for (const Body& body : bodies_) {
      const Pose& p = pose(body, leg);
      const double reach = 0.05 * slow(Vec3(0, 1, 0)) * rule_.step + 1e-5;
      if ((x.array() < p.lower.array() - reach).any() || (x.array() > p.upper.array() + reach).any()) continue;
      std::visit(
          [&](const auto& shape) {
            const Vec3 move = p.move_at(x), place = x - move;
            if (gap_to(shape, place, rule_.radius) > reach) return;
            const Vec3 n = normal_at(shape, place), wall = h != 0 ? Vec3(move / h) : Vec3(Vec3::Zero());
            const double approach = -(v - wall).dot(n);
            if (!(approach > 0 && approach < slow(n))) return;
            v = bounced(v, v - wall, n, approach, 0, body.friction);
            changed = true;
          },
          p.shape);
    }
    if (changed) put(tile.v, i, v);
  }
}

template <class S>
void Solids<S>::call_back(const Tile<S>& tile, int leg, std::vector<Hit<S>>* hits) const {
  const double h = ends_[std::size_t(leg) + 1] - ends_[std::size_t(leg)];
  thread_local Points<double> world, normal;
  thread_local Values<double> distance;
  world.resize(tile.count, 3);
  for (int k = 0; k < 3; ++k)
    for (Index i = 0; i < tile.count; ++i) world(i, k) = origin_[k] + double(tile.x[k][i]);
  for (const Collider* collider : callbacks_) {
    distance.setConstant(tile.count, 1);
    normal.setZero(tile.count, 3);
    {
      // Somebody else's engine need not expect calls from several threads at once.
      const std::lock_guard lock(callback_mutex_);
      collider->distance(ends_[std::size_t(leg) + 1], world, distance, normal);
    }
    for (Index i = 0; i < tile.count; ++i) {
      const double gap = distance[i] - rule_.radius;
      if (!(gap < 0)) continue;
      Meeting at_surface;
      at_surface.normal = normal.row(i).matrix().transpose();
      at_surface.bounce = std::max(collider->restitution, rule_.restitution);
      at_surface.friction = collider->friction;
      const Vec3 x = at<S>(tile.x, i), v = at<S>(tile.v, i);
      put(tile.v, i, answer(at_surface, v, i, leg, x, hits));
      put(tile.x, i, x + std::min(-gap, std::max(kPushSpeed * std::abs(h), v.norm() * h)) * at_surface.normal);
    }
  }
}

template class Solids<float>;
template class Solids<double>;

}  // namespace hooke::particles
