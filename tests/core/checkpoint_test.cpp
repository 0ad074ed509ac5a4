// A world that is saved and loaded goes on as if nothing had happened, bit for bit; what does not fit is refused with
// a reason and changes nothing.
#include "core/problems.hpp"

#include <hooke/checkpoint.hpp>
#include <hooke/error.hpp>
#include <hooke/linear_bodies.hpp>
#include <hooke/particles/particle_system.hpp>
#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/filtered_leapfrog.hpp>
#include <hooke/softbody/soft_body.hpp>

#include <fuzz.hpp>

#include <gmock/gmock.h>

#include <sstream>

namespace hooke::test {
namespace {

using softbody::Precision;
using ::testing::HasSubstr;

// Builds a world, always the same, and what its user does before frame i.
struct Story {
  std::string name;
  std::function<std::unique_ptr<World>()> build;
  std::function<void(World&, int frame)> act = [](World&, int) {};
};

// Neither a whole number of ticks nor the same number in every frame.
constexpr double kFrame = 0.0173;
constexpr int kBefore = 7, kAfter = 9;

void run(const Story& story, World& world, int from, int to) {
  for (int i = from; i < to; ++i) {
    story.act(world, i);
    const StepReport report = world.update(kFrame);
    ASSERT_TRUE(report.good()) << report.text();
  }
}

std::string saved(const World& world) {
  std::ostringstream file;
  world.save(file);
  return file.str();
}

void load(World& world, const std::string& bytes) {
  std::istringstream file(bytes);
  world.load(file, "FILE");
}

std::string refusal(World& world, const std::string& bytes) {
  try {
    load(world, bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was refused";
}

void expect_same(const World& a, const World& b) {
  EXPECT_EQ(a.clock().ticks(), b.clock().ticks());
  for (std::size_t i = 0; i < a.bodies().size(); ++i) {
    const Body &x = *a.bodies()[i], &y = *b.bodies()[i];
    ASSERT_EQ(x.size(), y.size()) << x.name();
    EXPECT_TRUE((x.positions() == y.positions()).all()) << x.name();
    EXPECT_TRUE((x.velocities() == y.velocities()).all()) << x.name();
    EXPECT_TRUE((x.positions_between(0.3) == y.positions_between(0.3)).all()) << x.name();
    EXPECT_TRUE((x.start_positions() == y.start_positions()).all()) << x.name();
    EXPECT_EQ(x.motion_facts().evaluations, y.motion_facts().evaluations) << x.name();
    EXPECT_EQ(x.motion_facts().substeps, y.motion_facts().substeps) << x.name();
  }
  EXPECT_TRUE(saved(a) == saved(b)) << "some state differs";
}

// ---- Worlds

softbody::SoftBodySettings sheet(const Method& method, Precision precision, int points = 6, bool damped = false) {
  softbody::ClothMaterial material;
  material.stretch = 50, material.shear = 10, material.bend = 1;
  if (!damped) material.damping_ratio = {0, 0, 0};
  softbody::SoftBodySettings settings =
      softbody::settings_of(softbody::cloth_from_grid(1, 1, points, points, {1, 0, 0}, {0, -1, 0}, material));
  settings.name = "sheet";
  settings.origin = {3, 1, -2};
  settings.motion.method = &method;
  settings.motion.thickness = 0.005;
  if (&method == &explicit_euler()) settings.motion.dt = 5e-5;  // it is never stable
  settings.precision = precision;
  for (int i = 0; i < points; ++i) settings.pins.push_back(i);
  return settings;
}

void add_colliders(World& world) {
  world.add_collider({"ball", {Sphere{{3.5, 0.6, -2}, 0.2}}, {}, {}, 0.4, 0.1});
  Collider arm{"arm", {Capsule{{3, 0.5, -2.5}, {4, 0.5, -2.5}, 0.1}}, {}, {}, 0.2, 0};
  arm.motion = [](double t, std::span<Shape> shapes) {
    std::get<Capsule>(shapes[0]).a.z() = std::get<Capsule>(shapes[0]).b.z() = -2.5 + 2 * t;
  };
  world.add_collider(arm);
}

// Forces that outlast their frames, a pin on its way, another let go, gravity that turns.
void act_on_sheet(World& world, int frame) {
  Body& body = *world.find("sheet");
  if (frame >= kBefore - 3) body.add_force(14, {0.3, 0.1 * frame, 0.2});
  if (frame % 2 == 0) body.move_pin(1, {3.2 + 0.01 * frame, 1, -2});
  if (frame == kBefore + 1) body.move_pin(1, {3.2, 1.01, -2});
  if (frame == 3) body.release(4);
  if (frame == 4) body.pin(20);
  if (frame == 5) world.set_gravity({0.5, -9, 0});
  if (frame == kBefore + 2) body.release(20);
}

Story hanging(const Method& method, Precision precision, bool contacts, bool driven) {
  return {std::string(method.name) + " " + std::string(softbody::precision_name(precision)) +
              (contacts ? " contacts" : "") + (driven ? " driven" : ""),
          [&method, precision, contacts, driven] {
            auto world = std::make_unique<World>(240);
            if (contacts) add_colliders(*world);
            const bool drag = contacts && method.accepts_velocity_forces;
            auto settings = sheet(method, precision, 6, drag);
            if (drag) settings.linear_drag = 1e-3;
            if (drag) settings.wind = softbody::Wind{{1, 0, 2}};
            Body& body = world->add(softbody::make_soft_body(settings));
            if (driven)
              body.drive_pins({0, 5}, [](double t, Points<double>& place) {
                place = rows({{3 + 0.1 * std::sin(9 * t), 1, -2}, {4, 1 + 0.05 * t, -2}});
              });
            world->set_damping(contacts ? 0.2 : 0);
            return world;
          },
          act_on_sheet};
}

// In float, stepped in double: what the state drops goes on, too.
Story fine_steps() {
  return {"fine steps",
          [] {
            auto world = std::make_unique<World>(240);
            auto settings = sheet(velocity_verlet(), Precision::Float, 6, false);
            settings.motion.dt = 0.05 * softbody::make_soft_body(settings)->stable_step(velocity_verlet());
            world->add(softbody::make_soft_body(settings));
            return world;
          },
          act_on_sheet};
}

template <class S>
Story snooker() {
  return {"linear bodies", [] {
            auto world = std::make_unique<World>(240);
            world->add_collider({"floor", {HalfSpace{{0, 1, 0}, 0}}, {}, {}, 0.3, 0});
            std::vector<LinearBody> bodies(6);
            for (std::size_t i = 0; i < bodies.size(); ++i) {
              bodies[i].shape = BallShape{0.1};
              bodies[i].position = {0.21 * double(i), 0.12 + 0.03 * double(i), 0};
              bodies[i].velocity = {i == 0 ? 5.0 : 0.0, -1, 0};
              bodies[i].mass = 1 + double(i);
            }
            bodies[3].shape = BoxShape{{0.1, 0.05, 0.1}};
            world->add(std::make_unique<LinearBodies<S>>("balls", bodies));
            return world;
          }};
}

template <class S>
Story jet(const Method& method, double dt = 0, bool oldest_dies = false) {
  using namespace particles;
  return {"particles " + std::string(method.name),
          [&method, dt, oldest_dies] {
            auto world = std::make_unique<World>(240);
            world->add_collider({"floor", {HalfSpace{{0, 1, 0}, 0}}, {}, {}, 0.3, 0.5});
            world->add_collider({"ball", {Sphere{{0.4, 0.1, 0}, 0.15}}, {}, {}, 0.3, 0.5});
            ParticleSettings settings;
            settings.method = &method;
            settings.dt = dt;
            settings.capacity = 300;
            settings.tile = 32;
            if (oldest_dies) settings.at_capacity = ParticleSettings::AtCapacity::OldestDies;
            settings.trail = 5;
            settings.prewarm = 0.05;
            auto system = std::make_unique<ParticleSystem<S>>(settings);
            EmitterSettings emitter;
            emitter.source = DiscSource{0.05, 0};
            emitter.position = {0, 0.1, 0};
            emitter.axis = {1, 0.2, 0};
            emitter.spread = 0.4;
            emitter.rate = 2000;
            emitter.speed = {2, 5};
            emitter.lifetime = {0.05, 0.3};
            emitter.mass = {0.5, 2};
            system->add_emitter(emitter);
            for (const auto on :
                 {SubEmitterSettings::On::Birth, SubEmitterSettings::On::Death, SubEmitterSettings::On::Impact}) {
              SubEmitterSettings sub;
              sub.on = on;
              sub.probability = 0.3;
              sub.lifetime = {0.02, 0.1};
              sub.kind = 1 + int(on);
              system->add_sub_emitter(sub);
            }
            if (method.accepts_velocity_forces)
              system->add_force(std::make_unique<particles::QuadraticDrag<S>>(0.05, Vec3(0, 1, 0)));
            system->add_force(std::make_unique<Attractor<S>>(Vec3(0.5, 0.5, 0), 0.3, 0.1));
            system->add_force(std::make_unique<Repulsion<S>>(500, 0.02));
            world->add(std::move(system));
            return world;
          },
          [](World& world, int frame) {
            Body& body = *world.bodies()[0];
            if (frame == 2) body.set_physics(false);
            if (frame == 3) body.set_physics(true);
            for (Index i = 0; frame > 3 && i < body.size(); i += 3) body.add_force(i, {0, 0.5, 0.1});
          }};
}

std::vector<Story> stories() {
  std::vector<Story> out;
  for (const Method* method : methods())
    for (const Precision precision : {Precision::Float, Precision::Double}) {
      out.push_back(hanging(*method, precision, true, true));
      out.push_back(hanging(*method, precision, false, false));
    }
  out.push_back(hanging(velocity_verlet(), Precision::DoubleFloat, false, false));
  for (const Precision precision : {Precision::Float, Precision::Double})
    for (const bool contacts : {false, true})
      for (const bool driven : {false, true})
        out.push_back(hanging(softbody::filtered_leapfrog(), precision, contacts, driven));
  out.push_back(fine_steps());
  out.push_back(snooker<float>());
  out.push_back(snooker<double>());
  for (const Method* method : {&verlet(), &rk4(), &implicit_euler(), &dormand_prince()}) {
    out.push_back(jet<float>(*method));
    out.push_back(jet<double>(*method, 0, true));
  }
  out.push_back(jet<double>(velocity_verlet(), 1e-3));
  return out;
}

TEST(Checkpoint, WhatIsLoadedGoesOnWithTheSameBits) {
  for (const Story& story : stories()) {
    SCOPED_TRACE(story.name);
    const auto world = story.build();
    run(story, *world, 0, kBefore);
    const std::string bytes = saved(*world);
    run(story, *world, kBefore, kBefore + kAfter);

    const auto fresh = story.build();
    load(*fresh, bytes);
    EXPECT_TRUE(saved(*fresh) == bytes);
    run(story, *fresh, kBefore, kBefore + kAfter);
    expect_same(*world, *fresh);

    // Back in time, over whatever there is.
    load(*world, bytes);
    run(story, *world, kBefore, kBefore + kAfter);
    expect_same(*world, *fresh);
    if (HasFailure()) break;
  }
}

TEST(Checkpoint, ThreadsMayDifferOnBothSides) {
  const Story story = jet<float>(dormand_prince());
  const auto one = story.build(), three = story.build();
  run(story, *one, 0, kBefore);
  three->set_threads(3);
  load(*three, saved(*one));
  run(story, *one, kBefore, kBefore + kAfter);
  run(story, *three, kBefore, kBefore + kAfter);
  expect_same(*one, *three);
}

TEST(Checkpoint, HandlesAndTrailsSurvive) {
  const Story story = jet<double>(verlet());
  const auto world = story.build(), other = story.build();
  run(story, *world, 0, kBefore);
  load(*other, saved(*world));
  const auto& a = dynamic_cast<particles::ParticleSystem<double>&>(*world->bodies()[0]);
  const auto& b = dynamic_cast<particles::ParticleSystem<double>&>(*other->bodies()[0]);
  ASSERT_GT(a.size(), 10);
  EXPECT_GT(a.counts().died, 0);
  EXPECT_GT(a.counts().impacts, 0);
  Points<float> x, y;
  for (Index i = 0; i < a.size(); ++i) {
    EXPECT_EQ(b.find(a.handle(i)), i);
    EXPECT_EQ(a.age(i), b.age(i));
    EXPECT_EQ(a.kind(i), b.kind(i));
    const Index length = a.trail(i, x);
    ASSERT_EQ(length, b.trail(i, y));
    EXPECT_TRUE((x.topRows(length) == y.topRows(length)).all());
  }
}

// ---- What is refused

std::unique_ptr<World> small_world() {
  auto world = std::make_unique<World>(240);
  add_colliders(*world);
  world->add(softbody::make_soft_body(sheet(velocity_verlet(), Precision::Float, 4)));
  return world;
}

TEST(Checkpoint, AnotherWorldIsRefusedWithTheReasonAndNothingChanges) {
  const auto saved_world = small_world();
  ASSERT_TRUE(saved_world->update(0.1).good());
  const std::string bytes = saved(*saved_world);
  const auto refused = [&](World& world, const std::string& words) {
    ASSERT_TRUE(world.update(0.01).good());
    const std::string before = saved(world);
    EXPECT_THAT(refusal(world, bytes), HasSubstr(words));
    EXPECT_TRUE(saved(world) == before) << words;
  };
  const auto with = [&](const std::string& words, const std::function<void(softbody::SoftBodySettings&)>& change) {
    auto world = std::make_unique<World>(240);
    add_colliders(*world);
    auto settings = sheet(velocity_verlet(), Precision::Float, 4);
    change(settings);
    world->add(softbody::make_soft_body(settings));
    refused(*world, words);
  };
  with("body sheet: method is \"velocity-verlet\" in the checkpoint and \"rk4\" here",
       [](auto& settings) { settings.motion.method = &rk4(); });
  with("body sheet: precision is \"float\" in the checkpoint and \"double\"",
       [](auto& settings) { settings.precision = Precision::Double; });
  with("body sheet: dt is \"0\" in the checkpoint and \"0.001\"", [](auto& settings) { settings.motion.dt = 1e-3; });
  with("body sheet: masses is \"with checksum", [](auto& settings) { settings.masses[3] *= 2; });
  with("body is \"sheet\" in the checkpoint and \"flag\"", [](auto& settings) { settings.name = "flag"; });
  with("number of force fields is \"1\" in the checkpoint and \"2\"", [](auto& settings) { settings.linear_drag = 1; });
  with("springs is \"with checksum", [](auto& settings) {
    auto network = std::make_shared<softbody::SpringNetwork>(*settings.network);
    network->springs[5].stiffness *= 1.5;
    settings.network = network;
  });
  with("points is \"16\" in the checkpoint and \"25\"",
       [](auto& settings) { settings = sheet(velocity_verlet(), Precision::Float, 5); });
  World slow(120);
  refused(slow, "tick_rate is \"240\" in the checkpoint and \"120\"");
  const auto crowded = small_world();
  crowded->add_collider({"floor", {HalfSpace{}}, {}, {}, 0.3, 0});
  refused(*crowded, "number of colliders is \"2\" in the checkpoint and \"3\"");
  auto moved = std::make_unique<World>(240);
  add_colliders(*moved);
  refused(*moved, "number of bodies is \"1\" in the checkpoint and \"0\"");
}

TEST(Checkpoint, ForeignAndDamagedFilesAreRefusedWithTheReason) {
  const auto world = small_world();
  const std::string bytes = saved(*world);
  EXPECT_THAT(refusal(*world, ""), HasSubstr("FILE: is empty"));
  EXPECT_THAT(refusal(*world, "ply\nformat ascii 1.0\n"), HasSubstr("FILE: is not a checkpoint"));
  EXPECT_THAT(refusal(*world, bytes.substr(0, 20)), HasSubstr("FILE: is truncated"));
  EXPECT_THAT(refusal(*world, bytes.substr(0, bytes.size() - 1)), HasSubstr("FILE: is truncated"));
  EXPECT_THAT(refusal(*world, bytes + "x"), HasSubstr("FILE: is damaged: it goes on after its end"));
  std::string other = bytes;
  other[8] = 77;
  EXPECT_THAT(refusal(*world, other),
              HasSubstr("format version 77, this program reads version " + std::to_string(CheckpointWriter::kVersion)));
  other = bytes;
  other[300] ^= 1;
  EXPECT_THAT(refusal(*world, other), HasSubstr("FILE: is damaged: its checksum does not fit"));
}

TEST(Checkpoint, BodiesWithoutCheckpointsSaySo) {
  class Plain final : public PointBody<double> {
   public:
    Plain() : PointBody<double>("plain", point<double>({0, 0, 0}, {0, 0, 0}), {}) {}
    void save(CheckpointWriter& out) const override { Body::save(out); }
  };
  World world;
  world.add(std::make_unique<Plain>());
  EXPECT_THROW(saved(world), std::invalid_argument);
}

TEST(Checkpoint, EveryTruncationIsRefused) {
  for (const Story& story : {hanging(velocity_verlet(), Precision::Float, true, true), jet<float>(verlet())}) {
    const auto world = story.build();
    run(story, *world, 0, kBefore);
    const std::string bytes = saved(*world);
    const std::size_t step = std::max<std::size_t>(1, bytes.size() / 4000);
    for (std::size_t n = 0; n < bytes.size(); n += n < 2000 ? 1 : step)
      ASSERT_NE(refusal(*world, bytes.substr(0, n)), "nothing was refused") << n << " bytes of " << bytes.size();
    // The same with a head that fits.
    const std::string contents = bytes.substr(28);
    for (std::size_t n = 0; n < contents.size(); n += n < 2000 ? 1 : step) {
      CheckpointReader in(contents.substr(0, n), "FILE");
      ASSERT_THROW(world->load(in), Error) << n << " bytes of " << contents.size();
    }
    EXPECT_TRUE(saved(*world) == bytes) << "a refused file changed the world";
  }
}

// Any single changed byte is refused by the checksum; where the checksum was made to fit, the world loads or refuses,
// and a world that loaded steps or reports.
TEST(Checkpoint, DamagedBytesNeverCrash) {
  const std::uint64_t seed = test::fuzz_seed();
  SCOPED_TRACE("HOOKE_SEED=" + std::to_string(seed));
  std::mt19937 random{std::mt19937::result_type(seed)};
  std::vector<Story> all = {hanging(velocity_verlet(), Precision::Float, true, true),
                            hanging(dormand_prince(), Precision::Double, false, false),
                            hanging(softbody::filtered_leapfrog(), Precision::Float, false, true), snooker<double>(),
                            jet<float>(verlet(), 0, true)};
  for (const Story& story : all) {
    SCOPED_TRACE(story.name);
    const auto world = story.build();
    run(story, *world, 0, kBefore);
    const std::string bytes = saved(*world), contents = bytes.substr(28);
    const auto pick = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random); };
    int loaded = 0;
    for (int i = 0, n = test::fuzz_rounds(2000); i < n; ++i) {
      std::string damaged = bytes;
      damaged[pick(bytes.size())] ^= char(1 + pick(255));
      ASSERT_NE(refusal(*world, damaged), "nothing was refused");

      damaged = contents;
      for (std::size_t flips = 1 + pick(3); flips-- > 0;) {
        const std::size_t at = pick(contents.size());
        if (pick(2))
          damaged[at] ^= char(1 + pick(255));
        else
          damaged[at] = pick(2) ? char(0xff) : char(0);
      }
      CheckpointReader in(damaged, "FILE");
      try {
        world->load(in);
      } catch (const Error&) {
        continue;
      }
      ++loaded;
      // Substeps may have become many; what is asked here is memory, not time.
      if (loaded % 20 == 0) world->update(world->clock().tick());
      CheckpointReader back(contents, "FILE");
      world->load(back);
    }
    EXPECT_GT(loaded, 20);
    EXPECT_TRUE(saved(*world) == bytes);
  }
}

}  // namespace
}  // namespace hooke::test
