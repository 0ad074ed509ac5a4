#include <hooke/world.hpp>

#include <hooke/error.hpp>

#include <cmath>
#include <ostream>
#include <stdexcept>

namespace hooke {

Body& World::add(std::unique_ptr<Body> body) {
  if (find(body->name())) throw std::invalid_argument("World: two bodies are called \"" + body->name() + "\"");
  bodies_.push_back(std::move(body));
  return *bodies_.back();
}

Body* World::find(const std::string& name) const {
  for (const auto& body : bodies_)
    if (body->name() == name) return body.get();
  return nullptr;
}

void World::add_collider(Collider collider) {
  if (!(collider.friction >= 0))
    throw std::invalid_argument("collider \"" + collider.name + "\": friction must not be negative");
  if (!(collider.restitution >= 0 && collider.restitution <= 1))
    throw std::invalid_argument("collider \"" + collider.name + "\": restitution must be in [0, 1]");
  for (const Shape& shape : collider.shapes) {
    const auto* box = std::get_if<Box>(&shape);
    if (box && !(box->half_extent.array() > 0).all())
      throw std::invalid_argument("collider \"" + collider.name + "\": a box's half extents must be positive");
    const auto* set = std::get_if<LevelSet>(&shape);
    if (set && !set->grid) throw std::invalid_argument("collider \"" + collider.name + "\": a level set needs a grid");
  }
  colliders_.push_back(std::move(collider));
  wake();
}

void World::wake() {
  for (const auto& body : bodies_) body->wake();
}

std::vector<StepReport> World::take_warnings() {
  std::vector<StepReport> all;
  for (const auto& body : bodies_)
    for (StepReport& warning : body->take_warnings()) all.push_back(std::move(warning));
  return all;
}

void World::set_gravity(const Vec3& gravity) {
  if (!gravity.allFinite()) throw std::invalid_argument("World: gravity must be finite");
  gravity_ = gravity;
}

void World::set_damping(double fraction_per_second) {
  if (!(fraction_per_second >= 0 && fraction_per_second < 1))
    throw std::invalid_argument("World: damping is a fraction per second in [0, 1), got " +
                                std::to_string(fraction_per_second));
  if (damping_ != fraction_per_second) wake();
  damping_ = fraction_per_second;
}

void World::set_threads(int threads) {
  gang_ = std::make_unique<Gang>(threads);
  if (threads == 1) gang_ = nullptr;
}

void World::clear_forces() {
  for (const auto& body : bodies_) body->clear_forces();
}

// Bodies without physics are skipped. `work` also gets the body's place in bodies_.
void World::for_each_body(const std::function<void(Body&, std::size_t)>& work) {
  const auto one = [&](Index i) {
    Body& body = *bodies_[std::size_t(i)];
    if (body.has_physics()) work(body, std::size_t(i));
  };
  const Index n = Index(bodies_.size());
  if (parallel_for_ && n > 1) {
    parallel_for_(n, one);
  } else {
    for (Index i = 0; i < n; ++i) one(i);
  }
}

StepReport World::update(double frame_seconds) {
  const double waiting = clock_.remainder();
  const std::int64_t ticks = clock_.bank(frame_seconds);
  const double t0 = clock_.time(), t1 = clock_.time_at(clock_.ticks() + ticks);
  const auto begin = [&](Body& body, std::size_t) { body.begin_frame(frame_seconds, waiting, t0, t1); };
  for_each_body(std::ref(begin));  // by reference: a std::function of all it holds would allocate
  for (std::int64_t i = 0; i < ticks; ++i)
    if (StepReport report = step(); !report.good()) return report;
  clear_forces();
  return {};
}

// One tick. Accelerations, velocities and positions are the business of each body's method.
StepReport World::step() {
  const Tick tick{clock_.time(), clock_.time_at(clock_.ticks() + 1), gravity(), colliders_,
                  parallel_for_ && bodies_.size() > 1 ? nullptr : gang_.get()};
  reports_.assign(bodies_.size(), {});
  for_each_body([&](Body& body, std::size_t i) { reports_[i] = body.advance(tick); });
  for (const StepReport& report : reports_) {
    if (report.good()) continue;
    for_each_body([&](Body& body, std::size_t i) {
      if (reports_[i].good()) body.take_back();
    });
    return report;
  }
  if (damping_ > 0) {
    const double factor = std::pow(1 - damping_, tick.end - tick.start);
    for_each_body([&](Body& body, std::size_t) { body.damp(factor); });
  }
  clock_.count_tick();
  return {};
}

Energy World::energy() const {
  Energy sum;
  for (const auto& body : bodies_) {
    const Energy energy = body->energy(gravity());
    sum.kinetic += energy.kinetic;
    sum.gravitational += energy.gravitational;
    sum.elastic += energy.elastic;
  }
  return sum;
}

Vec3 World::momentum() const {
  Vec3 sum = Vec3::Zero();
  for (const auto& body : bodies_) sum += body->momentum();
  return sum;
}

Vec3 World::displacement() const {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (const auto& body : bodies_) {
    sum += body->total_mass() * body->displacement();
    mass += body->total_mass();
  }
  return mass > 0 ? Vec3(sum / mass) : sum;
}

// ---- Checkpoints

namespace {

// Grids are known by where they are and what they say there.
void add_shape(CheckpointWriter& out, const Shape& shape) {
  out.add(std::uint8_t(shape.index()));
  if (const auto* plane = std::get_if<HalfSpace>(&shape)) {
    out.add(plane->normal), out.add(plane->offset);
  } else if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    out.add(sphere->center), out.add(sphere->radius);
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    out.add(capsule->a), out.add(capsule->b), out.add(capsule->radius);
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    out.add(box->center), out.add(box->half_extent), out.add(box->axes);
  } else if (const auto* set = std::get_if<LevelSet>(&shape)) {
    out.add(set->offset);
    for (const Vec3& place : {Vec3(0, 0, 0), Vec3(0.1, 0.2, 0.3)}) out.add(signed_distance(*set, set->offset + place));
  }
}

}  // namespace

Blueprint World::blueprint() const {
  Blueprint out;
  out.add("tick_rate", clock_.tick_rate());
  out.add("number of colliders", Index(colliders_.size()));
  for (const Collider& collider : colliders_) {
    const std::string what = "collider \"" + collider.name + "\"";
    CheckpointWriter shapes;
    for (const Shape& shape : collider.shapes)
      if (collider.motion)
        shapes.add(std::uint8_t(shape.index()));
      else
        add_shape(shapes, shape);
    out.add_sum(what + ": shapes", shapes);
    out.add(what + ": friction", collider.friction);
    out.add(what + ": restitution", collider.restitution);
    out.add(what + ": has motion", bool(collider.motion));
    out.add(what + ": has distance", bool(collider.distance));
  }
  out.add("number of bodies", Index(bodies_.size()));
  for (const auto& body : bodies_) out.add("body", body->name());
  return out;
}

void World::save_state(CheckpointWriter& out) const {
  out.begin("clock");
  out.add(clock_.ticks());
  out.add(clock_.remainder());
  out.add(gravity_);
  out.add(gravity_on_);
  out.add(damping_);
  out.end();
  for (const auto& body : bodies_) {
    out.begin("body " + body->name());
    out.add(body->has_physics());
    body->save(out);
    out.end();
  }
}

void World::load_state(CheckpointReader& in) {
  in.begin("clock");
  // Ticks that a double can count.
  const auto ticks = in.number<std::int64_t>("ticks", 0, std::int64_t(1) << 53);
  clock_.set(ticks, in.number<double>("remainder", 0, clock_.tick()));
  in.array("gravity", gravity_, 3);
  gravity_on_ = in.number<bool>("gravity is on");
  damping_ = in.number<double>("damping", 0, 1);
  in.require(damping_ < 1, "damping", "must be below 1");
  in.end();
  for (const auto& body : bodies_) {
    in.begin("body " + body->name());
    body->set_physics(in.number<bool>("has physics"));
    body->load(in);
    in.end();
  }
}

void World::save(CheckpointWriter& out) const {
  out.begin("world");
  out.begin("settings");
  blueprint().save(out);
  for (const auto& body : bodies_) {
    Blueprint settings;
    body->describe(settings);
    out.begin("body " + body->name());
    settings.save(out);
    out.end();
  }
  out.end();
  save_state(out);
  out.end();
}

void World::load(CheckpointReader& in) {
  in.begin("world");
  in.begin("settings");
  blueprint().check(in);
  for (const auto& body : bodies_) {
    Blueprint settings;
    body->describe(settings);
    in.begin("body " + body->name());
    settings.check(in);
    in.end();
  }
  in.end();
  CheckpointWriter before;
  save_state(before);
  try {
    load_state(in);
    in.end();
  } catch (...) {
    CheckpointReader back(before.contents(), "the world before");
    load_state(back);
    throw;
  }
}

void World::save(std::ostream& file) const {
  CheckpointWriter out;
  save(out);
  const std::string bytes = out.file();
  file.write(bytes.data(), std::streamsize(bytes.size()));
  if (!file.flush()) throw OutputError("checkpoint: cannot write " + std::to_string(bytes.size()) + " bytes");
}

void World::load(std::istream& file, const std::string& name) {
  CheckpointReader in = CheckpointReader::read(file, name);
  load(in);
  in.finish();
}

}  // namespace hooke
