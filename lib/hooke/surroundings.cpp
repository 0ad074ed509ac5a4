#include <hooke/surroundings.hpp>

#include <limits>

namespace hooke {

namespace {

// Solids farther away than this have no part in a rest [m].
constexpr double kNear = 0.01;

bool same(const Shape& a, const Shape& b) {
  if (a.index() != b.index()) return false;
  if (const auto* p = std::get_if<HalfSpace>(&a)) {
    const auto& q = std::get<HalfSpace>(b);
    return p->normal == q.normal && p->offset == q.offset;
  }
  if (const auto* p = std::get_if<Sphere>(&a)) {
    const auto& q = std::get<Sphere>(b);
    return p->center == q.center && p->radius == q.radius;
  }
  if (const auto* p = std::get_if<Capsule>(&a)) {
    const auto& q = std::get<Capsule>(b);
    return p->a == q.a && p->b == q.b && p->radius == q.radius;
  }
  if (const auto* p = std::get_if<Box>(&a)) {
    const auto& q = std::get<Box>(b);
    return p->center == q.center && p->half_extent == q.half_extent && p->axes == q.axes;
  }
  const auto &p = std::get<LevelSet>(a), &q = std::get<LevelSet>(b);
  return p.grid == q.grid && p.offset == q.offset;
}

}  // namespace

// A shape cannot be nearer to a point of the body than it is to its centre, less the body's reach.
bool Surroundings::near(const Shape& shape) const { return signed_distance(shape, center_) < reach_; }

void Surroundings::remember(std::span<const Collider> colliders, double t, const Points<double>& points,
                            double thickness) {
  points_ = points;
  center_ = points.rows() ? Vec3(points.colwise().mean().matrix().transpose()) : Vec3(0, 0, 0);
  margin_ = reach_ = thickness + kNear;
  for (Index i = 0; i < points.rows(); ++i)
    reach_ = std::max(reach_, margin_ + (points.row(i).matrix().transpose() - center_).norm());
  colliders_ = colliders.size();
  shapes_.clear();
  distances_.clear();
  for (const Collider& collider : colliders) {
    if (collider.distance) {
      normal_.setZero(points.rows(), 3);
      distances_.emplace_back(Values<double>::Constant(points.rows(), std::numeric_limits<double>::infinity()));
      collider.distance(t, points_, distances_.back(), normal_);
    } else if (collider.motion) {
      shapes_.push_back(collider.shapes);
      collider.motion(t, shapes_.back());
    }
  }
}

bool Surroundings::changed(std::span<const Collider> colliders, double t) {
  if (colliders.size() != colliders_) return true;
  std::size_t moving = 0, callback = 0;
  for (const Collider& collider : colliders) {
    if (collider.distance) {
      if (callback == distances_.size()) return true;
      const Values<double>& before = distances_[callback++];
      normal_.setZero(points_.rows(), 3);
      distance_.setConstant(points_.rows(), std::numeric_limits<double>::infinity());
      collider.distance(t, points_, distance_, normal_);
      if ((before.min(distance_) < margin_ && before != distance_).any()) return true;
    } else if (collider.motion) {
      if (moving == shapes_.size() || shapes_[moving].size() != collider.shapes.size()) return true;
      std::vector<Shape>& before = shapes_[moving++];
      now_ = collider.shapes;
      collider.motion(t, now_);
      for (std::size_t i = 0; i < now_.size(); ++i)
        if (!same(before[i], now_[i]) && (near(before[i]) || near(now_[i]))) return true;
      before.swap(now_);
    }
  }
  return false;
}

}  // namespace hooke
