#include <hooke/particles/particle_system.hpp>

#include <hooke/integrator.hpp>
#include <hooke/particles/solids.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hooke::particles {

namespace {

// Tiles that a thread takes at a time: long enough a run for the processor to read ahead.
constexpr Index kTilesAtOnce = 16;

// A life that ends with the tick but for rounding does.
double last_moment(const Tick& tick) { return tick.end + 1e-9 * (tick.end - tick.start); }

template <class S>
Vec3 row(const Points<S>& p, Index i) {
  return p.row(i).matrix().transpose().template cast<double>();
}

template <class S>
void set_row(Points<S>& p, Index i, const Vec3& value) {
  p.row(i) = value.transpose().array().template cast<S>();
}

// v ← v + gain v + add + share a over q seconds of dv/dt = acceleration + a - rate v: exact for constant a.
template <class S>
struct Push {
  Kick<S> kick;
  S share;
};
template <class S>
Push<S> push_of(const typename Force<S>::Uniform& uniform, double q) {
  const double z = uniform.rate * q;
  const double share = z != 0 ? -std::expm1(-z) / uniform.rate : q;
  Push<S> push;
  push.kick.gain = S(std::expm1(-z));
  for (int k = 0; k < 3; ++k) push.kick.add[k] = S(share * uniform.acceleration[k]);
  push.share = S(share);
  return push;
}

const Splitting* splitting_of(const Method& method) {
  // Verlet's increments are h times the velocities in the middle of steps: the same numbers.
  if (std::holds_alternative<Verlet>(method.scheme)) return &std::get<Splitting>(velocity_verlet().scheme);
  return std::get_if<Splitting>(&method.scheme);
}

void check_settings(const ParticleSettings& s) {
  const auto fail = [&](const std::string& rule) {
    throw std::invalid_argument("particles \"" + s.name + "\": " + rule);
  };
  if (!s.origin.allFinite()) fail("origin must be finite");
  if (!s.method) fail("needs a method");
  if (!(s.dt >= 0) || !std::isfinite(s.dt)) fail("dt must not be negative, got " + std::to_string(s.dt) + " s");
  if (!(s.tolerance > 0) || !std::isfinite(s.tolerance))
    fail("tolerance must be positive, got " + std::to_string(s.tolerance) + " m");
  if (s.capacity < 1) fail("capacity must be 1 or more, got " + std::to_string(s.capacity));
  if (!(s.radius >= 0) || !std::isfinite(s.radius))
    fail("radius must not be negative, got " + std::to_string(s.radius) + " m");
  if (!(s.restitution >= 0 && s.restitution <= 1))
    fail("restitution must be from 0 to 1, got " + std::to_string(s.restitution));
  if (!(s.rest_speed >= 0) || !std::isfinite(s.rest_speed))
    fail("rest_speed must not be negative, got " + std::to_string(s.rest_speed));
  if (!(s.prewarm >= 0) || !std::isfinite(s.prewarm))
    fail("prewarm must not be negative, got " + std::to_string(s.prewarm) + " s");
  if (s.trail < 0 || s.trail > 255) fail("trail must be from 0 to 255, got " + std::to_string(s.trail));
  if (s.tile < 32 || s.tile % 32 != 0) fail("tile must be a multiple of 32, got " + std::to_string(s.tile));
  for (const Kind& kind : s.kinds) kind.color.check();
}

}  // namespace

template <class S>
struct ParticleSystem<S>::Particle {
  Vec3 position, velocity, previous_position, previous_velocity;
  S inverse_mass = 1;
  double death = 0, lifetime = 0;
  float size = 0;
  std::uint64_t serial = 0;
  std::uint32_t slot = 0;
  std::uint8_t kind = 0;
  Vec3 birth_place;
};

template <class S>
struct ParticleSystem<S>::Removed {
  Index index;
  Particle particle;
};

// What is the same for all tiles of a tick.
template <class S>
struct ParticleSystem<S>::Plan {
  struct Stage {
    double closing = 0, opening = 0;  // kick, before and after the boundary of steps [s]
    double time = 0;                  // of the kick
  };
  enum class Way { Fused, Staged, Integrated };

  Way way = Way::Fused;
  bool exact = false, varies = false, velocity = false, hits = false;
  double start = 0, end = 0, h = 0;
  int steps = 1;
  int runs = 1, legs_a_run = 1;  // with exact impacts every step is a run of its own
  typename Force<S>::Uniform uniform;
  Vec3 origin;
  std::vector<Stage> stages;  // one a leg, and one for the last kick of each run
  std::vector<Leg<S>> legs;
  std::vector<Kick<S>> last;  // one a run
  std::vector<double> ends;
  Solids<S> solids;
};

template <class S>
struct ParticleSystem<S>::Worker {
  std::vector<S> memory;
  std::vector<S> marks;
  S *a[3], *predicted[3], *x0[3], *v0[3];
  std::vector<Hit<S>> hits;
  std::vector<Event> events;
  bool finite = true;
  Points<S> x, v;
  std::unique_ptr<Integrator<S>> integrator;

  explicit Worker(Index tile) {
    const std::size_t each = std::size_t(tile) + std::size_t(Tile<S>::kLanes);
    memory.assign(12 * each, S(0));
    marks.assign(each, S(1));
    hits.reserve(4 * each), events.reserve(4 * each);
    S* at = memory.data();
    for (auto* arrays : {a, predicted, x0, v0})
      for (int k = 0; k < 3; ++k, at += each) arrays[k] = at;
  }
};

namespace {

// One tile as a problem for the core's integrator.
template <class S, class Accelerate, class Solid>
class TileDynamics final : public Dynamics<S> {
 public:
  TileDynamics(Accelerate accelerate, Solid* solid) : accelerate_(accelerate), solid_(solid) {}
  void set(double inverse_mass, Index rows, const S* masses) {
    inverse_mass_.resize(rows), mass_.resize(rows);
    for (Index i = 0; i < rows; ++i) {
      inverse_mass_[i] = masses ? masses[i] : S(inverse_mass);
      if (!(inverse_mass_[i] > 0)) inverse_mass_[i] = 1;
      mass_[i] = 1 / inverse_mass_[i];
    }
  }
  bool uses_velocity_now = false;
  double time = 0;  // of the step's end [s]
  bool uses_velocity() const override { return uses_velocity_now; }
  void acceleration(const Points<S>& x, const Points<S>& v, double t, Points<S>& a) override {
    accelerate_(x, v, t, a);
  }
  void prescribe(double, const Points<S>&, double, Points<S>&, Points<S>&) override {}
  bool prescribes() const override { return false; }
  void collide(double t0, const Points<S>& from, double t1, Points<S>& x, Points<S>& v) override {
    solid_->collide(t0, from, t1, x, v);
  }
  void settle(Points<S>& v) override { solid_->settle(v); }
  bool collides() const override { return solid_->collides(); }
  const Values<S>& mass() const override { return mass_; }
  const Values<S>& inverse_mass() const override { return inverse_mass_; }
  // h²K d + hD d by a difference of accelerations along (h d, d): forces need no derivatives of their own.
  void add_implicit_times(const Points<S>& x, const Points<S>& v, S h, bool, const Points<S>& d,
                          Points<S>& out) override {
    const S size = d.abs().maxCoeff();
    if (size == 0) return;
    const S scale = std::max(v.abs().maxCoeff(), S(1e-3));
    const S step = (sizeof(S) == 4 ? S(3e-3) : S(1e-6)) * scale / size;
    x_ = x + (step * h) * d, v_ = v + step * d;
    accelerate_(x_, v_, time, ahead_);
    x_ = x - (step * h) * d, v_ = v - step * d;
    accelerate_(x_, v_, time, behind_);
    out -= (h / (2 * step)) * ((ahead_ - behind_).colwise() * mass_);
  }

 private:
  Accelerate accelerate_;
  Solid* solid_;
  Values<S> mass_, inverse_mass_;
  Points<S> x_, v_, ahead_, behind_;
};

}  // namespace

// ---- Set-up

template <class S>
ParticleSystem<S>::ParticleSystem(ParticleSettings settings) : Body(settings.name), settings_(std::move(settings)) {
  check_settings(settings_);
  const Index n = settings_.capacity;
  // Columns that do not share their place in the caches' sets.
  const Index line = 64 / Index(sizeof(S)), page = 4096 / Index(sizeof(S));
  padded_ = (n + settings_.tile + page - 1) / page * page + 17 * line;
  position_.setZero(padded_, 3);
  velocity_.setZero(padded_, 3);
  if (settings_.keeps_previous) previous_position_.setZero(padded_, 3), previous_velocity_.setZero(padded_, 3);
  deaths_ = Deaths(n);
  lifetime_.assign(std::size_t(n), 0);
  size_.assign(std::size_t(n), 0);
  serial_.assign(std::size_t(padded_), 0);
  slot_.assign(std::size_t(n), 0);
  kind_.assign(std::size_t(n), 0);
  birth_place_.setZero(n, 3);
  slots_.resize(std::size_t(n));
  for (Index i = n; i-- > 0;) free_.push_back(std::uint32_t(i));
  for (Index i = 0; i < settings_.trail; ++i) trail_.emplace_back(Points<float>::Zero(n, 3));
  trail_length_.assign(settings_.trail > 0 ? std::size_t(n) : 0, 0);
  // Room for what comes and goes in a tick.
  const std::size_t events = 256 + std::size_t(n) / 8;
  events_.reserve(events), born_.reserve(events), dead_.reserve(events), removed_.reserve(events);
  plan_ = std::make_unique<Plan>();
  newborn_ = std::make_unique<Worker>(Tile<S>::kLanes);
}

template <class S>
ParticleSystem<S>::~ParticleSystem() = default;

template <class S>
void ParticleSystem<S>::add_force(std::unique_ptr<Force<S>> force) {
  if (!settings_.method->accepts_velocity_forces && (force->uses_velocity() || force->uniform(0, 1).rate > 0))
    throw std::invalid_argument("particles \"" + name() + "\": " + std::string(settings_.method->name) +
                                " needs forces of position alone, got drag");
  forces_.push_back(std::move(force));
}

// From now on masses differ.
template <class S>
void ParticleSystem<S>::start_weighing() {
  if (has_mass_) return;
  has_mass_ = true;
  inverse_mass_.setConstant(padded_, S(1 / same_mass_));
}

template <class S>
void ParticleSystem<S>::add_emitter(EmitterSettings emitter) {
  emitter.start -= settings_.prewarm;
  emitter.seed = Random(settings_.seed).bits(emitter.seed, emitters_.size());
  Emitter made(std::move(emitter));
  const EmitterSettings& e = made.settings();
  if (!has_mass_ && emitters_.empty() && count_ == 0) same_mass_ = e.mass.least;
  if (e.mass.least != same_mass_ || e.mass.most != same_mass_) start_weighing();
  emitters_.push_back(std::move(made));
}

template <class S>
void ParticleSystem<S>::add_sub_emitter(SubEmitterSettings sub) {
  const auto check = [](const char* what, bool good, const char* rule, double value) {
    if (!good)
      throw std::invalid_argument(std::string("SubEmitter: ") + what + " must be " + rule + ", got " +
                                  std::to_string(value));
  };
  check("kind", sub.kind >= 0 && sub.kind < 256, "from 0 to 255", sub.kind);
  check("kind", sub.kind != sub.parent_kind, "another than parent_kind", sub.kind);
  check("probability", sub.probability >= 0 && sub.probability <= 1, "from 0 to 1", sub.probability);
  check("count", sub.count.least >= 0 && sub.count.most >= sub.count.least && sub.count.most <= 1e6,
        "0 or more and in order", sub.count.least);
  check("least_impact", sub.least_impact >= 0, "0 or more", sub.least_impact);
  check("spread", sub.spread >= 0 && sub.spread <= std::numbers::pi + 1e-9, "from 0 to π rad", sub.spread);
  check("lifetime", sub.lifetime.least > 0 && sub.lifetime.most >= sub.lifetime.least, "positive and in order",
        sub.lifetime.least);
  check("size", sub.size.least >= 0 && sub.size.most >= sub.size.least && std::isfinite(sub.size.most),
        "0 or more and in order", sub.size.least);
  check("mass", sub.mass > 0 && std::isfinite(sub.mass), "positive", sub.mass);
  check("speed", std::isfinite(sub.speed.least) && std::isfinite(sub.speed.most) && sub.speed.most >= sub.speed.least,
        "finite and in order", sub.speed.least);
  check("inherit", std::isfinite(sub.inherit), "finite", sub.inherit);
  if (!sub.axis.allFinite()) throw std::invalid_argument("SubEmitter: axis must be finite");
  wants_births_ |= sub.on == SubEmitterSettings::On::Birth;
  wants_deaths_ |= sub.on == SubEmitterSettings::On::Death;
  wants_impacts_ |= sub.on == SubEmitterSettings::On::Impact;
  if (sub.mass != same_mass_ && (!emitters_.empty() || count_ > 0)) start_weighing();
  sub_random_.emplace_back(Random(settings_.seed).bits(sub.seed, ~std::uint64_t(sub_emitters_.size())));
  sub_emitters_.push_back(sub);
}

// ---- One particle

template <class S>
void ParticleSystem<S>::check_index(Index i) const {
  if (i < 0 || i >= count_)
    throw std::out_of_range("particles \"" + name() + "\": particle " + std::to_string(i) + " of " +
                            std::to_string(count_));
}

template <class S>
typename ParticleSystem<S>::Particle ParticleSystem<S>::get(Index i) const {
  const std::size_t at = std::size_t(i);
  Particle p;
  p.inverse_mass = S(1 / same_mass_);
  p.position = row(position_, i), p.velocity = row(velocity_, i);
  if (settings_.keeps_previous)
    p.previous_position = row(previous_position_, i), p.previous_velocity = row(previous_velocity_, i);
  p.death = deaths_[i];
  if (has_mass_) p.inverse_mass = inverse_mass_[i];
  p.lifetime = lifetime_[at], p.size = size_[at], p.serial = serial_[at], p.slot = slot_[at], p.kind = kind_[at];
  p.birth_place = row(birth_place_, i);
  return p;
}

template <class S>
void ParticleSystem<S>::put(Index i, const Particle& p) {
  const std::size_t at = std::size_t(i);
  set_row(position_, i, p.position), set_row(velocity_, i, p.velocity);
  if (settings_.keeps_previous)
    set_row(previous_position_, i, p.previous_position), set_row(previous_velocity_, i, p.previous_velocity);
  deaths_.set(i, p.death);
  if (has_mass_) inverse_mass_[i] = p.inverse_mass;
  lifetime_[at] = p.lifetime, size_[at] = p.size, serial_[at] = p.serial, slot_[at] = p.slot, kind_[at] = p.kind;
  set_row(birth_place_, i, p.birth_place);
  slots_[p.slot].index = i;
}

// `tick`: the one within which it is born and flies on; null: it stays where it is born.
template <class S>
bool ParticleSystem<S>::append(const Birth& birth, const Tick* tick) {
  if (count_ >= settings_.capacity) {
    ++counts_.refused;
    return false;
  }
  if (birth.mass != same_mass_ && !has_mass_) {
    if (count_ == 0 && emitters_.empty())
      same_mass_ = birth.mass;
    else
      start_weighing();
  }
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  const Index i = count_++;
  Particle p;
  p.position = birth.position - settings_.origin, p.velocity = birth.velocity;
  p.death = (tick ? birth.time : now_) + birth.lifetime;
  p.inverse_mass = S(1 / birth.mass);
  p.lifetime = birth.lifetime, p.size = float(birth.size), p.serial = next_serial_++, p.slot = slot;
  p.kind = std::uint8_t(birth.kind);
  p.birth_place = p.position, p.previous_position = p.position, p.previous_velocity = p.velocity;
  put(i, p);
  if (!trail_length_.empty()) trail_length_[std::size_t(i)] = 0;
  ++counts_.born;
  if (tick) {
    if (tick->end > birth.time) fly_newborn(i, birth.time, *tick);
    if (settings_.keeps_previous) {
      // So that it is drawn on its way between the ticks.
      const double seconds = tick->end - tick->start;
      set_row(previous_position_, i, row(position_, i) - seconds * row(velocity_, i));
      previous_velocity_.row(i) = velocity_.row(i);
    }
  }
  return true;
}

template <class S>
void ParticleSystem<S>::remove(Index i) {
  removed_.push_back({i, get(i)});
  remove_now(i);
}

template <class S>
void ParticleSystem<S>::remove_now(Index i) {
  const std::uint32_t slot = slot_[std::size_t(i)];
  slots_[slot].index = -1;
  ++slots_[slot].generation;
  free_.push_back(slot);
  const Index last = --count_;
  if (i == last) return;
  put(i, get(last));
  for (Points<float>& places : trail_) places.row(i) = places.row(last);
  if (!trail_length_.empty()) trail_length_[std::size_t(i)] = trail_length_[std::size_t(last)];
}

// From the last to the first: who fills a gap is alive.
template <class S>
void ParticleSystem<S>::remove_all(std::vector<Index>& dead) {
  std::sort(dead.begin(), dead.end());
  dead.erase(std::unique(dead.begin(), dead.end()), dead.end());
  for (std::size_t i = dead.size(); i-- > 0;) remove(dead[i]);
}

template <class S>
Handle ParticleSystem<S>::add(const Birth& birth) {
  if (!birth.position.allFinite() || !birth.velocity.allFinite() || !(birth.mass > 0) || !std::isfinite(birth.mass) ||
      !(birth.lifetime > 0) || !(birth.size >= 0) || birth.kind < 0 || birth.kind > 255)
    throw std::invalid_argument(
        "particles \"" + name() +
        "\": a particle needs finite position and velocity, positive mass and lifetime, a size of 0 or "
        "more and a kind from 0 to 255");
  if (!append(birth, nullptr)) return {std::numeric_limits<std::uint32_t>::max(), 0};
  return handle(count_ - 1);
}

template <class S>
Handle ParticleSystem<S>::handle(Index i) const {
  check_index(i);
  const std::uint32_t slot = slot_[std::size_t(i)];
  return {slot, slots_[slot].generation};
}

template <class S>
Index ParticleSystem<S>::find(Handle handle) const {
  if (handle.slot >= slots_.size() || slots_[handle.slot].generation != handle.generation) return -1;
  return slots_[handle.slot].index;
}

// ---- A tick

// Splits the tick into legs of the method and places the colliders.
template <class S>
void ParticleSystem<S>::plan(const Tick& tick) {
  Plan& p = *plan_;
  p.start = tick.start, p.end = tick.end, p.origin = settings_.origin;
  const double seconds = tick.end - tick.start;
  p.steps = settings_.dt > 0 ? std::max(1, int(std::ceil(seconds / settings_.dt * (1 - 1e-9)))) : 1;
  p.h = seconds / p.steps;
  p.exact = settings_.exact_impacts;
  p.hits = wants_impacts_ || settings_.dies_on_impact;
  p.uniform = {tick.gravity, 0};
  p.varies = p.velocity = false;
  const bool same_mass = !has_mass_;
  const double inverse_mass = same_mass ? 1 / same_mass_ : std::numeric_limits<double>::quiet_NaN();
  for (const auto& force : forces_) {
    const auto uniform = force->uniform(tick.start, inverse_mass);
    p.uniform.acceleration += uniform.acceleration;
    p.uniform.rate += uniform.rate;
    if (force->varies(same_mass)) p.varies = true, p.velocity |= force->uses_velocity();
  }
  const Splitting* table = splitting_of(*settings_.method);
  p.stages.clear(), p.legs.clear(), p.last.clear(), p.ends.clear();
  p.ends.push_back(tick.start);
  if (!table) {
    p.way = Plan::Way::Integrated;
    p.runs = p.steps, p.legs_a_run = 1;
    for (int s = 1; s <= p.steps; ++s) p.ends.push_back(s == p.steps ? tick.end : tick.start + s * p.h);
  } else {
    p.runs = p.exact ? p.steps : 1;
    typename Plan::Stage stage;
    stage.time = tick.start;
    const auto finish = [&] {
      p.stages.push_back(stage);
      p.last.push_back(push_of<S>(p.uniform, stage.closing + stage.opening).kick);
      stage = {0, 0, stage.time};
    };
    for (int s = 0; s < p.steps; ++s) {
      for (std::size_t i = 0; i < table->kick.size(); ++i) {
        // A kick that ends a step belongs to what came before it.
        (table->drift[i] == 0 ? stage.closing : stage.opening) += table->kick[i] * p.h;
        if (table->drift[i] == 0) continue;
        p.stages.push_back(stage);
        p.legs.push_back({push_of<S>(p.uniform, stage.closing + stage.opening).kick, S(table->drift[i] * p.h)});
        stage = {0, 0, stage.time + table->drift[i] * p.h};
        if (!p.exact) p.ends.push_back(stage.time);
      }
      if (p.exact) {
        finish();
        p.ends.push_back(tick.start + (s + 1) * p.h);
      }
    }
    if (!p.exact) finish();
    p.ends.back() = tick.end;
    p.legs_a_run = int(p.legs.size()) / p.runs;
  }
  const std::span<const Collider> colliders = settings_.collides ? tick.colliders : std::span<const Collider>{};
  p.solids.place(colliders, settings_.origin, p.uniform.acceleration,
                 {settings_.radius, settings_.restitution, settings_.rest_speed, p.h}, p.ends);
  if (table) {
    const bool alone = !p.varies && !p.solids.bodies() && !p.solids.callbacks() && !p.exact;
    p.way = alone ? Plan::Way::Fused : Plan::Way::Staged;
  }
}

template <class S>
Tile<S> ParticleSystem<S>::tile_at(Index first, Index count) {
  Tile<S> tile;
  tile.count = count;
  for (int k = 0; k < 3; ++k) tile.x[k] = position_.col(k).data() + first, tile.v[k] = velocity_.col(k).data() + first;
  if (has_mass_) tile.inverse_mass = inverse_mass_.data() + first;
  tile.same_inverse_mass = S(1 / same_mass_);
  tile.serial = serial_.data() + first;
  return tile;
}

template <class S>
void ParticleSystem<S>::accelerate(const Tile<S>& tile, Index first, double t, S* const a[3]) const {
  for (int k = 0; k < 3; ++k)
    std::fill_n(a[k], (tile.count + Tile<S>::kLanes - 1) / Tile<S>::kLanes * Tile<S>::kLanes, S(0));
  for (const auto& force : forces_)
    if (force->varies(!has_mass_)) force->add_acceleration(tile, first, settings_.origin, t, a);
}

// A tile through a tick with the core's integrator.
template <class S>
void ParticleSystem<S>::integrate(Tile<S>& tile, Index first, Plan& plan, Worker& w) {
  // Contacts of this tile, as the integrator asks for them.
  struct Contact {
    Plan* plan;
    Worker* worker;
    Index count;
    int step = 0;
    Points<S>* x = nullptr;
    Tile<S> view(Points<S>& px, Points<S>& pv) const {
      Tile<S> t;
      t.count = count;
      for (int k = 0; k < 3; ++k) t.x[k] = px.col(k).data(), t.v[k] = pv.col(k).data();
      return t;
    }
    bool collides() const { return plan->solids.any() && !plan->exact; }
    void collide(double t0, const Points<S>& from, double t1, Points<S>& px, Points<S>& pv) {
      x = &px;
      const Tile<S> t = view(px, pv);
      const S* const start[3] = {from.col(0).data(), from.col(1).data(), from.col(2).data()};
      plan->solids.mark(t, step, S(t1 - t0), start, worker->marks.data());
      plan->solids.mark_planes(t, step, worker->marks.data());
      plan->solids.resolve(t, step, S(t1 - t0), start, worker->marks.data(), plan->hits ? &worker->hits : nullptr);
      if (plan->solids.callbacks()) plan->solids.call_back(t, step, plan->hits ? &worker->hits : nullptr);
    }
    void settle(Points<S>& pv) {
      const Tile<S> t = view(*x, pv);
      plan->solids.settle(t, step, worker->marks.data());
      if (plan->solids.plane_count() == 0) return;
      Flight<S> rest;
      rest.settles = true;
      rest.planes = plan->solids.planes(step), rest.plane_count = plan->solids.plane_count();
      fly(t, rest);
    }
  };
  struct Accelerate {
    const ParticleSystem* system;
    Plan* plan;
    Tile<S> tile;
    Index first;
    void operator()(const Points<S>& x, const Points<S>& v, double t, Points<S>& a) const {
      Tile<S> now = tile;
      for (int k = 0; k < 3; ++k) {
        now.x[k] = const_cast<S*>(x.col(k).data());
        now.v[k] = const_cast<S*>(v.col(k).data());
      }
      a.resize(x.rows(), 3);
      S* const out[3] = {a.col(0).data(), a.col(1).data(), a.col(2).data()};
      for (int k = 0; k < 3; ++k) a.col(k).setZero();
      for (const auto& force : system->forces_)
        if (force->varies(!system->has_mass_)) force->add_acceleration(now, first, system->settings_.origin, t, out);
      for (int k = 0; k < 3; ++k) a.col(k) += S(plan->uniform.acceleration[k]) - S(plan->uniform.rate) * v.col(k);
    }
  };
  using Tiled = TileDynamics<S, Accelerate, Contact>;
  // Rows beyond the last particle stand still at zero: a tile of one size needs no memory.
  const Index rows = Index(w.marks.size()) - Tile<S>::kLanes;
  Contact contact{&plan, &w, tile.count};
  Tiled dynamics(Accelerate{this, &plan, tile, first}, &contact);
  dynamics.set(1 / same_mass_, rows, tile.inverse_mass);
  dynamics.uses_velocity_now = plan.velocity || plan.uniform.rate > 0;
  if (!w.integrator) w.integrator = std::make_unique<Integrator<S>>(*settings_.method);
  w.x.setZero(rows, 3), w.v.setZero(rows, 3);
  for (int k = 0; k < 3; ++k) {
    std::copy_n(tile.x[k], tile.count, w.x.col(k).data());
    std::copy_n(tile.v[k], tile.count, w.v.col(k).data());
  }
  w.integrator->forget();  // what another tile has taught it, which threads take in any order
  for (int s = 0; s < plan.steps; ++s) {
    contact.step = s;
    if (plan.exact)
      for (int k = 0; k < 3; ++k) {
        std::copy_n(w.x.col(k).data(), tile.count, w.x0[k]);
        std::copy_n(w.v.col(k).data(), tile.count, w.v0[k]);
      }
    const double t = plan.ends[std::size_t(s)];
    dynamics.time = t + plan.h;
    if (settings_.dt == 0 && settings_.method->adaptive() && !plan.solids.any()) {
      if (!w.integrator->adapt(dynamics, w.x, w.v, t, plan.h, settings_.tolerance, 1e-6 * plan.h).converged)
        w.finite = false;
      continue;
    }
    if (!w.integrator->step(dynamics, w.x, w.v, t, plan.h).converged) w.finite = false;
    if (plan.exact && plan.solids.any()) {
      Tile<S> view = contact.view(w.x, w.v);
      plan.solids.resolve_exactly(view, s, plan.h, w.x0, w.v0, plan.hits ? &w.hits : nullptr);
      if (plan.solids.callbacks()) plan.solids.call_back(view, s, plan.hits ? &w.hits : nullptr);
      w.integrator->restart();
    }
  }
  for (int k = 0; k < 3; ++k) {
    std::copy_n(w.x.col(k).data(), tile.count, tile.x[k]);
    std::copy_n(w.v.col(k).data(), tile.count, tile.v[k]);
  }
}

// A tile through a tick with a splitting method, leg by leg where forces or solids need it.
template <class S>
void ParticleSystem<S>::flight(Tile<S>& tile, Index first, Plan& plan, Worker& w) {
  std::vector<Hit<S>>* const hits = plan.hits ? &w.hits : nullptr;
  const Solids<S>& solids = plan.solids;
  const auto step_of = [&](int leg) { return plan.exact ? leg / plan.legs_a_run : leg; };
  const auto kick_by = [&](std::size_t stage_number) {
    // Forces that vary: the kick is made here and the leg only drifts.
    const typename Plan::Stage& stage = plan.stages[stage_number];
    const auto closing = push_of<S>(plan.uniform, stage.closing), opening = push_of<S>(plan.uniform, stage.opening);
    const S* const a[3] = {w.a[0], w.a[1], w.a[2]};
    if (plan.velocity && stage.closing != 0) {
      // At the velocity that the last accelerations predict for the step's end.
      Tile<S> ahead = tile;
      for (int k = 0; k < 3; ++k) {
        std::copy_n(tile.v[k], tile.count, w.predicted[k]);
        ahead.v[k] = w.predicted[k];
      }
      kick(ahead, closing.kick, a, closing.share);
      accelerate(ahead, first, stage.time, w.a);
    } else {
      accelerate(tile, first, stage.time, w.a);
    }
    if (stage.closing != 0) kick(tile, closing.kick, a, closing.share);
    if (stage.opening != 0) kick(tile, opening.kick, a, opening.share);
  };
  for (int run = 0; run < plan.runs; ++run) {
    if (plan.exact)
      for (int k = 0; k < 3; ++k) {
        std::copy_n(tile.x[k], tile.count, w.x0[k]);
        std::copy_n(tile.v[k], tile.count, w.v0[k]);
      }
    for (int l = run * plan.legs_a_run; l < (run + 1) * plan.legs_a_run; ++l) {
      const std::size_t stage = std::size_t(l + (plan.exact ? run : 0));
      Leg<S> leg = plan.legs[std::size_t(l)];
      if (plan.varies) {
        kick_by(stage);
        leg.kick = {};
      }
      Flight<S> air;
      air.legs = {&leg, 1};
      air.hits = hits, air.first_leg = step_of(l);
      if (plan.exact) {
        fly(tile, air);
        continue;
      }
      if (!solids.bodies()) {
        air.planes = solids.planes(l), air.plane_count = solids.plane_count();
        fly(tile, air);
      } else {
        // Whoever may meet a body goes its way with everything that is in it; the rest meets planes alone.
        fly(tile, air);
        const bool marked = solids.mark(tile, l, leg.drift, nullptr, w.marks.data());
        if (marked) solids.resolve(tile, l, leg.drift, nullptr, w.marks.data(), hits);
        if (solids.plane_count() > 0) {
          air.planes = solids.planes(l), air.plane_count = solids.plane_count();
          air.skip = marked ? w.marks.data() : nullptr;
          reflect(tile, air);
        }
      }
      if (solids.callbacks()) solids.call_back(tile, l, hits);
    }
    Flight<S> landing_flight;
    const std::size_t stage = std::size_t((run + 1) * plan.legs_a_run + (plan.exact ? run : 0));
    const bool last_run = run + 1 == plan.runs;
    if (plan.varies)
      kick_by(stage);
    else
      landing_flight.last = &plan.last[std::size_t(run)];
    const int step = step_of((run + 1) * plan.legs_a_run - 1);
    landing_flight.settles = !plan.exact && solids.plane_count() > 0;
    landing_flight.planes = solids.planes(step), landing_flight.plane_count = solids.plane_count();
    fly(tile, landing_flight);
    if (plan.exact && solids.any()) {
      solids.resolve_exactly(tile, run, plan.h, w.x0, w.v0, hits);
      if (solids.callbacks()) solids.call_back(tile, run, hits);
    } else if (solids.bodies() && last_run) {
      if (solids.mark(tile, step, S(0), nullptr, w.marks.data())) solids.settle(tile, step, w.marks.data());
    }
  }
}

// A tile through a tick.
template <class S>
void ParticleSystem<S>::move(Tile<S> tile, Index first, Plan& plan, Worker& w) {
  if (settings_.keeps_previous && first >= 0) {
    for (int k = 0; k < 3; ++k) {
      std::copy_n(tile.x[k], tile.count, previous_position_.col(k).data() + first);
      std::copy_n(tile.v[k], tile.count, previous_velocity_.col(k).data() + first);
    }
  }
  w.hits.clear();
  Flight<S> flight_plan;
  if (plan.way == Plan::Way::Fused) {
    flight_plan.legs = plan.legs;
    flight_plan.last = &plan.last[0];
    flight_plan.planes = plan.solids.planes(0), flight_plan.plane_count = plan.solids.plane_count();
    flight_plan.settles = flight_plan.plane_count > 0;
    flight_plan.hits = plan.hits ? &w.hits : nullptr;
  } else if (plan.way == Plan::Way::Staged) {
    flight(tile, first, plan, w);
  } else {
    integrate(tile, first, plan, w);
  }
  const bool finite = fly(tile, flight_plan);
  w.finite = w.finite && finite;
  for (const Hit<S>& hit : w.hits) {
    Event event;
    event.on = SubEmitterSettings::On::Impact;
    event.particle = std::max<Index>(first, 0) + hit.particle;
    event.order = int(&hit - w.hits.data());
    event.time = plan.ends[std::min(std::size_t(hit.leg) + 1, plan.ends.size() - 1)];
    event.serial = tile.serial[hit.particle];
    event.kind = kind_[std::size_t(event.particle)];
    event.position = settings_.origin + Vec3(hit.position[0], hit.position[1], hit.position[2]);
    for (int k = 0; k < 3; ++k) event.velocity[k] = double(tile.v[k][hit.particle]);
    event.normal = Vec3(hit.normal[0], hit.normal[1], hit.normal[2]);
    event.speed = double(hit.speed);
    w.events.push_back(event);
  }
}

// A particle that was born within the tick flies on for the rest of it, alone.
template <class S>
void ParticleSystem<S>::fly_newborn(Index i, double t0, const Tick& tick) {
  Tick rest = tick;
  rest.start = t0;
  plan(rest);
  Worker& w = *newborn_;
  S x[3][Tile<S>::kLanes] = {}, v[3][Tile<S>::kLanes] = {}, inverse_mass[Tile<S>::kLanes];
  std::fill_n(inverse_mass, Tile<S>::kLanes, S(1));
  Tile<S> tile = tile_at(i, 1);
  for (int k = 0; k < 3; ++k) {
    x[k][0] = position_(i, k), v[k][0] = velocity_(i, k);
    tile.x[k] = x[k], tile.v[k] = v[k];
  }
  if (has_mass_) inverse_mass[0] = inverse_mass_[i], tile.inverse_mass = inverse_mass;
  w.events.clear();
  // Forces that look at neighbours were prepared before it was born; -1 marks that it has no place among them.
  move(tile, -1, *plan_, w);
  for (int k = 0; k < 3; ++k) position_(i, k) = x[k][0], velocity_(i, k) = v[k][0];
  // What it met counts in the next tick, when it has its place.
  for (Event& event : w.events) {
    event.particle = i;
    event.kind = kind_[std::size_t(i)];
    early_.push_back(event);
  }
}

template <class S>
void ParticleSystem<S>::simulate_tick(const Tick& tick) {
  removed_.clear();
  previous_counts_ = counts_;
  previous_serial_ = next_serial_;
  // Time that passed without it does not age.
  if (tick.start != now_) deaths_.shift(tick.start - now_);
  previous_now_ = tick.start, now_ = tick.end;
  events_.assign(early_.begin(), early_.end());
  for (Event& event : events_) event.order -= 1'000'000;  // before those of this tick
  early_.clear();
  const Tile<S> all = tile_at(0, count_);
  for (const auto& force : forces_) force->prepare(all, tick.start);
  plan(tick);
  steps_ = plan_->steps;
  evaluations_ += plan_->steps * settings_.method->evaluations;

  // Where nothing is kept between legs, longer runs pass through the loop at once: the same bits, fewer calls.
  const bool fused = plan_->way == Plan::Way::Fused && !settings_.keeps_previous;
  const Index span = fused ? kTilesAtOnce * settings_.tile : settings_.tile;
  const Index spans = (count_ + span - 1) / span, at_once = fused ? 1 : kTilesAtOnce;
  const int threads = tick.gang && spans > 2 * at_once ? tick.gang->size() : 1;
  while (int(workers_.size()) < threads) workers_.push_back(std::make_unique<Worker>(settings_.tile));
  for (const auto& worker : workers_) worker->finite = true;
  std::atomic<Index> next{0};
  const auto work = [&](int number) {
    Worker& w = *workers_[std::size_t(number)];
    w.events.clear();
    w.finite = true;
    for (;;) {
      const Index from = next.fetch_add(at_once);
      if (from >= spans) break;
      for (Index i = from; i < std::min(spans, from + at_once); ++i) {
        const Index first = i * span;
        move(tile_at(first, std::min(span, count_ - first)), first, *plan_, w);
      }
    }
  };
  if (threads > 1)
    tick.gang->run(std::ref(work));
  else
    work(0);

  for (int i = 0; i < threads; ++i) {
    const std::vector<Event>& events = workers_[std::size_t(i)]->events;
    events_.insert(events_.end(), events.begin(), events.end());
  }
  // A particle's impacts are in order; particles are not, where threads share them.
  std::sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
    return a.particle != b.particle ? a.particle < b.particle : a.order < b.order;
  });
  counts_.impacts += std::int64_t(events_.size());
}

template <class S>
void ParticleSystem<S>::sub_births() {
  for (const Event& event : events_)
    for (std::size_t s = 0; s < sub_emitters_.size(); ++s) {
      const SubEmitterSettings& sub = sub_emitters_[s];
      if (sub.on != event.on || sub.parent_kind != event.kind) continue;
      if (event.on == SubEmitterSettings::On::Impact && event.speed < sub.least_impact) continue;
      const Random& random = sub_random_[s];
      const std::uint64_t key = random.bits(event.serial, std::bit_cast<std::uint64_t>(event.time));
      if (random.uniform(key, 0) >= sub.probability) continue;
      const int count = int(std::floor(sub.count.at(random.uniform(key, 1)) + random.uniform(key, 2)));
      const bool any_way = sub.axis.squaredNorm() == 0;
      const Vec3 axis = !any_way                         ? Vec3(sub.axis.normalized())
                        : event.normal.squaredNorm() > 0 ? event.normal
                                                         : Vec3(0, 1, 0);
      const double spread = any_way && event.on != SubEmitterSettings::On::Impact ? std::numbers::pi : sub.spread;
      for (int c = 0; c < count; ++c) {
        const std::uint64_t child = random.bits(key, 3 + std::uint64_t(c));
        Birth birth;
        birth.time = event.time;
        birth.position = event.position;
        birth.velocity = sub.inherit * event.velocity +
                         sub.speed.at(random.uniform(child, 2)) * random.within(axis, spread, child, 0);
        birth.lifetime = std::isinf(sub.lifetime.most) ? sub.lifetime.most : sub.lifetime.at(random.uniform(child, 3));
        birth.size = sub.size.at(random.uniform(child, 4));
        birth.mass = sub.mass;
        birth.kind = sub.kind;
        born_.push_back(birth);
      }
    }
}

template <class S>
void ParticleSystem<S>::births(const Tick& tick) {
  born_.clear();
  if (!sub_emitters_.empty()) sub_births();
  const std::size_t children = born_.size();
  for (const Emitter& emitter : emitters_) emitter.births(tick.start, tick.end, born_);
  Index wanted = Index(born_.size());
  std::size_t skipped = 0;
  if (settings_.at_capacity == ParticleSettings::AtCapacity::OldestDies && count_ + wanted > settings_.capacity &&
      count_ > 0) {
    // More than there is room for at all: the earliest of them had to go already.
    if (wanted > settings_.capacity) {
      skipped = std::size_t(wanted - settings_.capacity);
      counts_.refused += std::int64_t(skipped);
      wanted = settings_.capacity;
    }
    const Index surplus = std::min(count_, count_ + wanted - settings_.capacity);
    oldest_.clear();
    for (Index i = 0; i < count_; ++i) oldest_.emplace_back(serial_[std::size_t(i)], i);
    std::nth_element(oldest_.begin(), oldest_.begin() + (surplus - 1), oldest_.end());
    dead_.clear();
    for (Index i = 0; i < surplus; ++i) dead_.push_back(oldest_[std::size_t(i)].second);
    remove_all(dead_);
    counts_.displaced += surplus;
  }
  births_begin_ = count_;
  events_.clear();
  for (std::size_t i = skipped; i < born_.size(); ++i) {
    if (!append(born_[i], &tick) || !wants_births_ || i < children) continue;
    const Birth& birth = born_[i];
    Event event{SubEmitterSettings::On::Birth,
                count_ - 1,
                0,
                birth.time,
                serial_[std::size_t(count_ - 1)],
                birth.kind,
                birth.position,
                birth.velocity,
                Vec3::Zero(),
                0};
    events_.push_back(event);
  }
  if (!events_.empty()) {
    born_.clear();
    sub_births();
    for (const Birth& birth : born_) append(birth, &tick);
  }
  // Lives that are shorter than what was left of the tick.
  for (Index i = count_; i-- > births_begin_;)
    if (deaths_[i] <= last_moment(tick)) {
      drop_newborn(i);
      ++counts_.died;
    }
}

// Taken back before anybody saw it; what fills its place is a newborn too.
template <class S>
void ParticleSystem<S>::drop_newborn(Index i) {
  std::erase_if(early_, [&](const Event& event) { return event.particle == i; });
  const Index last = count_ - 1;
  for (Event& event : early_)
    if (event.particle == last) event.particle = i;
  remove_now(i);
}

template <class S>
void ParticleSystem<S>::keep_trail() {
  if (settings_.trail == 0) return;
  trail_head_ = (trail_head_ + 1) % settings_.trail;
  Points<float>& places = trail_[std::size_t(trail_head_)];
  for (Index i = 0; i < count_; ++i) {
    places.row(i) = (row(position_, i) + settings_.origin).transpose().array().template cast<float>();
    auto& length = trail_length_[std::size_t(i)];
    length = std::uint8_t(std::min<Index>(length + 1, settings_.trail));
  }
}

template <class S>
StepReport ParticleSystem<S>::advance(const Tick& tick) {
  if (!started_) {
    started_ = true;
    if (settings_.prewarm > 0) {
      warming_ = true;
      prewarm(tick);
      warming_ = false;
    }
  }
  if (!warming_) spend_bank(tick.end - tick.start);
  simulate_tick(tick);
  for (const auto& worker : workers_) {
    if (worker->finite) continue;
    StepReport report;
    report.status = StepReport::Status::NotFinite;
    report.body = name();
    report.time = tick.start;
    for (Index i = 0; i < count_ && report.point < 0; ++i)
      if (!position_.row(i).allFinite() || !velocity_.row(i).allFinite()) report.point = i;
    report.advice =
        "a force or a collider gave it a position or velocity that is not finite; check the forces of your own, lower "
        "dt";
    births_begin_ = count_;
    removed_.clear();
    take_back();
    return report;
  }
  // Deaths, then births: the events of both are known before anything changes its place.
  dead_.clear();
  deaths_.take(last_moment(tick), count_, dead_);
  if (settings_.dies_on_impact) {
    for (const Event& event : events_) dead_.push_back(event.particle);
    std::sort(dead_.begin(), dead_.end());
    dead_.erase(std::unique(dead_.begin(), dead_.end()), dead_.end());
  }
  if (wants_deaths_)
    for (const Index i : dead_) {
      Event event{SubEmitterSettings::On::Death,
                  i,
                  0,
                  tick.end,
                  serial_[std::size_t(i)],
                  kind_[std::size_t(i)],
                  settings_.origin + row(position_, i),
                  row(velocity_, i),
                  Vec3::Zero(),
                  0};
      events_.push_back(event);
    }
  remove_all(dead_);
  counts_.died += std::int64_t(dead_.size());
  births(tick);
  keep_trail();
  return {};
}

template <class S>
void ParticleSystem<S>::prewarm(const Tick& tick) {
  const double seconds = tick.end - tick.start;
  const auto ticks = std::int64_t(std::ceil(settings_.prewarm / seconds - 1e-9));
  for (std::int64_t i = ticks; i > 0; --i) {
    Tick before = tick;
    before.start = tick.start - double(i) * seconds;
    before.end = tick.start - double(i - 1) * seconds;
    if (!advance(before).good()) break;
  }
}

template <class S>
void ParticleSystem<S>::take_back() {
  if (!settings_.keeps_previous) return;
  while (count_ > births_begin_) {
    const std::uint32_t slot = slot_[std::size_t(--count_)];
    slots_[slot].index = -1;
    free_.push_back(slot);
  }
  for (std::size_t r = removed_.size(); r-- > 0;) {
    const Removed& removed = removed_[r];
    if (removed.index < count_) put(count_, get(removed.index));
    ++count_;
    put(removed.index, removed.particle);
    free_.pop_back();
    --slots_[removed.particle.slot].generation;
  }
  removed_.clear();
  births_begin_ = count_;
  early_.clear();
  position_.topRows(count_) = previous_position_.topRows(count_);
  velocity_.topRows(count_) = previous_velocity_.topRows(count_);
  counts_ = previous_counts_;
  next_serial_ = previous_serial_;
  now_ = previous_now_;
}

// ---- Forces of the user

template <class S>
void ParticleSystem<S>::add_force(Index point, const Vec3& force) {
  if (!force.allFinite()) throw std::invalid_argument("particles \"" + name() + "\": force must be finite");
  pushed_.push_back({handle(point), force});
}

template <class S>
void ParticleSystem<S>::begin_frame(double seconds, double waiting, double, double) {
  // What waits of earlier frames comes first and has no forces of its own; then every frame has its place.
  if (pushed_.empty() && bank_.empty()) return;
  if (bank_.empty() && waiting > 0) bank_.push_back({waiting, {}});
  bank_.push_back({seconds, pushed_});
}

// The impulses of this tick's share, in the order of arrival.
template <class S>
void ParticleSystem<S>::spend_bank(double seconds) {
  double left = seconds;
  while (!bank_.empty() && left > 1e-9 * seconds) {
    Banked& piece = bank_.front();
    // A piece that ends with the tick but for rounding does.
    const bool all = piece.seconds <= left + 1e-9 * seconds;
    const double spent = all ? std::min(piece.seconds, left) : left;
    for (const Push& push : piece.pushes)
      if (const Index i = find(push.who); i >= 0)
        set_row(velocity_, i,
                row(velocity_, i) + spent * (has_mass_ ? double(inverse_mass_[i]) : 1 / same_mass_) * push.force);
    left -= spent;
    if (all)
      bank_.erase(bank_.begin());
    else
      piece.seconds -= spent;
  }
}

// ---- What can be asked

template <class S>
Eigen::Ref<const Points<S>, 0, Eigen::OuterStride<>> ParticleSystem<S>::state_positions() const {
  return position_.topRows(count_);
}

template <class S>
Eigen::Ref<const Points<S>, 0, Eigen::OuterStride<>> ParticleSystem<S>::state_velocities() const {
  return velocity_.topRows(count_);
}

template <class S>
double ParticleSystem<S>::lifetime(Index i) const {
  check_index(i);
  return lifetime_[std::size_t(i)];
}

template <class S>
double ParticleSystem<S>::age(Index i) const {
  check_index(i);
  const double life = lifetime_[std::size_t(i)];
  return std::isfinite(life) ? std::max(0.0, life - (deaths_[i] - now_)) : 0;
}

template <class S>
void ParticleSystem<S>::appearance(Points<float>& colors, Values<float>& sizes) const {
  static const Kind plain;
  colors.resize(count_, 3), sizes.resize(count_);
  for (Index i = 0; i < count_; ++i) {
    const std::size_t k = kind_[std::size_t(i)];
    const Kind& kind = k < settings_.kinds.size() ? settings_.kinds[k] : plain;
    const double life = lifetime_[std::size_t(i)], share = std::isfinite(life) ? age(i) / life : 0;
    colors.row(i) = kind.color(share).transpose().array().template cast<float>();
    sizes[i] = size_[std::size_t(i)] * float(kind.size(share));
  }
}

template <class S>
Index ParticleSystem<S>::trail(Index i, Points<float>& out) const {
  check_index(i);
  const Index length = settings_.trail > 0 ? trail_length_[std::size_t(i)] : 0;
  out.resize(settings_.trail, 3);
  for (Index k = 0; k < length; ++k)
    out.row(k) = trail_[std::size_t((trail_head_ + settings_.trail - k) % settings_.trail)].row(i);
  return length;
}

template <class S>
Points<double> ParticleSystem<S>::positions() const {
  Points<double> out = position_.topRows(count_).template cast<double>();
  out.rowwise() += settings_.origin.transpose().array();
  return out;
}

template <class S>
Points<double> ParticleSystem<S>::velocities() const {
  return velocity_.topRows(count_).template cast<double>();
}

template <class S>
Values<double> ParticleSystem<S>::masses() const {
  if (!has_mass_) return Values<double>::Constant(count_, same_mass_);
  return inverse_mass_.head(count_).template cast<double>().inverse();
}

template <class S>
Points<double> ParticleSystem<S>::positions_between(double fraction) const {
  Points<double> out = positions();
  if (!settings_.keeps_previous) return out;
  Points<double> before = previous_position_.topRows(count_).template cast<double>();
  before.rowwise() += settings_.origin.transpose().array();
  return before + fraction * (out - before);
}

template <class S>
Points<double> ParticleSystem<S>::start_positions() const {
  Points<double> out = birth_place_.topRows(count_).template cast<double>();
  out.rowwise() += settings_.origin.transpose().array();
  return out;
}

template <class S>
void ParticleSystem<S>::set_position(Index point, const Vec3& position) {
  check_index(point);
  if (!position.allFinite()) throw std::invalid_argument("particles \"" + name() + "\": position must be finite");
  set_row(position_, point, position - settings_.origin);
}

template <class S>
void ParticleSystem<S>::set_velocity(Index point, const Vec3& velocity) {
  check_index(point);
  if (!velocity.allFinite()) throw std::invalid_argument("particles \"" + name() + "\": velocity must be finite");
  set_row(velocity_, point, velocity);
}

template <class S>
void ParticleSystem<S>::pin(Index) {
  throw std::invalid_argument("particles \"" + name() + "\": particles cannot be pinned");
}
template <class S>
void ParticleSystem<S>::release(Index point) {
  check_index(point);
}
template <class S>
void ParticleSystem<S>::move_pin(Index point, const Vec3&) {
  pin(point);
}
template <class S>
void ParticleSystem<S>::drive_pins(std::vector<Index> points, PinMotion) {
  if (!points.empty()) pin(points[0]);
}

template <class S>
Energy ParticleSystem<S>::energy(const Vec3& gravity) const {
  const Values<double> m = masses();
  Energy energy;
  energy.kinetic = 0.5 * (velocities().square().rowwise().sum() * m).sum();
  energy.gravitational = -((positions().matrix() * gravity).array() * m).sum();
  return energy;
}

template <class S>
Vec3 ParticleSystem<S>::momentum() const {
  return (velocities().colwise() * masses()).colwise().sum().matrix().transpose();
}

template <class S>
MotionFacts ParticleSystem<S>::motion_facts() const {
  MotionFacts facts;
  facts.method = std::string(settings_.method->name);
  facts.precision = std::is_same_v<S, float> ? "float" : "double";
  facts.substeps = steps_;
  facts.stable_step = std::numeric_limits<double>::infinity();
  facts.wanted_dt = settings_.dt;
  facts.evaluations = evaluations_;
  for (const auto& force : forces_) facts.velocity_forces |= force->uses_velocity();
  return facts;
}

template <class S>
void ParticleSystem<S>::damp(double factor) {
  velocity_.topRows(count_) *= S(factor);
}

// ---- Checkpoints

namespace {

void add_range(CheckpointWriter& out, const Range& range) {
  out.add(range.least);
  out.add(range.most);
}

}  // namespace

template <class S>
void ParticleSystem<S>::describe(Blueprint& out) const {
  const ParticleSettings& s = settings_;
  out.add("precision", std::is_same_v<S, float> ? "float" : "double");
  out.add("method", s.method->name);
  out.add("dt", s.dt);
  out.add("tolerance", s.tolerance);
  out.add("capacity", s.capacity);
  out.add("tile", s.tile);
  out.add("trail", s.trail);
  out.add("prewarm", s.prewarm);
  out.add("keeps_previous", s.keeps_previous);
  CheckpointWriter rules;
  rules.add(s.origin);
  for (const double value : {s.radius, s.restitution, s.rest_speed}) rules.add(value);
  rules.add(std::int32_t(s.at_capacity));
  for (const bool value : {s.collides, s.exact_impacts, s.dies_on_impact}) rules.add(value);
  rules.add(s.seed);
  out.add_sum("contact rules, capacity rule, origin and seed", rules);
  out.add("number of forces", Index(forces_.size()));
  out.add("number of emitters", Index(emitters_.size()));
  CheckpointWriter emitters;
  for (const Emitter& emitter : emitters_) {
    const EmitterSettings& e = emitter.settings();
    emitters.add(std::uint8_t(e.source.index()));
    emitters.add(e.position), emitters.add(e.axis);
    for (const double value : {e.spread, e.start, e.stop, e.inherit}) emitters.add(value);
    for (const Range& range : {e.speed, e.lifetime, e.mass, e.size}) add_range(emitters, range);
    for (const Burst& burst : e.bursts)
      emitters.add(burst.time), emitters.add(std::int64_t(burst.count)), emitters.add(burst.period);
    emitters.add(e.along_normal), emitters.add(bool(e.path));
    emitters.add(std::int32_t(e.kind)), emitters.add(e.seed);
  }
  out.add_sum("emitters", emitters);
  out.add("number of sub-emitters", Index(sub_emitters_.size()));
  CheckpointWriter subs;
  for (const SubEmitterSettings& sub : sub_emitters_) {
    subs.add(std::uint8_t(sub.on)), subs.add(std::int32_t(sub.parent_kind)), subs.add(std::int32_t(sub.kind));
    for (const double value : {sub.probability, sub.least_impact, sub.spread, sub.inherit, sub.mass}) subs.add(value);
    for (const Range& range : {sub.count, sub.speed, sub.lifetime, sub.size}) add_range(subs, range);
    subs.add(sub.axis), subs.add(sub.seed);
  }
  out.add_sum("sub-emitters", subs);
}

template <class S>
void ParticleSystem<S>::save(CheckpointWriter& out) const {
  const auto rows = [&](const Points<S>& p) { out.add(Points<S>(p.topRows(count_))); };
  const auto values = [&](const Values<S>& v) { out.add(Values<S>(v.head(count_))); };
  const auto list = [&](const auto& v) { out.add(std::span(v.data(), std::size_t(count_))); };
  out.begin("particles");
  out.add(std::uint64_t(count_));
  rows(position_), rows(velocity_);
  if (settings_.keeps_previous) rows(previous_position_), rows(previous_velocity_);
  out.add(now_);
  out.add(deaths_.times(count_));
  out.add(same_mass_);
  out.add(has_mass_);
  if (has_mass_) values(inverse_mass_);
  list(lifetime_), list(size_), list(serial_), list(slot_), list(kind_);
  out.add(Points<float>(birth_place_.topRows(count_)));
  out.end();

  out.begin("trails");
  out.add(std::int64_t(trail_head_));
  for (const Points<float>& places : trail_) out.add(Points<float>(places.topRows(count_)));
  if (settings_.trail > 0) list(trail_length_);
  out.end();

  out.begin("handles");
  for (const Slot& slot : slots_) out.add(slot.generation);
  out.add(free_);
  out.end();

  out.begin("counts");
  out.add(next_serial_);
  for (const std::int64_t value : {counts_.born, counts_.died, counts_.refused, counts_.displaced, counts_.impacts})
    out.add(value);
  out.add(started_);
  out.add(std::int32_t(steps_));
  out.add(evaluations_);
  out.end();

  out.begin("events");
  out.add(std::uint64_t(early_.size()));
  for (const Event& event : early_) {
    out.add(std::uint8_t(event.on));
    out.add(std::int64_t(event.particle));
    out.add(std::int32_t(event.order));
    out.add(event.time);
    out.add(event.serial);
    out.add(std::int32_t(event.kind));
    for (const Vec3* value : {&event.position, &event.velocity, &event.normal}) out.add(*value);
    out.add(event.speed);
  }
  out.end();

  out.begin("pushes");
  const auto add = [&](const std::vector<Push>& pushes) {
    out.add(std::uint64_t(pushes.size()));
    for (const Push& push : pushes) {
      out.add(push.who.slot);
      out.add(push.who.generation);
      out.add(push.force);
    }
  };
  add(pushed_);
  out.add(std::uint64_t(bank_.size()));
  for (const Banked& piece : bank_) {
    out.add(piece.seconds);
    add(piece.pushes);
  }
  out.end();
}

template <class S>
void ParticleSystem<S>::load(CheckpointReader& in) {
  constexpr Index kMany = std::numeric_limits<Index>::max();
  in.begin("particles");
  count_ = 0;
  const Index n = in.count("number of particles", settings_.capacity);
  Points<S> rows;
  Values<S> values;
  const auto read_rows = [&](const char* what, Points<S>& to) {
    in.array(what, rows, n);
    to.setZero();
    to.topRows(n) = rows;
  };
  const auto read_values = [&](const char* what, Values<S>& to) {
    in.array(what, values, n);
    to.head(n) = values;
  };
  const auto list = [&](const char* what, auto& to) { in.fill(what, std::span(to.data(), std::size_t(n))); };
  read_rows("position", position_);
  read_rows("velocity", velocity_);
  if (settings_.keeps_previous) {
    read_rows("previous position", previous_position_);
    read_rows("previous velocity", previous_velocity_);
  }
  now_ = previous_now_ = in.number<double>("time");
  std::vector<double> deaths(std::size_t(n), 0.0);
  list("death", deaths);
  for (Index i = 0; i < n; ++i) {
    in.require(!std::isnan(deaths[std::size_t(i)]), "death", "must be a time");
    deaths_.set(i, deaths[std::size_t(i)]);
  }
  same_mass_ = in.number<double>("common mass", std::numeric_limits<double>::min());
  has_mass_ = false;
  inverse_mass_.resize(0);
  if (in.number<bool>("masses differ")) {
    start_weighing();
    read_values("inverse mass", inverse_mass_);
    in.require((inverse_mass_.head(n) > S(0)).all(), "inverse mass", "must be positive");
  }
  list("lifetime", lifetime_), list("size", size_), list("serial", serial_), list("slot", slot_), list("kind", kind_);
  for (Index i = 0; i < n; ++i) {
    in.require(lifetime_[std::size_t(i)] > 0, "lifetime", "must be positive");
    in.require(std::isfinite(size_[std::size_t(i)]), "size", "must be finite");
  }
  Points<float> places;
  in.array("birth place", places, n);
  birth_place_.topRows(n) = places;
  in.end();

  in.begin("trails");
  trail_head_ = Index(in.number<std::int64_t>("newest", 0, std::max<Index>(settings_.trail, 1) - 1));
  for (Points<float>& trail : trail_) {
    in.array("place", places, n);
    trail.topRows(n) = places;
  }
  if (settings_.trail > 0) list("length", trail_length_);
  for (Index i = 0; settings_.trail > 0 && i < n; ++i)
    in.require(trail_length_[std::size_t(i)] <= settings_.trail, "length", "must not exceed the setting trail");
  in.end();

  in.begin("handles");
  for (Slot& slot : slots_) slot = {-1, in.number<std::uint32_t>("generation")};
  free_.resize(std::size_t(settings_.capacity - n));
  in.fill("free slots", std::span(free_));
  std::vector<bool> taken(slots_.size(), false);
  const auto take = [&](std::uint32_t slot) {
    in.require(slot < taken.size() && !taken[slot], "slot", "must be below the capacity and taken once");
    taken[slot] = true;
  };
  for (const std::uint32_t slot : free_) take(slot);
  for (Index i = 0; i < n; ++i) {
    const std::uint32_t slot = slot_[std::size_t(i)];
    take(slot);
    slots_[slot].index = i;
  }
  in.end();

  in.begin("counts");
  next_serial_ = in.number<std::uint64_t>("next serial");
  for (std::int64_t* value : {&counts_.born, &counts_.died, &counts_.refused, &counts_.displaced, &counts_.impacts})
    *value = in.number<std::int64_t>("count", 0, std::int64_t(1) << 62);
  started_ = in.number<bool>("started");
  steps_ = in.number<std::int32_t>("steps", 0);
  evaluations_ = in.number<std::int64_t>("evaluations", 0, std::int64_t(1) << 62);
  in.end();

  in.begin("events");
  early_.resize(std::size_t(in.count("number of events", kMany, 97)));
  for (Event& event : early_) {
    event.on = SubEmitterSettings::On(in.number<std::uint8_t>("kind of event", 0, 2));
    event.particle = Index(in.number<std::int64_t>("particle", 0, n - 1));
    event.order = in.number<std::int32_t>("order", 0);
    event.time = in.number<double>("time");
    event.serial = in.number<std::uint64_t>("serial");
    event.kind = in.number<std::int32_t>("kind", 0, 255);
    for (Vec3* value : {&event.position, &event.velocity, &event.normal}) in.array("event", *value, 3);
    event.speed = in.number<double>("speed");
  }
  in.end();

  in.begin("pushes");
  const auto get = [&](std::vector<Push>& pushes) {
    pushes.resize(std::size_t(in.count("number of pushes", kMany, 40)));
    for (Push& push : pushes) {
      push.who.slot = in.number<std::uint32_t>("slot");
      push.who.generation = in.number<std::uint32_t>("generation");
      in.array("force", push.force, 3);
    }
  };
  get(pushed_);
  bank_.resize(std::size_t(in.count("number of banked frames", kMany, 16)));
  for (Banked& piece : bank_) {
    piece.seconds = in.number<double>("banked seconds", 0);
    get(piece.pushes);
  }
  in.end();

  count_ = births_begin_ = n;
  removed_.clear();
  previous_counts_ = counts_;
  previous_serial_ = next_serial_;
}

template class ParticleSystem<float>;
template class ParticleSystem<double>;

}  // namespace hooke::particles
