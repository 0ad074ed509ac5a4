#include <scene/particles.hpp>

#include <hooke/io/mesh_file.hpp>
#include <hooke/vdb/volume_file.hpp>
#include <scene/parts.hpp>
#include <scene/told.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hooke::scene {

namespace {

using particles::ParticleSystem;
using particles::SubEmitterSettings;

constexpr Index kMostParticles = 10'000'000;  // a typing error must not fill the memory
constexpr double kLongest = 1e6;              // [s]
constexpr double kMostRate = 1e7;             // [1/s]
constexpr double kShortestPeriod = 1e-4;      // [s], of bursts
constexpr double kDegree = std::numbers::pi / 180;

Range half_angle() { return Range::between(0, 180, "from 0 to 180"); }
Range mass_rule() { return Range::between(1e-30, 1e30, "from 1e-30 to 1e30"); }
Range speed_rule() { return Range::between(-1e9, 1e9, "from -1e9 to 1e9"); }
Range time_rule() { return Range::between(-kLongest, kLongest, "from -1e6 to 1e6"); }

// A number, or [least, most].
particles::Range read_range(const Value& value, const Range& rule, const char* unit = "") {
  if (value.json().is_number()) return value.number(rule, unit);
  if (!value.json().is_array() || value.json().size() != 2) value.fail_got("must be a number or [least, most]");
  const double least = value.at(0).number(rule, unit), most = value.at(1).number(rule, unit);
  if (!(most >= least))
    value.fail("must be in order, got [" + value.at(0).json().dump() + ", " + value.at(1).json().dump() + "]");
  return {least, most};
}

particles::Range read_range(const Object& object, std::string_view key, const particles::Range& otherwise,
                            const Range& rule, const char* unit = "") {
  const auto found = object.find(key);
  return found ? read_range(*found, rule, unit) : otherwise;
}

// The pairs of [[at, value], …], which must be in order.
std::vector<double> read_ats(const Value& value, const Range& rule, const char* unit) {
  std::vector<double> ats;
  if (value.array() == 0) value.fail("must have at least one point");
  for (std::size_t i = 0; i < value.array(); ++i) {
    const Value pair = value.at(i);
    if (!pair.json().is_array() || pair.json().size() != 2) pair.fail_got(std::string("must be a pair in brackets"));
    ats.push_back(pair.at(0).number(rule, unit));
    if (i > 0 && !(ats[i] > ats[i - 1]))
      pair.at(0).fail_got("must be above the one before, " + value.at(i - 1).at(0).json().dump());
  }
  return ats;
}

// A number, or [[at, number], …].
particles::Curve read_curve(const Value& value, const Range& at_rule, const char* at_unit, const Range& rule,
                            const char* unit = "") {
  if (value.json().is_number()) return value.number(rule, unit);
  if (!value.json().is_array()) value.fail_got("must be a number or an array of pairs");
  const std::vector<double> ats = read_ats(value, at_rule, at_unit);
  std::vector<double> values;
  for (std::size_t i = 0; i < ats.size(); ++i) values.push_back(value.at(i).at(1).number(rule, unit));
  return {ats, values};
}

void read_kind_color(const Value& value, ParticleKind& kind) {
  if (value.json().is_object()) {
    if (kind.look != Look::Spark) value.fail("only sparks glow: give a color");
    const Object object(value, "temperature");
    kind.temperature =
        read_curve(object["temperature"], fraction(), "", Range::between(500, 20000, "from 500 to 20000"), "K");
    return;
  }
  kind.color.ages.clear(), kind.color.colors.clear();
  if (value.array() > 0 && value.at(0).json().is_number()) {
    kind.color = {{0}, {read_color(value)}};
    return;
  }
  kind.color.ages = read_ats(value, fraction(), "");
  for (std::size_t i = 0; i < kind.color.ages.size(); ++i) kind.color.colors.push_back(read_color(value.at(i).at(1)));
}

ParticleKind read_kind(const Value& value) {
  const Object object(value, "kind");
  ParticleKind kind;
  kind.name = object["name"].text();
  if (const auto look = object.find("look")) {
    const std::vector<std::string> names{"spark", "smoke", "drop", "water"};
    kind.look = Look(std::find(names.begin(), names.end(), look->choice(names)) - names.begin());
  }
  if (const auto color = object.find("color")) read_kind_color(*color, kind);
  if (const auto size = object.find("size")) kind.size = read_curve(*size, fraction(), "", Range::not_negative());
  if (const auto opacity = object.find("opacity")) {
    if (kind.look == Look::Spark) opacity->fail("is for smoke, drops and water");
    kind.opacity = read_curve(*opacity, fraction(), "", fraction());
  }
  if (const auto intensity = object.find("intensity")) {
    if (kind.look != Look::Spark) intensity->fail("is for sparks");
    kind.intensity = intensity->number(Range::not_negative());
  }
  return kind;
}

// Its number.
int read_kind_name(const Value& value, const std::vector<ParticleKind>& kinds) {
  std::vector<std::string> names;
  for (const ParticleKind& kind : kinds) names.push_back(kind.name);
  const std::string name = value.choice(names);
  return int(std::find(names.begin(), names.end(), name) - names.begin());
}

particles::Source read_source(const Object& object, const std::filesystem::path& folder, std::filesystem::path& mesh) {
  const std::string shape = object.has("shape")
                                ? object["shape"].choice({"point", "line", "disc", "cone", "sphere", "box", "mesh"})
                                : "point";
  const std::vector<std::pair<const char*, std::vector<std::string>>> owners{{"to", {"line"}},
                                                                             {"radius", {"disc", "cone", "sphere"}},
                                                                             {"inner_radius", {"disc", "sphere"}},
                                                                             {"angle", {"cone"}},
                                                                             {"half_extent", {"box"}},
                                                                             {"file", {"mesh"}}};
  for (const auto& [key, shapes] : owners) {
    if (!object.has(key) || std::find(shapes.begin(), shapes.end(), shape) != shapes.end()) continue;
    std::string list;
    for (const std::string& each : shapes) list += (list.empty() ? "" : ", ") + each;
    object[key].fail("belongs to the shape " + list + ", got the shape " + shape);
  }
  const auto inner = [&](double radius) {
    return object.number("inner_radius", 0, Range::between(0, radius, "from 0 to radius"), "m");
  };
  if (shape == "line") return particles::LineSource{object["to"].vec3()};
  if (shape == "disc") {
    const double radius = object["radius"].number(Range::not_negative(), "m");
    return particles::DiscSource{radius, inner(radius)};
  }
  if (shape == "cone") {
    const Range below{0, 90, true, false, "from 0 to below 90"};
    return particles::ConeSource{object["radius"].number(Range::not_negative(), "m"),
                                 kDegree * object["angle"].number(below, "degrees")};
  }
  if (shape == "sphere") {
    const double radius = object["radius"].number(Range::not_negative(), "m");
    return particles::SphereSource{radius, inner(radius)};
  }
  if (shape == "box") {
    const Value extent = object["half_extent"];
    if (extent.array() != 3) extent.fail_got("must be an array of 3 numbers");
    Vec3 half;
    for (int k = 0; k < 3; ++k) half[k] = extent.at(std::size_t(k)).number(Range::not_negative(), "m");
    return particles::BoxSource{half};
  }
  if (shape == "mesh") mesh = folder / object["file"].text();
  return particles::PointSource{};  // a mesh is read when the system is built
}

std::vector<particles::Burst> read_bursts(const Value& value) {
  std::vector<particles::Burst> bursts;
  for (std::size_t i = 0; i < value.array(); ++i) {
    const Object object(value.at(i), "burst");
    particles::Burst burst;
    burst.time = object.number("time", 0, Range::between(0, kLongest, "from 0 to 1e6"), "s");
    burst.count = object["count"].whole(0, kMostParticles);
    burst.period = object.number("period", 0, Range::between(kShortestPeriod, kLongest, "from 0.0001 to 1e6"), "s");
    bursts.push_back(burst);
  }
  return bursts;
}

ParticleEmitter read_emitter(const Value& value, const ParticleBody& body, const std::filesystem::path& folder) {
  const Object object(value, "emitter");
  ParticleEmitter emitter;
  particles::EmitterSettings& s = emitter.settings;
  s.source = read_source(object, folder, emitter.mesh);
  s.position = object.vec3("position", s.position);
  if (object.has("axis")) s.axis = read_direction(object["axis"]);
  if (const auto normal = object.find("along_normal")) s.along_normal = normal->truth();
  s.spread = kDegree * object.number("spread", 0, half_angle(), "degrees");
  if (!object.has("rate") && !object.has("bursts")) value.fail("needs a rate, bursts or both");
  if (const auto rate = object.find("rate"))
    s.rate = read_curve(*rate, time_rule(), "s", Range::between(0, kMostRate, "from 0 to 1e7"), "1/s");
  if (const auto bursts = object.find("bursts")) s.bursts = read_bursts(*bursts);
  s.start = object.number("start", 0, time_rule(), "s");
  if (const auto stop = object.find("stop")) {
    s.stop = stop->number(time_rule(), "s");
    if (!(s.stop >= s.start)) stop->fail_got("must be no earlier than start");
  }
  s.speed = read_range(object, "speed", s.speed, speed_rule(), "m/s");
  s.lifetime = read_range(object, "lifetime", s.lifetime, Range::positive(), "s");
  s.mass = read_range(object, "mass", s.mass, mass_rule(), "kg");
  s.size = read_range(object, "size", s.size, Range::not_negative(), "m");
  if (const auto motion = object.find("motion")) emitter.motion = read_drive(Object(*motion, "motion"));
  s.inherit = object.number("inherit", s.inherit, Range::any());
  if (const auto kind = object.find("kind")) s.kind = read_kind_name(*kind, body.kinds);
  // Emitters of one system must not throw the same dice.
  s.seed = 4099 * body.settings.seed + body.emitters.size();
  return emitter;
}

SubEmitterSettings read_sub_emitter(const Value& value, const ParticleBody& body) {
  const Object object(value, "sub_emitter");
  SubEmitterSettings sub;
  const std::vector<std::string> events{"birth", "death", "impact"};
  sub.on =
      SubEmitterSettings::On(std::find(events.begin(), events.end(), object["on"].choice(events)) - events.begin());
  sub.parent_kind = read_kind_name(object["parent"], body.kinds);
  sub.kind = read_kind_name(object["kind"], body.kinds);
  if (sub.kind == sub.parent_kind) object["kind"].fail_got("must be another than the parent, or they would never end");
  sub.probability = object.number("probability", sub.probability, fraction());
  sub.count = read_range(object, "count", sub.count, Range::between(0, 1e4, "from 0 to 1e4"));
  if (const auto least = object.find("least_impact")) {
    if (sub.on != SubEmitterSettings::On::Impact) least->fail("is for impacts");
    sub.least_impact = least->number(Range::not_negative(), "m/s");
  }
  if (object.has("axis")) sub.axis = read_direction(object["axis"]);
  sub.spread = kDegree * object.number("spread", 180, half_angle(), "degrees");
  sub.speed = read_range(object, "speed", sub.speed, speed_rule(), "m/s");
  sub.inherit = object.number("inherit", sub.inherit, Range::any());
  sub.lifetime = read_range(object, "lifetime", sub.lifetime, Range::positive(), "s");
  sub.size = read_range(object, "size", sub.size, Range::not_negative(), "m");
  sub.mass = object.number("mass", sub.mass, mass_rule(), "kg");
  sub.seed = body.settings.seed;
  return sub;
}

ParticleForce read_force(const Value& value, const std::filesystem::path& folder) {
  if (!value.json().is_object()) value.fail_got("must be an object");
  const auto found = value.json().find("force");
  if (found == value.json().end()) value.fail("the key \"force\" is missing");
  const std::string name = Value(*found, value.file(), value.path() + ".force")
                               .choice({"linear-drag", "quadratic-drag", "attractor", "turbulence", "vortex",
                                        "velocity-field", "repulsion"});
  std::string kind = name;
  std::replace(kind.begin(), kind.end(), '-', '_');
  const Object object(value, kind);
  const auto rate = [&] { return object["rate"].number(Range::not_negative(), "1/s"); };
  if (name == "linear-drag" || name == "quadratic-drag") {
    Drag drag;
    drag.quadratic = name == "quadratic-drag";
    drag.coefficient = object["coefficient"].number(Range::not_negative(), drag.quadratic ? "N s2/m2" : "N s/m");
    drag.wind = object.vec3("wind", drag.wind);
    return drag;
  }
  if (name == "attractor")
    return Attractor{object["place"].vec3(), object["strength"].number(Range::any(), "m3/s2"),
                     object.number("radius", Attractor().radius, Range::positive(), "m")};
  if (name == "turbulence") {
    Turbulence turbulence;
    auto& noise = turbulence.noise;
    noise.speed = object["speed"].number(Range::not_negative(), "m/s");
    noise.size = object["size"].number(Range::positive(), "m");
    noise.turnover = object.number("turnover", noise.turnover, Range::positive(), "s");
    if (const auto seed = object.find("seed")) noise.seed = std::uint32_t(seed->whole(0, 0xffffffff));
    turbulence.rate = rate();
    return turbulence;
  }
  if (name == "vortex") {
    Vortex vortex;
    vortex.place = object["place"].vec3();
    if (object.has("axis")) vortex.axis = read_direction(object["axis"]);
    vortex.circulation = object["circulation"].number(Range::any(), "m2/s");
    vortex.core = object["core"].number(Range::positive(), "m");
    vortex.updraught = object.number("updraught", 0, Range::any(), "m/s");
    vortex.rate = rate();
    return vortex;
  }
  if (name == "velocity-field")
    return VelocityField{folder / object["file"].text(), object.has("grid") ? object["grid"].text() : "",
                         object.vec3("place", Vec3::Zero()), rate()};
  return Repulsion{object["stiffness"].number(Range::not_negative(), "1/s2"),
                   object["distance"].number(Range::positive(), "m")};
}

void read_contact(const Value& value, particles::ParticleSettings& settings) {
  if (value.json().is_boolean()) {
    if (value.truth()) value.fail_got("must be false or an object");
    settings.collides = false;
    return;
  }
  const Object object(value, "contact");
  settings.radius = object.number("radius", settings.radius, Range::not_negative(), "m");
  settings.restitution = object.number("restitution", settings.restitution, fraction());
  settings.rest_speed = object.number("rest_speed", settings.rest_speed, Range::not_negative(), "m/s");
  if (const auto exact = object.find("exact")) settings.exact_impacts = exact->truth();
  if (const auto dies = object.find("dies")) settings.dies_on_impact = dies->truth();
}

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Method* method : methods()) names.emplace_back(method->name);
  return names;
}

template <class S>
std::unique_ptr<particles::Force<S>> make_force(const ParticleForce& says, const Vec3& origin) {
  const auto flow = [](auto made, double rate) -> std::unique_ptr<particles::Force<S>> {
    return std::make_unique<particles::FlowDrag<S>>(std::move(made), rate);
  };
  if (const auto* drag = std::get_if<Drag>(&says)) {
    if (drag->quadratic) return std::make_unique<particles::QuadraticDrag<S>>(drag->coefficient, drag->wind);
    return std::make_unique<particles::LinearDrag<S>>(drag->coefficient, drag->wind);
  }
  if (const auto* to = std::get_if<Attractor>(&says))
    return std::make_unique<particles::Attractor<S>>(origin + to->place, to->strength, to->radius);
  if (const auto* air = std::get_if<Turbulence>(&says)) {
    const auto& n = air->noise;
    return flow(std::make_unique<particles::CurlNoise<S>>(
                    typename particles::CurlNoise<S>::Settings{n.speed, n.size, n.turnover, n.seed}),
                air->rate);
  }
  if (const auto* air = std::get_if<Vortex>(&says))
    return flow(std::make_unique<particles::Vortex<S>>(origin + air->place, air->axis, air->circulation, air->core,
                                                       air->updraught),
                air->rate);
  if (const auto* air = std::get_if<VelocityField>(&says)) {
    auto grid = std::make_shared<const VelocityGrid>(vdb::read_velocity_field(air->file, air->grid));
    return flow(std::make_unique<particles::GridFlow<S>>(std::move(grid), origin + air->place), air->rate);
  }
  const auto& apart = std::get<Repulsion>(says);
  return std::make_unique<particles::Repulsion<S>>(apart.stiffness, apart.distance);
}

particles::EmitterSettings settings_of(const ParticleEmitter& emitter, const Vec3& origin, double preroll) {
  particles::EmitterSettings s = emitter.settings;
  s.position += origin;
  s.start += preroll, s.stop += preroll;
  if (!emitter.mesh.empty())
    s.source = particles::MeshSource{std::make_shared<const TriangleMesh>(io::read_obj(emitter.mesh))};
  if (emitter.motion)
    s.path = [drive = *emitter.motion, preroll](double t) -> Vec3 { return drive.offset(t - preroll); };
  return s;
}

template <class S>
std::unique_ptr<ParticleSystem<S>> make_system(const ParticleBody& says, const std::string& file, double preroll) {
  particles::ParticleSettings settings = says.settings;
  for (const ParticleKind& kind : says.kinds) settings.kinds.push_back({kind.name, kind.color, kind.size});
  auto system = told_at(file, says.path, [&] { return std::make_unique<ParticleSystem<S>>(settings); });
  const auto at = [&](const char* key, std::size_t i) { return says.path + "." + key + "[" + std::to_string(i) + "]"; };
  for (std::size_t i = 0; i < says.forces.size(); ++i) {
    const bool from_file = std::holds_alternative<VelocityField>(says.forces[i]);
    told_at(file, at("forces", i) + (from_file ? ".file" : ""),
            [&] { system->add_force(make_force<S>(says.forces[i], settings.origin)); });
  }
  for (std::size_t i = 0; i < says.emitters.size(); ++i)
    told_at(file, at("emitters", i) + (says.emitters[i].mesh.empty() ? "" : ".file"),
            [&] { system->add_emitter(settings_of(says.emitters[i], settings.origin, preroll)); });
  for (std::size_t i = 0; i < says.sub_emitters.size(); ++i)
    told_at(file, at("sub_emitters", i), [&] { system->add_sub_emitter(says.sub_emitters[i]); });
  return system;
}

}  // namespace

ParticleBody read_particles(const Value& value, std::size_t number, const std::filesystem::path& folder) {
  const Object object(value, "particles");
  ParticleBody body;
  body.path = value.path();
  particles::ParticleSettings& s = body.settings;
  s.name = object.has("name") ? object["name"].text() : "body" + std::to_string(number);
  s.origin = object.vec3("origin", s.origin);
  if (const auto capacity = object.find("capacity")) s.capacity = capacity->whole(1, kMostParticles);
  if (const auto full = object.find("at_capacity"))
    s.at_capacity = full->choice({"refuse", "oldest-dies"}) == "refuse"
                        ? particles::ParticleSettings::AtCapacity::Refuse
                        : particles::ParticleSettings::AtCapacity::OldestDies;
  s.seed = number + 1;
  if (const auto seed = object.find("seed")) s.seed = std::uint64_t(seed->whole(0, 0xffffffff));
  s.prewarm = object.number("prewarm", s.prewarm, Range::between(0, 1e4, "from 0 to 1e4"), "s");
  if (const auto trail = object.find("trail")) s.trail = trail->whole(0, 255);
  if (const auto contact = object.find("contact")) read_contact(*contact, s);

  if (const auto kinds = object.find("kinds")) {
    if (kinds->array() == 0 || kinds->array() > 256)
      kinds->fail("must have from 1 to 256 kinds, got " + std::to_string(kinds->array()));
    for (std::size_t i = 0; i < kinds->array(); ++i) {
      body.kinds.push_back(read_kind(kinds->at(i)));
      for (std::size_t k = 0; k < i; ++k)
        if (body.kinds[k].name == body.kinds[i].name)
          kinds->at(i).fail("two kinds are called \"" + body.kinds[i].name + "\"");
    }
  } else {
    body.kinds.emplace_back();
  }
  const Value emitters = object["emitters"];
  if (emitters.array() == 0) emitters.fail("must have at least one emitter");
  for (std::size_t i = 0; i < emitters.array(); ++i)
    body.emitters.push_back(read_emitter(emitters.at(i), body, folder));
  if (const auto forces = object.find("forces"))
    for (std::size_t i = 0; i < forces->array(); ++i) body.forces.push_back(read_force(forces->at(i), folder));
  if (const auto subs = object.find("sub_emitters"))
    for (std::size_t i = 0; i < subs->array(); ++i) body.sub_emitters.push_back(read_sub_emitter(subs->at(i), body));
  if (const auto found = object.find("solver")) {
    const Object solver(*found, "particle_solver");
    if (const auto method = solver.find("method")) s.method = &method_named(method->choice(method_names()));
    s.dt = solver.number("dt", s.dt, Range::positive(), "s");
    if (const auto precision = solver.find("precision"))
      body.in_double = precision->choice({"float", "double"}) == "double";
  }
  return body;
}

void override_solver(ParticleBody& body, const std::string& method, double dt, const std::string& precision) {
  const std::string who = "particles \"" + body.settings.name + "\": ";
  if (!method.empty()) {
    const std::vector<std::string> names = method_names();
    if (std::find(names.begin(), names.end(), method) == names.end()) {
      std::string list;
      for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
      throw Error(who + "the method must be one of " + list + ", got " + method);
    }
    body.settings.method = &method_named(method);
  }
  if (dt > 0) body.settings.dt = dt;
  if (precision.empty()) return;
  if (precision != "float" && precision != "double")
    throw Error(who + "the precision must be float or double, got " + precision);
  body.in_double = precision == "double";
}

SceneParticles::SceneParticles(const ParticleBody& description, const std::string& file, double preroll, World& world)
    : kinds_(description.kinds), forces_(description.forces.size()), sub_emitters_(description.sub_emitters.size()) {
  if (description.in_double)
    system_ = &world.add(make_system<double>(description, file, preroll));
  else
    system_ = &world.add(make_system<float>(description, file, preroll));
  body_ = std::visit([](auto* system) -> Body* { return system; }, system_);
}

const particles::ParticleSettings& SceneParticles::settings() const {
  return std::visit([](auto* system) -> const particles::ParticleSettings& { return system->settings(); }, system_);
}

const particles::Counts& SceneParticles::counts() const {
  return std::visit([](auto* system) -> const particles::Counts& { return system->counts(); }, system_);
}

Index SceneParticles::trail(Index i, Points<float>& out) const {
  return std::visit([&](auto* system) { return system->trail(i, out); }, system_);
}

ParticleView SceneParticles::view() const {
  return std::visit(
      [](auto* system) {
        ParticleView out;
        const Index n = system->size();
        system->appearance(out.colors, out.radii);
        out.positions = system->positions().template cast<float>();
        out.velocities = system->velocities().template cast<float>();
        out.ages.resize(n), out.lives.resize(n);
        for (Index i = 0; i < n; ++i) {
          const double life = system->lifetime(i);
          out.ages[i] = float(system->age(i));
          out.lives[i] = std::isfinite(life) ? float(system->age(i) / life) : 0.f;
          out.kinds.push_back(system->kind(i));
          out.serials.push_back(system->serial(i));
        }
        return out;
      },
      system_);
}

std::string SceneParticles::text() const {
  const auto count = [](std::size_t n, const std::string& what) {
    return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
  };
  const std::size_t emitters = std::visit([](auto* system) { return system->emitters().size(); }, system_);
  return std::to_string(body_->size()) + " of at most " + std::to_string(settings().capacity) + " particles, " +
         count(emitters, "emitter") + ", " + count(forces_, "force") + ", " + count(sub_emitters_, "sub-emitter") +
         ", " + count(kinds_.size(), "kind");
}

}  // namespace hooke::scene
