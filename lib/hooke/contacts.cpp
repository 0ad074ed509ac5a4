#include <hooke/contacts.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hooke {

namespace {

// How far a point may stray from what its speed says within a tick before its candidates are
// looked up again [m].
constexpr double kSlack = 5e-3;

// First root in [0, 1] of |d + s m|² = r², or infinity. `d` starts outside.
template <class S>
S sphere_entry(const Eigen::Matrix<S, 3, 1>& d, const Eigen::Matrix<S, 3, 1>& m, S r) {
  const S a = m.squaredNorm(), b = d.dot(m);
  if (a == 0 || b >= 0) return std::numeric_limits<S>::infinity();
  // By the closest approach: b² - a c would cancel where the way is long and the solid small.
  const S closest2 = (d - (b / a) * m).squaredNorm();
  if (closest2 > r * r) return std::numeric_limits<S>::infinity();
  const S s = -b / a - std::sqrt((r * r - closest2) / a);
  return s <= 1 ? std::max(s, S(0)) : std::numeric_limits<S>::infinity();
}

}  // namespace

template <class S>
void Contacts<S>::place_solids(double t, std::vector<Solid>& out) {
  out.clear();
  for (const Collider& collider : colliders_) {
    if (collider.distance) continue;
    std::span<const Shape> shapes = collider.shapes;
    if (collider.motion) {
      shapes_ = collider.shapes;
      collider.motion(t, shapes_);
      shapes = shapes_;
    }
    for (const Shape& shape : shapes) {
      Solid solid;
      solid.friction = S(collider.friction);
      solid.restitution = S(collider.restitution);
      if (const auto* half = std::get_if<HalfSpace>(&shape)) {
        solid.kind = Kind::HalfSpace;
        solid.a = half->normal.cast<S>();
        solid.radius = S(half->offset - half->normal.dot(origin_)) + thickness_;
      } else if (const auto* sphere = std::get_if<Sphere>(&shape)) {
        solid.kind = Kind::Sphere;
        solid.a = solid.b = (sphere->center - origin_).cast<S>();
        solid.radius = S(sphere->radius) + thickness_;
      } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
        solid.kind = Kind::Capsule;
        solid.a = (capsule->a - origin_).cast<S>();
        solid.b = (capsule->b - origin_).cast<S>();
        solid.radius = S(capsule->radius) + thickness_;
      } else if (const auto* box = std::get_if<Box>(&shape)) {
        solid.kind = Kind::Box;
        solid.a = (box->center - origin_).cast<S>();
        solid.b = box->half_extent.cast<S>();
        solid.radius = thickness_;
        solid.axes = box->axes.cast<S>();
      } else {
        const auto& set = std::get<LevelSet>(shape);
        solid.kind = Kind::LevelSet;
        solid.a = solid.b = (set.offset - origin_).cast<S>();
        solid.radius = thickness_;
        solid.grid = set.grid.get();
      }
      out.push_back(solid);
    }
  }
}

template <class S>
void Contacts<S>::begin_tick(std::span<const Collider> colliders, const PointMasses<S>& points, double t0, double t1,
                             double thickness) {
  colliders_ = colliders;
  origin_ = points.origin;
  thickness_ = S(thickness);
  tick_end_ = t1;
  before_ = t1;
  now_ = t0;
  callbacks_.clear();
  for (const Collider& collider : colliders)
    if (collider.distance) callbacks_.push_back(&collider);
  place_solids(t1, previous_);
  place_solids(t0, solids_);
  candidates_.clear();
  touches_.clear();
  if (points.size() == 0 || solids_.empty()) return;
  solid_move_.resize(solids_.size());
  for (std::size_t s = 0; s < solids_.size(); ++s) {
    const Solid &before = solids_[s], &after = previous_[s];
    // A quarter on top of the straight way covers the bend of the path within a tick.
    solid_move_[s] = before.kind == Kind::HalfSpace ? moved(before, after) : S(1.25) * moved(before, after);
  }
  find_candidates(points.position, points.velocity, t1 - t0);
}

// Pairs of points and solids that may meet within `seconds`. Whole runs of points are ruled out by
// their box first: neighbours in memory are mostly neighbours in space.
template <class S>
void Contacts<S>::find_candidates(const Points<S>& x, const Points<S>& v, double seconds) {
  start_ = x;
  reach_ = (S(1.5) * S(seconds)) * (v.square().rowwise().sum().sqrt()) + S(kSlack);
  candidates_.clear();
  const Index runs = (x.rows() + kRun - 1) / kRun;
  lower_.resize(runs, 3), upper_.resize(runs, 3), farthest_.resize(runs);
  for (Index run = 0; run < runs; ++run) {
    const Index first = run * kRun, n = std::min(kRun, x.rows() - first);
    lower_.row(run) = x.middleRows(first, n).colwise().minCoeff();
    upper_.row(run) = x.middleRows(first, n).colwise().maxCoeff();
    farthest_[run] = reach_.segment(first, n).maxCoeff();
  }
  for (std::size_t s = 0; s < solids_.size(); ++s) {
    const Solid& solid = solids_[s];
    const Vec axis = solid.b - solid.a;
    const S inverse = axis.squaredNorm() > 0 ? 1 / axis.squaredNorm() : S(0);
    Vec low, high;  // of boxes and level sets
    bounds(solid, low, high);
    for (Index run = 0; run < runs; ++run) {
      const Index first = run * kRun, n = std::min(kRun, x.rows() - first);
      const auto px = x.col(0).segment(first, n), py = x.col(1).segment(first, n), pz = x.col(2).segment(first, n);
      const S near = farthest_[run] + solid_move_[s];
      if (solid.kind == Kind::HalfSpace) {
        gap_ = px * solid.a[0] + py * solid.a[1] + pz * solid.a[2] - solid.radius;
      } else if (solid.kind == Kind::Box || solid.kind == Kind::LevelSet) {
        bool apart = false;
        for (int k = 0; k < 3; ++k) apart = apart || low[k] - near > upper_(run, k) || high[k] + near < lower_(run, k);
        if (apart) continue;
        if (solid.kind == Kind::Box)
          find_box_gaps(solid, x, first, n);
        else
          find_grid_gaps(solid, x, first, n, near);
      } else {
        bool apart = false;
        for (int k = 0; k < 3; ++k)
          apart = apart || std::min(solid.a[k], solid.b[k]) - solid.radius - near > upper_(run, k) ||
                  std::max(solid.a[k], solid.b[k]) + solid.radius + near < lower_(run, k);
        if (apart) continue;
        along_ = (((px - solid.a[0]) * axis[0] + (py - solid.a[1]) * axis[1] + (pz - solid.a[2]) * axis[2]) * inverse)
                     .max(S(0))
                     .min(S(1));
        gap_ = ((px - solid.a[0] - along_ * axis[0]).square() + (py - solid.a[1] - along_ * axis[1]).square() +
                (pz - solid.a[2] - along_ * axis[2]).square())
                   .sqrt() -
               solid.radius;
      }
      for (Index i = 0; i < n; ++i)
        if (gap_[i] <= reach_[first + i] + solid_move_[s]) candidates_.push_back({int(first + i), int(s)});
    }
  }
}

// The box along the axes of the world that holds a box or a level set.
template <class S>
void Contacts<S>::bounds(const Solid& solid, Vec& low, Vec& high) {
  Vec center = solid.a, half = Vec::Zero();
  if (solid.kind == Kind::Box) half = solid.axes.cwiseAbs() * solid.b;
  if (solid.kind == Kind::LevelSet) {
    center += (0.5 * (solid.grid->lower() + solid.grid->upper())).template cast<S>();
    half = (0.5 * (solid.grid->upper() - solid.grid->lower())).template cast<S>();
  }
  low = (center - half).array() - solid.radius;
  high = (center + half).array() + solid.radius;
}

template <class S>
void Contacts<S>::find_box_gaps(const Solid& solid, const Points<S>& x, Index first, Index n) {
  const auto px = x.col(0).segment(first, n), py = x.col(1).segment(first, n), pz = x.col(2).segment(first, n);
  const Vec middle = solid.axes.transpose() * solid.a;
  gap_.setZero(n);
  for (int k = 0; k < 3; ++k) {
    const Vec u = solid.axes.col(k);
    gap_ += ((px * u[0] + py * u[1] + pz * u[2] - middle[k]).abs() - solid.b[k]).max(S(0)).square();
  }
  gap_ = gap_.sqrt() - solid.radius;
}

template <class S>
void Contacts<S>::find_grid_gaps(const Solid& solid, const Points<S>& x, Index first, Index n, S near) {
  gap_.resize(n);
  for (Index i = 0; i < n; ++i) gap_[i] = clearance(solid, row(x, first + i), near);
}

// No more than how far a level set's thickened surface is; looked up in the grid only within `near` of it.
template <class S>
S Contacts<S>::clearance(const Solid& solid, const Vec& x, S near) {
  const Vec3 place = (x - solid.a).template cast<double>();
  const double away = solid.grid->away(place);
  if (away > double(near) + double(solid.radius)) return S(away) - solid.radius;
  // What the grid tells beyond its border may be too much by twice the way from there.
  return S(std::max(away, solid.grid->distance(place) - 2 * away)) - solid.radius;
}

// How far a solid's surface moves at most.
template <class S>
S Contacts<S>::moved(const Solid& before, const Solid& after) {
  if (before.kind == Kind::HalfSpace) return std::abs(after.radius - before.radius);
  const S way = std::max((after.a - before.a).norm(), (after.b - before.b).norm());
  if (before.kind != Kind::Box || before.axes == after.axes) return way;
  return way + (after.axes - before.axes).norm() * after.b.norm();
}

template <class S>
typename Contacts<S>::Surface Contacts<S>::surface(const Solid& solid, const Vec& x) const {
  if (solid.kind == Kind::HalfSpace) return {solid.a.dot(x) - solid.radius, solid.a};
  if (solid.kind == Kind::Box) {
    const Vec place = solid.axes.transpose() * (x - solid.a), beyond = place.cwiseAbs() - solid.b;
    Vec local = beyond.cwiseMax(S(0));
    S distance = local.norm();
    if (distance > 0) {
      local /= distance;
    } else {
      int face;
      distance = beyond.maxCoeff(&face);
      local[face] = 1;
    }
    for (int k = 0; k < 3; ++k) local[k] = std::copysign(local[k], place[k]);
    return {distance - solid.radius, solid.axes * local};
  }
  if (solid.kind == Kind::LevelSet) {
    const S distance = gap(solid, x);
    return {distance, distance < 0 ? normal(solid, x) : Vec(0, 0, 0)};  // costs six times the distance
  }
  Vec away = x - solid.a;
  if (solid.kind == Kind::Capsule) {
    const Vec axis = solid.b - solid.a;
    const S length2 = axis.squaredNorm();
    if (length2 > 0) away -= std::clamp(away.dot(axis) / length2, S(0), S(1)) * axis;
  }
  const S distance = away.norm();
  // On the axis every direction is as good as any other; up is at least the same each time.
  const Vec normal = distance > 0 ? Vec(away / distance) : Vec(0, 1, 0);
  return {distance - solid.radius, normal};
}

template <class S>
S Contacts<S>::gap(const Solid& solid, const Vec& x) const {
  if (solid.kind != Kind::LevelSet) return surface(solid, x).gap;
  return S(solid.grid->distance((x - solid.a).template cast<double>())) - solid.radius;
}

// The surface's outward direction at a point on it.
template <class S>
typename Contacts<S>::Vec Contacts<S>::normal(const Solid& solid, const Vec& x) const {
  if (solid.kind != Kind::LevelSet) return surface(solid, x).normal;
  return solid.grid->normal((x - solid.a).template cast<double>()).template cast<S>();
}

// How far a point may go in before the surface nearest to it may be another than the one it came through.
template <class S>
S Contacts<S>::nearest_is_right(const Solid& solid) {
  if (solid.kind == Kind::Box) return 0;  // may be thin
  return solid.kind == Kind::LevelSet ? S(solid.grid->voxel()) : solid.radius;
}

// How deep a point may be that was put on the surface.
template <class S>
S Contacts<S>::skin(const Solid& solid) {
  if (solid.kind == Kind::Box)
    return 16 * std::numeric_limits<S>::epsilon() * (solid.a.norm() + solid.b.norm() + solid.radius);
  return solid.kind == Kind::LevelSet ? S(0.02 * solid.grid->voxel()) : S(0);
}

// Where a point at x is after the solid has moved and taken it along.
template <class S>
typename Contacts<S>::Vec Contacts<S>::carried(const Solid& before, const Solid& after, const Vec& x) {
  if (before.kind == Kind::HalfSpace) return x + (after.radius - before.radius) * after.a;
  if (before.kind == Kind::Sphere || before.kind == Kind::LevelSet) return x + (after.a - before.a);
  if (before.kind == Kind::Box) {
    if (before.axes == after.axes) return x + (after.a - before.a);
    return after.a + after.axes * (before.axes.transpose() * (x - before.a));
  }
  const Vec old_axis = before.b - before.a, new_axis = after.b - after.a;
  const S old_length2 = old_axis.squaredNorm();
  if (old_axis == new_axis || old_length2 == 0 || new_axis.squaredNorm() == 0) return x + (after.a - before.a);
  const S along = (x - before.a).dot(old_axis) / old_length2;
  const Vec offset = x - before.a - along * old_axis;
  return after.a + along * new_axis + Eigen::Quaternion<S>::FromTwoVectors(old_axis, new_axis) * offset;
}

// The share of the way at which it enters a box, or infinity: first where it enters the box that holds
// the rounded one, then by Newton's method. The distance to a convex solid is convex along a line, so that
// Newton's steps from outside never pass the entry.
template <class S>
S Contacts<S>::box_entry(const Solid& solid, const Vec& from, const Vec& way) const {
  constexpr S kNever = std::numeric_limits<S>::infinity();
  const Vec place = solid.axes.transpose() * (from - solid.a), step = solid.axes.transpose() * way;
  S first = 0, last = 1;
  for (int k = 0; k < 3; ++k) {
    const S half = solid.b[k] + solid.radius;
    if (step[k] == 0) {
      if (std::abs(place[k]) > half) return kNever;
      continue;
    }
    const S low = (-half - place[k]) / step[k], high = (half - place[k]) / step[k];
    first = std::max(first, std::min(low, high));
    last = std::min(last, std::max(low, high));
  }
  if (first > last) return kNever;
  if (solid.radius == 0) return first;
  const S close = skin(solid);
  for (int round = 0; round < 50; ++round) {
    const Surface at = surface(solid, from + first * way);
    if (at.gap <= close) return first;
    const S slope = at.normal.dot(way);
    if (!(slope < 0)) return kNever;
    first -= at.gap / slope;
    if (first > last) return kNever;
  }
  return first;
}

// … a level set, by steps of the distance, and of half a voxel where that is more.
template <class S>
S Contacts<S>::grid_entry(const Solid& solid, const Vec& from, const Vec& way) const {
  constexpr S kNever = std::numeric_limits<S>::infinity();
  const S length = way.norm();
  if (length == 0) return kNever;
  Vec low, high;
  bounds(solid, low, high);
  S first = 0, last = 1;
  for (int k = 0; k < 3; ++k) {
    if (way[k] == 0) {
      if (from[k] < low[k] || from[k] > high[k]) return kNever;
      continue;
    }
    const S a = (low[k] - from[k]) / way[k], b = (high[k] - from[k]) / way[k];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  if (first > last) return kNever;
  const S least = S(0.5 * solid.grid->voxel()) / length;
  const auto outside = [&](S s) { return gap(solid, from + s * way) >= 0; };
  S s = first;
  bool was_outside = outside(s);
  // A start on the surface, but for rounding, that goes in.
  if (!was_outside && normal(solid, from + s * way).dot(way) < 0) return s;
  while (s < last) {
    const S next = std::min(s + std::max(clearance(solid, from + s * way, S(0)) / length, least), last);
    const bool is_outside = outside(next);
    if (was_outside && !is_outside) {
      S out = s, in = next;
      while (in - out > S(1e-3) * least) {
        const S middle = (in + out) / 2;
        if (!(middle > out && middle < in)) break;
        (outside(middle) ? out : in) = middle;
      }
      return out;
    }
    was_outside = is_outside;
    s = next;
  }
  return kNever;
}

// Where the way from `from` (outside) to `to` first enters the solid.
template <class S>
bool Contacts<S>::entry(const Solid& solid, const Vec& from, const Vec& to, Vec& hit) const {
  const Vec way = to - from;
  S first = std::numeric_limits<S>::infinity();
  if (solid.kind == Kind::Box) {
    first = box_entry(solid, from, way);
  } else if (solid.kind == Kind::LevelSet) {
    first = grid_entry(solid, from, way);
  } else if (solid.kind == Kind::HalfSpace) {
    const S start = solid.a.dot(from) - solid.radius, end = solid.a.dot(to) - solid.radius;
    if (start >= 0 && end < 0) first = start / (start - end);
  } else {
    first = std::min(sphere_entry<S>(from - solid.a, way, solid.radius),
                     sphere_entry<S>(from - solid.b, way, solid.radius));
    const Vec axis = solid.b - solid.a;
    const S length2 = axis.squaredNorm();
    if (length2 > 0) {
      const Vec d = from - solid.a;
      const Vec across = d - (d.dot(axis) / length2) * axis, sideways = way - (way.dot(axis) / length2) * axis;
      const S s = sphere_entry<S>(across, sideways, solid.radius);
      if (s <= 1) {
        const S along = (d + s * way).dot(axis) / length2;
        if (along >= 0 && along <= 1) first = std::min(first, s);
      }
    }
  }
  if (!(first <= 1)) return false;
  hit = from + first * way;
  return true;
}

// One candidate in one substep: x and v after a move that began at `from`.
template <class S>
void Contacts<S>::touch(Index point, const Solid& before, const Solid& after, const Vec& from, S move, S h, Vec& x,
                        Vec& v) {
  Surface at = surface(after, x);
  const S clear = at.gap >= 0 && after.kind == Kind::LevelSet ? clearance(after, x, at.gap) : at.gap;
  if (at.gap >= 0 && (x - from).norm() + move <= clear) return;  // cannot have been inside on the way
  const Vec start = carried(before, after, from);
  const S start_gap = gap(after, start);
  // Through, or so far on that the nearest surface may be the wrong one: go by where it went in.
  Vec hit;
  const S near = nearest_is_right(after);
  const bool far = at.gap >= 0 || (x - start).squaredNorm() > near * near;
  // What lies on a box has sunk in by rounding, and by what rounding left of its approach: little of its thickness.
  const S sunk = after.kind == Kind::Box
                     ? std::max(skin(after), std::min(S(0.2) * (after.b.minCoeff() + after.radius), S(1e-4)))
                     : skin(after);
  if (start_gap >= -sunk && far && after.kind != Kind::HalfSpace && entry(after, start, x, hit)) {
    const Vec outward = normal(after, hit);
    const S beyond = (x - hit).dot(outward);
    at = {beyond, outward};
  }
  if (at.gap >= 0) return;
  pushes_out_ = pushes_out_ || start_gap < S(-1e-4);
  const Vec& n = at.normal;
  // What starts outside ends outside; what starts inside leaves at no more than the push speed.
  const S target = std::min(S(0), std::min(S(0), start_gap) + S(kPushSpeed) * h);
  const S depth = std::max(S(0), target - at.gap);
  const Vec way = x - start;
  const Vec slide = way - way.dot(n) * n;
  const S slid = slide.norm();
  x += depth * n;
  if (slid > 0) x -= std::min(S(1), after.friction * depth / slid) * slide;

  const Vec solid_velocity = (start - from) / h;
  Vec relative = v - solid_velocity;
  const S approach = rub(n, after.friction, relative);
  v = solid_velocity + relative + after.restitution * approach * n;
  touches_.push_back({point, n, solid_velocity, after.friction});
}

template <class S>
void Contacts<S>::settle(Points<S>& v) const {
  for (const Touch& touch : touches_) {
    Vec relative = row(v, touch.point) - touch.solid_velocity;
    if (rub(touch.normal, touch.friction, relative) > 0) set_row<S>(v, touch.point, touch.solid_velocity + relative);
  }
}

// The solids at both ends of a substep.
template <class S>
void Contacts<S>::place_both(double t0, double t1) {
  if (t0 == before_ && t1 == now_) return;
  if (t0 != now_) place_solids(t0, solids_);
  std::swap(previous_, solids_);
  place_solids(t1, solids_);
  before_ = t0, now_ = t1;
}

// Distances and normals of all points from a user's solid.
template <class S>
void Contacts<S>::ask(const Collider& callback, double t, const Points<S>& x) {
  world_ = x.template cast<double>().rowwise() + origin_.transpose().array();
  distance_.setConstant(x.rows(), std::numeric_limits<double>::infinity());
  normal_.setZero(x.rows(), 3);
  callback.distance(t, world_, distance_, normal_);
}

template <class S>
void Contacts<S>::planes(double t0, const Points<S>& x, double t1, S reach, const Values<S>& inverse_mass,
                         std::vector<ContactPlane<S>>& out) {
  place_both(t0, t1);
  const S push = S(kPushSpeed) * S(t1 - t0);
  // What is inside stays so unless it is pushed out.
  const auto leave = [&](S gap) { return gap < 0 ? std::max(gap, -push) : gap; };
  for (const Candidate& candidate : candidates_) {
    const Index i = candidate.point;
    if (inverse_mass[i] == 0) continue;
    const Solid &before = previous_[std::size_t(candidate.solid)], &after = solids_[std::size_t(candidate.solid)];
    const Vec from = row(x, i), start = carried(before, after, from);
    if (after.kind == Kind::LevelSet && clearance(after, start, reach) > reach) continue;
    Surface at = surface(after, start);
    if (!(at.gap <= reach)) continue;
    if (after.kind == Kind::LevelSet) at.normal = normal(after, start);
    out.push_back({i, at.normal, leave(at.gap), start - from, after.friction, after.restitution});
  }
  for (const Collider* collider : callbacks_) {
    ask(*collider, t1, x);
    for (Index i = 0; i < x.rows(); ++i) {
      const double gap = distance_[i] - double(thickness_);
      if (inverse_mass[i] == 0 || !(gap <= double(reach))) continue;
      out.push_back({i, normal_.row(i).matrix().transpose().template cast<S>(), leave(S(gap)), Vec(0, 0, 0),
                     S(collider->friction), S(collider->restitution)});
    }
  }
}

template <class S>
void Contacts<S>::resolve(double t0, const Points<S>& from, double t1, const Values<S>& inverse_mass, Points<S>& x,
                          Points<S>& v) {
  place_both(t0, t1);
  const S h = S(t1 - t0);
  touches_.clear();
  pushes_out_ = false;
  if (!solids_.empty()) {
    // Somebody was thrown farther than a tick's bound: look again from where this substep began.
    if (((x - start_).square().rowwise().sum() > reach_.square()).any()) {
      std::swap(previous_, solids_);
      average_velocity_ = (x - from) / h;
      find_candidates(from, average_velocity_, std::max(tick_end_ - t0, t1 - t0));
      std::swap(previous_, solids_);
    }
    int last = -1;
    S move = 0;
    for (const Candidate& candidate : candidates_) {
      const Index i = candidate.point;
      if (inverse_mass[i] == 0) continue;
      const Solid &before = previous_[std::size_t(candidate.solid)], &after = solids_[std::size_t(candidate.solid)];
      if (candidate.solid != last) {
        last = candidate.solid;
        move = moved(before, after);
      }
      Vec place = row(x, i), velocity = row(v, i);
      touch(i, before, after, row(from, i), move, h, place, velocity);
      set_row(x, i, place);
      set_row(v, i, velocity);
    }
  }
  for (const Collider* collider : callbacks_) {
    ask(*collider, t1, x);
    Solid solid;  // a plane through the nearest surface point, for this point and moment
    solid.kind = Kind::HalfSpace;
    solid.friction = S(collider->friction);
    solid.restitution = S(collider->restitution);
    for (Index i = 0; i < x.rows(); ++i) {
      if (inverse_mass[i] == 0 || !(distance_[i] < double(thickness_))) continue;
      Vec place = row(x, i), velocity = row(v, i);
      solid.a = normal_.row(i).matrix().transpose().template cast<S>();
      solid.radius = solid.a.dot(place) - S(distance_[i]) + thickness_;
      touch(i, solid, solid, row(from, i), S(0), h, place, velocity);
      set_row(x, i, place);
      set_row(v, i, velocity);
    }
  }
}

template class Contacts<float>;
template class Contacts<double>;

}  // namespace hooke
