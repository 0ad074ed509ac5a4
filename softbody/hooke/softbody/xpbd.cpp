#include <hooke/softbody/xpbd.hpp>

#include <hooke/softbody/spring_field.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <tuple>

namespace hooke::softbody {

namespace {

constexpr double kDefaultStep = 1.0 / 1200;  // [s]

// What a spring carries to the next substep follows its force within this time [s], where that is safe.
constexpr double kFollow = 0.3;
// It is safe where what moves has less than this share of the energy that is yet to be made up, for some time [s].
constexpr double kQuiet = 0.02, kQuietTime = 0.5;
// What has less than this share of it left does not swing, and is forgotten within this time [s].
constexpr double kStill = 1e-4, kStillTime = 0.03;
// … and otherwise as far as it brings in no more than this share of what is lost.
constexpr double kShareOfLoss = 0.5;
// The largest carried force, in l / (h² (w_a + w_b)); at 30, a heavy corner at steps of 1/60 s grew without bound.
constexpr double kLargestCarried = 2;

template <class S>
struct alignas(4 * sizeof(S)) Record {  // a point: coordinates and inverse mass
  S x, y, z, w;
};

template <class S>
struct Link {  // a spring
  int a, b;
  S stiffness, rest, damping, compliance;  // compliance: 0 where there is no stiffness
};

template <class S>
struct Contact {  // of a point with a plane; corrections of the displacement
  S pushed = 0;
  Eigen::Matrix<S, 3, 1> rubbed{0, 0, 0};
  S approach = 0;  // [m/s] before the substep
};

template <class S>
class XpbdBody final : public PointBody<S> {
  using Base = PointBody<S>;
  using Base::points_;
  using Base::tick_;

 public:
  XpbdBody(std::string name, PointMasses<S> points, const MotionSettings& settings, bool automatic,
           std::shared_ptr<const SpringNetwork> network)
      : Base(std::move(name), std::move(points), settings), automatic_(automatic) {
    const Index n = points_.size();
    low_.setZero(n, 3);
    start_.resize(std::size_t(n)), way_.resize(std::size_t(n));
    if (network && !network->springs.empty()) {
      field_.emplace(network, points_.position);
      lay_out_springs(*network);
    }
  }

  bool fused() const override { return false; }
  using Base::stable_step;
  double stable_step(const Method& method) const override {
    if (&method == &xpbd()) return std::numeric_limits<double>::infinity();
    if (!field_) return Base::stable_step(method);
    const auto rates = field_->rate_bounds(points_.position, points_.velocity, points_.inverse_mass);
    return std::min(Base::stable_step(method),
                    largest_stable_step(method, std::sqrt(rates.omega_squared), rates.gamma));
  }
  MotionFacts motion_facts() const override {
    MotionFacts facts = Base::motion_facts();
    facts.evaluations = sweeps_;
    if (automatic_) facts.wanted_dt = 0;
    facts.velocity_forces = facts.velocity_forces || (field_ && field_->uses_velocity());
    return facts;
  }
  Energy energy(const Vec3& gravity) const override {
    Energy energy = Base::energy(gravity);
    if (field_) energy.elastic += field_->potential_energy(points_.position);
    return energy;
  }
  void set_position(Index point, const Vec3& position) override {
    Base::set_position(point, position);
    low_.row(point).setZero();
  }
  void pin(Index point) override {
    Base::pin(point);
    gain_step_ = 0;
  }
  void release(Index point) override {
    Base::release(point);
    gain_step_ = 0;
  }
  void drive_pins(std::vector<Index> points, PinMotion motion) override {
    Base::drive_pins(std::move(points), std::move(motion));
    gain_step_ = 0;
  }
  void describe(Blueprint& out) const override {
    Base::describe(out);
    out.add("iterations", Index(this->settings().iterations));
    if (field_) field_->describe(out);
  }
  void save(CheckpointWriter& out) const override {
    Base::save(out);
    out.begin("xpbd");
    out.add(low_);
    out.add(memory_.force);
    out.add(memory_.carried);
    for (const double value : {memory_.follow, memory_.kinetic, memory_.lost, memory_.held}) out.add(value);
    out.add(std::int64_t(memory_.substeps));
    out.add(sweeps_);
    out.end();
  }
  void load(CheckpointReader& in) override {
    Base::load(in);
    in.begin("xpbd");
    in.array("rounding of positions", low_, points_.size());
    in.array("forces", memory_.force, Index(links_.size()));
    in.array("carried forces", memory_.carried, Index(links_.size()));
    memory_.follow = in.number<double>("share that follows", 0, 1);
    memory_.kinetic = in.number<double>("kinetic energy", 0);
    memory_.lost = in.number<double>("lost energy", 0);
    memory_.held = in.number<double>("held energy", 0);
    memory_.substeps = Index(in.number<std::int64_t>("substeps", 0));
    sweeps_ = in.number<std::int64_t>("sweeps", 0);
    in.end();
    gain_step_ = 0;
  }
  StepReport advance(const Tick& tick) override {
    before_ = memory_;
    before_low_ = low_;
    return Base::advance(tick);
  }
  void take_back() override {
    Base::take_back();
    if (before_low_.rows() != low_.rows()) return;
    memory_ = before_;
    low_ = before_low_;
  }
  void damp(double factor) override {
    if (factor < 1) memory_.lost += (1 - factor * factor) * memory_.kinetic;
    Base::damp(factor);
  }

 protected:
  SolveResult substep(double t, double h) override {
    const bool touching = this->collides();
    if (touching || this->prescribes()) from_ = points_.position;
    begin(t, h);
    planes_.clear(), contacts_.clear();
    if (touching) find_planes(t, S(h));
    prepare_gains(h);
    push_by_carried();
    keep_out();
    const int sweeps = this->settings().iterations;
    for (int i = 0; i < sweeps; ++i) {
      sweep();
      keep_out();
    }
    ++memory_.substeps;
    sweeps_ += sweeps;
    finish(S(h));
    if (touching) {
      bounce(S(h));
      this->collide(t, from_, t + h, points_.position, points_.velocity);
    }
    if (t + 1.5 * h > tick_.end) judge(h);
    return {};
  }
  void still_acceleration(const Points<S>& x, const Points<S>& still, double t, Points<S>& a) override {
    Base::still_acceleration(x, still, t, a);
    if (!field_) return;
    still_force_.setZero(x.rows(), 3);
    if (&x == &points_.position)
      field_->add_fine_force(x, low_, still, t, still_force_);
    else
      field_->add_force(x, still, t, still_force_);
    a += still_force_.colwise() * points_.inverse_mass;
  }
  // What planes bear that the sweeps have met.
  void settle(Points<S>& v) override {
    Base::settle(v);
    for (std::size_t i = 0; i < planes_.size(); ++i) {
      if (!(contacts_[i].pushed > 0)) continue;
      const ContactPlane<S>& plane = planes_[i];
      Vec value = row(v, plane.point);
      if (rub<S>(plane.normal, plane.friction, value) > 0) set_row<S>(v, plane.point, value);
    }
  }

 private:
  using Vec = Eigen::Matrix<S, 3, 1>;

  // What goes on from substep to substep.
  struct Memory {
    Values<S> force, carried;  // [N], along the springs, > 0 pulls
    double follow = 0;         // share of what is missing that is carried on, a substep
    double kinetic = 0, lost = 0, held = 0;
    Index substeps = 0;
  };

  void lay_out_springs(const SpringNetwork& network);
  void prepare_gains(double h);
  void begin(double t, double step);
  void soften_drag(S h);
  void find_planes(double t, S h);
  void push_by_carried();
  void sweep();
  void keep_out();
  void finish(S h);
  void bounce(S h);
  void judge(double h);

  bool automatic_;
  std::optional<SpringField<S>> field_;  // for energy and bounds
  std::vector<Link<S>> links_;
  Values<S> gain_, damping_gain_;  // 1 / (1 + h² (k + c/h) (w_a + w_b)) and c/h
  double gain_step_ = 0;           // the h of gain_; 0: stale
  std::vector<Record<S>> start_, way_;
  Memory memory_, before_;
  Points<S> low_, before_low_;  // what positions are rounded by
  Points<S> from_, acceleration_, still_force_, from_damping_, pin_x_, pin_v_;
  Values<S> drag_;
  bool moving_pins_ = false;
  std::vector<ContactPlane<S>> planes_;
  std::vector<Contact<S>> contacts_;
  std::int64_t sweeps_ = 0;
};

// Springs between points that are `s` numbers apart come in two groups, by the parity of a / s: within a group no two
// share a point, so that the processor may work on several at once.
template <class S>
void XpbdBody<S>::lay_out_springs(const SpringNetwork& network) {
  const std::vector<double> rest = rest_lengths(network, points_.position.template cast<double>());
  for (std::size_t i = 0; i < network.springs.size(); ++i) {
    const Spring& spring = network.springs[i];
    Link<S> link;
    std::tie(link.a, link.b) = std::minmax(spring.a, spring.b);
    link.stiffness = S(spring.stiffness);
    link.damping = S(spring.damping);
    link.compliance = link.stiffness > 0 ? 1 / link.stiffness : S(0);
    link.rest = S(rest[i]);
    if (spring.rest_length == Spring::kFromStart) {  // by the sweep's own operations: zero at rest
      const S dx = points_.position(link.b, 0) - points_.position(link.a, 0),
              dy = points_.position(link.b, 1) - points_.position(link.a, 1),
              dz = points_.position(link.b, 2) - points_.position(link.a, 2);
      link.rest = std::sqrt(dx * dx + dy * dy + dz * dz);
    }
    links_.push_back(link);
  }
  const auto key = [](const Link<S>& link) {
    const int s = link.b - link.a;
    return std::tuple(s, link.a / s % 2, link.a);
  };
  std::stable_sort(links_.begin(), links_.end(),
                   [&](const Link<S>& one, const Link<S>& other) { return key(one) < key(other); });
  const Index n = Index(links_.size());
  memory_.force.setZero(n), memory_.carried.setZero(n);
  gain_.resize(n), damping_gain_.resize(n);
}

template <class S>
void XpbdBody<S>::prepare_gains(double h) {
  if (gain_step_ == h) return;
  gain_step_ = h;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link<S>& link = links_[i];
    const double w = double(points_.inverse_mass[link.a]) + double(points_.inverse_mass[link.b]);
    gain_[Index(i)] = w > 0 ? S(1 / (1 + h * (h * double(link.stiffness) + double(link.damping)) * w)) : S(0);
    damping_gain_[Index(i)] = S(double(link.damping) / h);
  }
}

// Drag acts explicitly. Where it could stop a point within the substep it is held back as backward Euler would, each
// point by itself: a / (1 + h d w), d the largest drag of a common motion along an axis.
template <class S>
void XpbdBody<S>::soften_drag(S h) {
  const Index n = points_.size();
  still_force_.setZero(n, 3);
  drag_.setZero(n);
  for (int k = 0; k < 3; ++k) {
    from_damping_.setZero(n, 3);
    still_force_.setZero(n, 3);
    still_force_.col(k).setConstant(1 / h);
    this->add_implicit_times(points_.position, points_.velocity, h, true, still_force_, from_damping_);
    drag_ = drag_.max(from_damping_.square().rowwise().sum().sqrt());
  }
  // Gravity is no drag.
  for (int k = 0; k < 3; ++k) {
    const S g = S(tick_.gravity[k]);
    acceleration_.col(k) = (points_.inverse_mass > S(0))
                               .select(g + (acceleration_.col(k) - g) / (1 + h * drag_ * points_.inverse_mass), S(0));
  }
}

// Where points would go without springs and contacts.
template <class S>
void XpbdBody<S>::begin(double t, double step) {
  const S h = S(step);
  const Points<S>&x = points_.position, &v = points_.velocity;
  const bool forces = this->other_forces();
  if (forces) this->acceleration(x, v, t, acceleration_);
  if (forces && this->uses_velocity()) soften_drag(h);
  S g[3];
  for (int k = 0; k < 3; ++k) g[k] = h * S(tick_.gravity[k]);
  for (Index i = 0; i < x.rows(); ++i) {
    const S w = points_.inverse_mass[i];
    start_[std::size_t(i)] = {x(i, 0), x(i, 1), x(i, 2), w};
    Record<S>& way = way_[std::size_t(i)];
    way = {0, 0, 0, h * h * w};
    if (w == 0) continue;
    if (forces)
      for (int k = 0; k < 3; ++k) g[k] = h * acceleration_(i, k);
    way.x = h * (v(i, 0) + g[0]), way.y = h * (v(i, 1) + g[1]), way.z = h * (v(i, 2) + g[2]);
  }
  moving_pins_ = this->prescribes();
  if (!moving_pins_) return;
  pin_x_ = x, pin_v_ = v;
  this->prescribe(t, from_, t + step, pin_x_, pin_v_);
  for (Index i = 0; i < x.rows(); ++i)
    if (points_.inverse_mass[i] == 0) {
      Record<S>& way = way_[std::size_t(i)];
      way.x = pin_x_(i, 0) - x(i, 0), way.y = pin_x_(i, 1) - x(i, 1), way.z = pin_x_(i, 2) - x(i, 2);
    }
}

// What the sweeps missed before: so that a state at rest needs no sweep at all.
template <class S>
void XpbdBody<S>::push_by_carried() {
  const S follow = S(memory_.follow);
  const S limit = S(kLargestCarried);
  Record<S>* way = way_.data();
  const Record<S>* start = start_.data();
  S *carried = memory_.carried.data(), *force = memory_.force.data();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link<S>& link = links_[i];
    if (link.compliance == S(0)) {
      force[i] = 0;
      continue;
    }
    Record<S>&a = way[link.a], &b = way[link.b];
    const Record<S>&from = start[link.a], &to = start[link.b];
    const S inertia = a.w + b.w;  // times h²
    const S dx = to.x - from.x, dy = to.y - from.y, dz = to.z - from.z;
    const S square = dx * dx + dy * dy + dz * dz, length = std::sqrt(square);
    S f = carried[i] + follow * (force[i] - carried[i]);
    const S most = inertia > 0 ? limit * length / inertia : S(0);
    f = std::clamp(f, -most, most);
    carried[i] = force[i] = f;
    if (!(length > 0)) continue;
    // Along the spring as it will be at the end: across, the pull itself brings the ends back into line.
    const S mx = b.x - a.x, my = b.y - a.y, mz = b.z - a.z;
    const S turn = 1 / (length + std::max(f, S(0)) * inertia);
    const S share = f * (1 / length - turn * (dx * mx + dy * my + dz * mz) / square), across = f * turn;
    const S fx = share * dx + across * mx, fy = share * dy + across * my, fz = share * dz + across * mz;
    a.x += a.w * fx, a.y += a.w * fy, a.z += a.w * fz;
    b.x -= b.w * fx, b.y -= b.w * fy, b.z -= b.w * fz;
  }
}

template <class S>
void XpbdBody<S>::sweep() {
  Record<S>* way = way_.data();
  const Record<S>* start = start_.data();
  const S *gain = gain_.data(), *damping = damping_gain_.data();
  S* force = memory_.force.data();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link<S>& link = links_[i];
    Record<S>&a = way[link.a], &b = way[link.b];
    const Record<S>&from = start[link.a], &to = start[link.b];
    const S mx = b.x - a.x, my = b.y - a.y, mz = b.z - a.z;
    const S dx = to.x - from.x + mx, dy = to.y - from.y + my, dz = to.z - from.z + mz;
    const S length = std::sqrt(dx * dx + dy * dy + dz * dz);
    const S inverse = length > 0 ? 1 / length : S(0);
    const S nx = dx * inverse, ny = dy * inverse, nz = dz * inverse;
    const S wanted = link.stiffness * (length - link.rest) + damping[i] * (nx * mx + ny * my + nz * mz);
    const S more = length > 0 ? gain[i] * (wanted - force[i]) : S(0);
    force[i] += more;
    const S pa = a.w * more, pb = b.w * more;
    a.x += pa * nx, a.y += pa * ny, a.z += pa * nz;
    b.x -= pb * nx, b.y -= pb * ny, b.z -= pb * nz;
  }
}

template <class S>
void XpbdBody<S>::find_planes(double t, S h) {
  S fastest = 0;
  for (const Record<S>& way : way_) fastest = std::max(fastest, way.x * way.x + way.y * way.y + way.z * way.z);
  planes_.clear();
  this->planes(t, points_.position, t + double(h), 2 * std::sqrt(fastest) + S(1e-3), planes_);
  contacts_.assign(planes_.size(), {});
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const ContactPlane<S>& plane = planes_[i];
    const Vec v = points_.velocity.row(plane.point).matrix().transpose();
    contacts_[i].approach = plane.normal.dot(plane.carried / h - v);
  }
}

// Planes may push and, by Coulomb's law, rub.
template <class S>
void XpbdBody<S>::keep_out() {
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const ContactPlane<S>& plane = planes_[i];
    Contact<S>& contact = contacts_[i];
    Record<S>& point = way_[std::size_t(plane.point)];
    Vec way = Vec(point.x, point.y, point.z) - plane.carried;
    const S more = std::max(-(plane.normal.dot(way) + plane.gap), -contact.pushed);
    contact.pushed += more;
    way += more * plane.normal;
    if (plane.friction > 0 && (contact.pushed > 0 || contact.rubbed != Vec::Zero())) {
      const Vec slide = way - plane.normal.dot(way) * plane.normal;
      Vec rubbed = contact.rubbed - slide;
      const S most = plane.friction * contact.pushed, size = rubbed.norm();
      if (size > most) rubbed *= most / size;
      way += rubbed - contact.rubbed;
      contact.rubbed = rubbed;
    }
    way += plane.carried;
    point.x = way[0], point.y = way[1], point.z = way[2];
  }
}

// Positions in two parts each, so that ways below their rounding are not lost.
template <class S>
void XpbdBody<S>::finish(S h) {
  const S rate = 1 / h;
  double kinetic = 0, lost = 0;
  for (Index i = 0; i < points_.size(); ++i) {
    if (points_.inverse_mass[i] == 0) continue;
    const Record<S>& record = way_[std::size_t(i)];
    const S way[3] = {record.x, record.y, record.z};
    S square = 0, change = 0;
    for (int k = 0; k < 3; ++k) {
      S &x = points_.position(i, k), &low = low_(i, k), &v = points_.velocity(i, k);
      const S add = way[k] + low, sum = x + add, part = sum - x;
      low = (x - (sum - part)) + (add - part);
      x = sum;
      const S now = rate * way[k];
      square += now * now;
      change += (now - v) * (now - v);
      v = now;
    }
    kinetic += 0.5 * double(points_.mass[i]) * double(square);
    lost += 0.5 * double(points_.mass[i]) * double(change);
  }
  memory_.kinetic = kinetic;
  memory_.lost += lost;
  if (!moving_pins_) return;
  for (Index i = 0; i < points_.size(); ++i)
    if (points_.inverse_mass[i] == 0) points_.position.row(i) = pin_x_.row(i), points_.velocity.row(i) = pin_v_.row(i);
}

// Restitution, for what came faster than what presses it against the surface would make it in a substep or two.
template <class S>
void XpbdBody<S>::bounce(S h) {
  const S resting = 4 * h * S(tick_.gravity.norm());
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const ContactPlane<S>& plane = planes_[i];
    const Contact<S>& contact = contacts_[i];
    if (!(plane.restitution > 0 && contact.pushed > 0 && contact.approach > resting)) continue;
    Vec v = points_.velocity.row(plane.point).matrix().transpose();
    const S leaving = plane.normal.dot(v - plane.carried / h);
    v += std::max(S(0), plane.restitution * contact.approach - leaving) * plane.normal;
    points_.velocity.row(plane.point) = v.transpose().array();
  }
}

// How much the carried forces may follow in the coming tick. Carrying on what was missed brings in energy: the
// springs' lag pushes what swings. So it must be less than what the substeps lose, except where hardly anything moves.
template <class S>
void XpbdBody<S>::judge(double h) {
  if (links_.empty()) return;
  double missing = 0, brought = 0;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link<S>& link = links_[i];
    const double dx = double(points_.position(link.b, 0) - points_.position(link.a, 0)),
                 dy = double(points_.position(link.b, 1) - points_.position(link.a, 1)),
                 dz = double(points_.position(link.b, 2) - points_.position(link.a, 2));
    const double stretch = std::sqrt(dx * dx + dy * dy + dz * dz) - double(link.rest);
    if (link.compliance == S(0)) continue;
    const double force = double(memory_.force[Index(i)]), carried = double(memory_.carried[Index(i)]);
    brought += std::abs((force - carried) * (stretch - double(link.compliance) * force));
    missing += (force - carried) * (stretch - double(link.compliance) * carried);
  }
  const double tick = h * double(memory_.substeps), lost = memory_.lost / double(memory_.substeps);
  const double forget = memory_.kinetic < kStill * memory_.held ? kStillTime : kQuietTime;
  memory_.held = std::max(memory_.kinetic, memory_.held * std::exp(-tick / forget));
  const double most = std::min(1.0, h / kFollow);
  memory_.follow = 0;
  if (missing > 0) {
    const double quiet = std::clamp(2 - memory_.held / (kQuiet * missing), 0.0, 1.0);
    const double paid = brought > 0 ? std::min(most, kShareOfLoss * lost / brought) : most;
    memory_.follow = std::max(quiet * most, paid);
  }
  memory_.lost = 0;
  memory_.substeps = 0;
}

}  // namespace

const Method& xpbd() {
  static const Method method = [] {
    Method m = implicit_euler();
    m.name = "xpbd";
    m.order = 1;
    m.evaluations = 1;
    return m;
  }();
  return method;
}

template <class S>
std::unique_ptr<PointBody<S>> make_xpbd_body(std::string name, PointMasses<S> points, const MotionSettings& settings,
                                             std::shared_ptr<const SpringNetwork> network) {
  if (settings.iterations < 0)
    throw std::invalid_argument("body \"" + name + "\": iterations must not be negative, got " +
                                std::to_string(settings.iterations));
  MotionSettings complete = settings;
  const bool automatic = settings.dt == 0;
  if (automatic) complete.dt = kDefaultStep;
  if (complete.iterations == 0) complete.iterations = kXpbdIterations;
  return std::make_unique<XpbdBody<S>>(std::move(name), std::move(points), complete, automatic, std::move(network));
}

template std::unique_ptr<PointBody<float>> make_xpbd_body(std::string, PointMasses<float>, const MotionSettings&,
                                                          std::shared_ptr<const SpringNetwork>);
template std::unique_ptr<PointBody<double>> make_xpbd_body(std::string, PointMasses<double>, const MotionSettings&,
                                                           std::shared_ptr<const SpringNetwork>);

}  // namespace hooke::softbody
