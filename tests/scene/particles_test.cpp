// Particle systems in scene files: every rule that can be broken, and what becomes of those that are kept.
#include "broken_scene.hpp"

#include <hooke/vdb/particle_file.hpp>
#include <scene/accuracy.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace hooke::scene {
namespace {

using ::testing::HasSubstr;

std::string with_bodies(const std::string& bodies, const std::string& keys = "") {
  return R"({"hooke": 1, )" + keys + R"("bodies": [)" + bodies + "]}";
}
std::string system(const std::string& keys, const std::string& emitters = R"([{"rate": 10}])") {
  return with_bodies(R"({"type": "particles", "name": "p", "emitters": )" + emitters +
                     (keys.empty() ? "" : ", " + keys) + "}");
}
std::string emitter(const std::string& keys) { return system("", R"([{"rate": 10, )" + keys + "}]"); }
std::string force(const std::string& keys) { return system(R"("forces": [{)" + keys + "}]"); }
std::string kind(const std::string& keys) { return system(R"("kinds": [{"name": "a", )" + keys + "}]"); }
std::string sub(const std::string& keys) {
  return system(R"("kinds": [{"name": "a"}, {"name": "b"}], "sub_emitters": [{)" + keys + "}]");
}

const std::vector<BrokenCase>& cases() {
  static const std::vector<BrokenCase> all{
      {"NoEmitters", with_bodies(R"({"type": "particles"})"), "bodies[0]: the key \"emitters\" is missing"},
      {"EmittersEmpty", system("", "[]"), "bodies[0].emitters: must have at least one emitter"},
      {"UnknownKey", system(R"("colour": 1)"), "bodies[0].colour: unknown key; known here: type, name"},
      {"Capacity", system(R"("capacity": 0)"), "bodies[0].capacity: must be a whole number from 1 to 10000000, got 0"},
      {"CapacityHuge", system(R"("capacity": 1e9)"), "bodies[0].capacity: must be a whole number from 1"},
      {"AtCapacity", system(R"("at_capacity": "drop")"),
       "bodies[0].at_capacity: must be one of refuse, oldest-dies, got \"drop\""},
      {"Seed", system(R"("seed": -1)"), "bodies[0].seed: must be a whole number from 0"},
      {"Prewarm", system(R"("prewarm": -1)"), "bodies[0].prewarm: must be from 0 to 1e4 [s], got -1"},
      {"Trail", system(R"("trail": 256)"), "bodies[0].trail: must be a whole number from 0 to 255, got 256"},
      {"ContactTrue", system(R"("contact": true)"), "bodies[0].contact: must be false or an object, got true"},
      {"ContactRadius", system(R"("contact": {"radius": -1})"),
       "bodies[0].contact.radius: must be 0 or more [m], got -1"},
      {"ContactRestitution", system(R"("contact": {"restitution": 2})"),
       "bodies[0].contact.restitution: must be from 0 to 1, got 2"},
      {"ContactRest", system(R"("contact": {"rest_speed": -1})"),
       "bodies[0].contact.rest_speed: must be 0 or more [m/s]"},
      {"ContactExact", system(R"("contact": {"exact": 1})"), "bodies[0].contact.exact: must be true or false, got 1"},
      {"NothingBorn", system("", R"([{"speed": 1}])"), "bodies[0].emitters[0]: needs a rate, bursts or both"},
      {"RateNegative", system("", R"([{"rate": -5}])"),
       "bodies[0].emitters[0].rate: must be from 0 to 1e7 [1/s], got -5"},
      {"RateNegativeInCurve", system("", R"([{"rate": [[0, 5], [1, -5]]}])"),
       "bodies[0].emitters[0].rate[1][1]: must be from 0 to 1e7 [1/s], got -5"},
      {"RateOrder", system("", R"([{"rate": [[1, 5], [1, 6]]}])"),
       "bodies[0].emitters[0].rate[1][0]: must be above the one before, 1, got 1"},
      {"RateEmpty", system("", R"([{"rate": []}])"), "bodies[0].emitters[0].rate: must have at least one point"},
      {"RatePair", system("", R"([{"rate": [[0, 1, 2]]}])"), "rate[0]: must be a pair in brackets, got an array of 3"},
      {"RateText", system("", R"([{"rate": "many"}])"), "rate: must be a number or an array of pairs, got \"many\""},
      {"RateNotFinite", system("", R"([{"rate": 1e999}])"), "bodies[0].emitters[0].rate: must be finite"},
      {"BurstCount", emitter(R"("bursts": [{"time": 0}])"), "bursts[0]: the key \"count\" is missing"},
      {"BurstNegative", emitter(R"("bursts": [{"count": -1}])"), "bursts[0].count: must be a whole number from 0"},
      {"BurstTime", emitter(R"("bursts": [{"count": 1, "time": -1}])"),
       "bursts[0].time: must be from 0 to 1e6 [s], got -1"},
      {"BurstPeriod", emitter(R"("bursts": [{"count": 1, "period": 1e-300}])"),
       "bursts[0].period: must be from 0.0001 to 1e6 [s]"},
      {"Shape", emitter(R"("shape": "torus")"),
       "shape: must be one of point, line, disc, cone, sphere, box, mesh, got"},
      {"ShapeKey", emitter(R"("shape": "point", "radius": 1)"),
       "bodies[0].emitters[0].radius: belongs to the shape disc, cone, sphere, got the shape point"},
      {"LineTo", emitter(R"("shape": "line")"), "bodies[0].emitters[0]: the key \"to\" is missing"},
      {"InnerRadius", emitter(R"("shape": "disc", "radius": 1, "inner_radius": 2)"),
       "inner_radius: must be from 0 to radius [m], got 2"},
      {"ConeAngle", emitter(R"("shape": "cone", "radius": 1, "angle": 90)"),
       "angle: must be from 0 to below 90 [degrees], got 90"},
      {"BoxExtent", emitter(R"("shape": "box", "half_extent": [1, -1, 1])"),
       "half_extent[1]: must be 0 or more [m], got -1"},
      {"MeshMissing", emitter(R"("shape": "mesh", "file": "none.obj")"),
       "bodies[0].emitters[0].file: ./none.obj: cannot open"},
      {"MeshNoMesh", emitter(R"("shape": "mesh", "file": "broken.obj")"), "bodies[0].emitters[0].file: ./broken.obj: "},
      {"MeshFlat", emitter(R"("shape": "mesh", "file": "flat.obj")"),
       "bodies[0].emitters[0].file: Emitter: the mesh has no area"},
      {"Axis", emitter(R"("axis": [0, 0, 0])"), "axis: must be a direction, not of length 0"},
      {"Spread", emitter(R"("spread": 181)"), "spread: must be from 0 to 180 [degrees], got 181"},
      {"Stop", emitter(R"("start": 2, "stop": 1)"), "stop: must be no earlier than start, got 1"},
      {"SpeedOrder", emitter(R"("speed": [2, 1])"), "speed: must be in order, got [2, 1]"},
      {"SpeedThree", emitter(R"("speed": [2, 1, 4])"), "speed: must be a number or [least, most], got an array of 3"},
      {"Lifetime", emitter(R"("lifetime": 0)"), "lifetime: must be positive [s], got 0"},
      {"LifetimeRange", emitter(R"("lifetime": [-1, 1])"), "lifetime[0]: must be positive [s], got -1"},
      {"Mass", emitter(R"("mass": 0)"), "mass: must be from 1e-30 to 1e30 [kg], got 0"},
      {"Size", emitter(R"("size": -1)"), "size: must be 0 or more [m], got -1"},
      {"MotionEmpty", emitter(R"("motion": {})"), "bodies[0].emitters[0].motion: needs translate, swing or keys"},
      {"EmitterKind", emitter(R"("kind": "smoke")"),
       "bodies[0].emitters[0].kind: must be one of particle, got \"smoke\""},
      {"ForceMissing", force(R"("coefficient": 1)"), "bodies[0].forces[0]: the key \"force\" is missing"},
      {"ForceUnknown", force(R"("force": "magnet")"),
       "forces[0].force: must be one of linear-drag, quadratic-drag, attractor"},
      {"DragCoefficient", force(R"("force": "linear-drag", "coefficient": -1)"),
       "forces[0].coefficient: must be 0 or more [N s/m], got -1"},
      {"DragNone", force(R"("force": "quadratic-drag")"), "forces[0]: the key \"coefficient\" is missing"},
      {"AttractorRadius", force(R"("force": "attractor", "place": [0,0,0], "strength": 1, "radius": 0)"),
       "forces[0].radius: must be positive [m], got 0"},
      {"TurbulenceSize", force(R"("force": "turbulence", "speed": 1, "size": 0, "rate": 1)"),
       "forces[0].size: must be positive [m], got 0"},
      {"TurbulenceRate", force(R"("force": "turbulence", "speed": 1, "size": 1)"),
       "forces[0]: the key \"rate\" is missing"},
      {"VortexCore", force(R"("force": "vortex", "place": [0,0,0], "circulation": 1, "core": 0, "rate": 1)"),
       "forces[0].core: must be positive [m], got 0"},
      {"FieldMissing", force(R"("force": "velocity-field", "file": "none.vdb", "rate": 1)"),
       "bodies[0].forces[0].file: ./none.vdb: cannot open"},
      {"FieldBroken", force(R"("force": "velocity-field", "file": "broken.obj", "rate": 1)"),
       "bodies[0].forces[0].file: ./broken.obj: is not an OpenVDB file"},
      {"RepulsionDistance", force(R"("force": "repulsion", "stiffness": 1, "distance": 0)"),
       "forces[0].distance: must be positive [m], got 0"},
      {"KindName", system(R"("kinds": [{}])"), "bodies[0].kinds[0]: the key \"name\" is missing"},
      {"KindsEmpty", system(R"("kinds": [])"), "bodies[0].kinds: must have from 1 to 256 kinds, got 0"},
      {"KindTwice", system(R"("kinds": [{"name": "a"}, {"name": "a"}])"), "kinds[1]: two kinds are called \"a\""},
      {"KindLook", kind(R"("look": "fire")"), "kinds[0].look: must be one of spark, smoke, drop, water, got \"fire\""},
      {"KindColor", kind(R"("color": [0, 2, 0])"), "kinds[0].color[1]: must be from 0 to 1, got 2"},
      {"KindColorAge", kind(R"("color": [[0, [1,1,1]], [1.5, [1,1,1]]])"),
       "kinds[0].color[1][0]: must be from 0 to 1, got 1.5"},
      {"KindColorOrder", kind(R"("color": [[0.5, [1,1,1]], [0.2, [1,1,1]]])"),
       "kinds[0].color[1][0]: must be above the one before, 0.5, got 0.2"},
      {"KindTemperature", kind(R"("color": {"temperature": 100})"),
       "temperature: must be from 500 to 20000 [K], got 100"},
      {"KindTemperatureSmoke", kind(R"("look": "smoke", "color": {"temperature": 1000})"),
       "kinds[0].color: only sparks glow: give a color"},
      {"KindSize", kind(R"("size": [[0, 1], [1, -1]])"), "kinds[0].size[1][1]: must be 0 or more, got -1"},
      {"KindOpacity", kind(R"("opacity": 0.5)"), "kinds[0].opacity: is for smoke, drops and water"},
      {"KindIntensity", kind(R"("look": "smoke", "intensity": 5)"), "kinds[0].intensity: is for sparks"},
      {"SubEvent", sub(R"("on": "collision", "parent": "a", "kind": "b")"),
       "sub_emitters[0].on: must be one of birth, death, impact"},
      {"SubParent", sub(R"("on": "death", "parent": "c", "kind": "b")"),
       "sub_emitters[0].parent: must be one of a, b, got \"c\""},
      {"SubSelf", sub(R"("on": "death", "parent": "a", "kind": "a")"),
       "sub_emitters[0].kind: must be another than the parent, or they would never end, got \"a\""},
      {"SubProbability", sub(R"("on": "death", "parent": "a", "kind": "b", "probability": 1.5)"),
       "probability: must be from 0 to 1"},
      {"SubLeast", sub(R"("on": "death", "parent": "a", "kind": "b", "least_impact": 1)"),
       "least_impact: is for impacts"},
      {"SubCount", sub(R"("on": "death", "parent": "a", "kind": "b", "count": -1)"),
       "count: must be from 0 to 1e4, got -1"},
      {"Method", system(R"("solver": {"method": "filtered-leapfrog"})"),
       "bodies[0].solver.method: must be one of explicit-euler, semi-implicit-euler"},
      {"MethodRefusesDrag",
       system(R"("forces": [{"force": "quadratic-drag", "coefficient": 1}], "solver": {"method": "pefrl"})"),
       "bodies[0].forces[0]: particles \"p\": pefrl needs forces of position alone, got drag"},
      {"Precision", system(R"("solver": {"precision": "double-float"})"),
       "bodies[0].solver.precision: must be one of float, double, got \"double-float\""},
      {"Dt", system(R"("solver": {"dt": 0})"), "bodies[0].solver.dt: must be positive [s], got 0"},
      {"SolverError", system(R"("solver": {"error": 0.1})"), "bodies[0].solver.error: unknown key"},
      {"NameTwice", with_bodies(R"({"type": "soft", "name": "p", "points": [[0,0,0]], "mass": 1},
                      {"type": "particles", "name": "p", "emitters": [{"rate": 1}]})"),
       "bodies[1].name: two bodies are called \"p\""},
  };
  return all;
}

class BrokenParticles : public ::testing::TestWithParam<BrokenCase> {};

TEST_P(BrokenParticles, AreToldInOneLineWithPathAndRule) { expect_told_in_one_line(GetParam()); }

INSTANTIATE_TEST_SUITE_P(All, BrokenParticles, ::testing::ValuesIn(cases()), name_of);

Scene built(const std::string& text) { return build(parse_scene(text, "scene.json")); }

TEST(BrokenParticles, TheUnbrokenFormsOfTheCasesAreFine) {
  for (const std::string& text :
       {system(""), emitter(R"("speed": [1, 2])"), kind(R"("color": [1, 0, 0])"),
        force(R"("force": "linear-drag", "coefficient": 1)"), sub(R"("on": "impact", "parent": "a", "kind": "b")")})
    EXPECT_NO_THROW(built(text)) << text;
}

TEST(Particles, DefaultsAreThoseOfTheManual) {
  const SceneDescription scene = parse_scene(with_bodies(R"({"type": "particles", "emitters": [{"rate": 1}]})"), "s");
  const ParticleBody& body = scene.particles.at(0);
  EXPECT_EQ(body.settings.name, "body0");
  EXPECT_EQ(body.settings.capacity, 100000);
  EXPECT_EQ(body.settings.at_capacity, particles::ParticleSettings::AtCapacity::Refuse);
  EXPECT_EQ(body.settings.seed, 1u);
  EXPECT_TRUE(body.settings.collides);
  EXPECT_EQ(body.settings.radius, 0);
  EXPECT_EQ(body.settings.restitution, 0);
  EXPECT_EQ(body.settings.rest_speed, 1e-3);
  EXPECT_EQ(body.settings.method->name, "verlet");
  EXPECT_FALSE(body.in_double);
  const particles::EmitterSettings& emitter = body.emitters.at(0).settings;
  EXPECT_TRUE(std::isinf(emitter.lifetime.least));
  EXPECT_EQ(emitter.speed.least, 1);
  EXPECT_EQ(emitter.mass.most, 1);
  EXPECT_EQ(emitter.size.most, 0.01);
  EXPECT_EQ(emitter.axis, Vec3(0, 1, 0));
  EXPECT_EQ(body.kinds.at(0).intensity, 1000);
}

// A jet without spread from a place that every shape but the moving one would share.
TEST(Particles, FlyAsTheirFileSays) {
  Scene scene = built(with_bodies(
      R"({"type": "particles", "origin": [0, 1, 0], "emitters": [
        {"position": [2, 0, 0], "axis": [3, 0, 0], "speed": 4, "mass": 0.5, "bursts": [{"time": 0.25, "count": 7}]}],
        "solver": {"precision": "double"}})"));
  ASSERT_TRUE(scene.world.update(0.25).good());
  EXPECT_EQ(scene.particles[0].body().size(), 0);
  ASSERT_TRUE(scene.world.update(0.5).good());
  const Body& body = scene.particles[0].body();
  ASSERT_EQ(body.size(), 7);
  const Vec3 expected(2 + 4 * 0.5, 1 - 0.5 * 9.81 * 0.25, 0);
  for (Index i = 0; i < 7; ++i) EXPECT_LT((body.positions().row(i).matrix().transpose() - expected).norm(), 1e-9) << i;
  EXPECT_NEAR(body.total_mass(), 3.5, 1e-12);
  const double height = expected.y(), v2 = 16 + std::pow(9.81 * 0.5, 2);
  EXPECT_NEAR(scene.world.energy().kinetic, 0.5 * 3.5 * v2, 1e-9);
  EXPECT_NEAR(scene.world.energy().gravitational, 3.5 * 9.81 * height, 1e-9);
}

TEST(Particles, FollowTheAirOfAFile) {
  // Puffs that move at 2 m/s are a file of moving air around x = 0; its zero is put to x = 5.
  test::TemporaryFolder folder;
  Points<double> x(2, 3), v(2, 3);
  x << -0.1, 0, 0, 0.1, 0, 0;
  v << 2, 0, 0, 2, 0, 0;
  vdb::write_density(folder / "air.vdb", x, Values<double>::Constant(2, 0.5), 0.05, v);
  const auto speeds = [&](const std::string& place) {
    const std::string text = with_bodies(
        R"({"type": "particles", "origin": [4, 0, 0], "emitters": [{"position": [1, 0, 0], "speed": 0, "bursts": [{"count": 5}]}],
            "forces": [{"force": "velocity-field", "file": "air.vdb", "grid": "v", "rate": 200, "place": )" +
        place + "}]}");
    Scene scene = build(parse_scene(text, "scene.json", folder.path()));
    EXPECT_TRUE(scene.world.update(0.05).good());
    return Points<double>(scene.particles[0].body().velocities());
  };
  const Points<double> carried = speeds("[1, 0, 0]"), still = speeds("[-3, 0, 0]");
  ASSERT_EQ(carried.rows(), 5);
  EXPECT_LT((carried.col(0) - 2).abs().maxCoeff(), 0.01);
  EXPECT_EQ(still.col(0).abs().maxCoeff(), 0);
}

TEST(Particles, TimesAreThoseThatAreShown) {
  // A rate that is given over shown time, with and without a second before the first frame.
  const std::string body =
      R"({"type": "particles", "emitters": [{"rate": [[0, 0], [1, 200]], "start": 0.1, "stop": 0.9,
          "motion": {"swing": {"amplitude": [1, 0, 0], "period": 1.3}}, "spread": 20}], "solver": {"precision": "double"}})";
  Scene now = built(with_bodies(body)), later = built(with_bodies(body, R"("preroll": 1, )"));
  now.world.update(0.75);
  later.world.update(1.75);
  ASSERT_GT(now.particles[0].body().size(), 20);
  ASSERT_EQ(now.particles[0].body().size(), later.particles[0].body().size());
  EXPECT_LT((now.particles[0].body().positions() - later.particles[0].body().positions()).abs().maxCoeff(), 1e-9);
  now.world.update(1);
  EXPECT_EQ(now.particles[0].counts().born, 64) << "200/2 (0.8² - 0²) = 64";
}

std::string busy(const std::string& keys = "") {
  return with_bodies(
      R"({"type": "particles", "name": "sparks", "capacity": 4000, "trail": 4,
          "contact": {"radius": 0.001, "restitution": 0.4},
          "kinds": [{"name": "spark", "color": {"temperature": [[0, 2600], [1, 900]]}}, {"name": "bit", "size": [[0, 1], [1, 0]]}],
          "emitters": [
            {"shape": "cone", "radius": 0.01, "angle": 12, "position": [0, 0.4, 0], "axis": [1, 0.1, 0], "rate": 900,
             "speed": [3, 5], "lifetime": [0.2, 0.7], "mass": [1e-6, 2e-6], "kind": "spark"},
            {"shape": "sphere", "radius": 0.1, "position": [0, 0.5, 0], "along_normal": true,
             "bursts": [{"count": 50, "period": 0.11}], "lifetime": 0.3, "kind": "bit"}],
          "forces": [{"force": "quadratic-drag", "coefficient": 1e-7}, {"force": "attractor", "place": [1, 0, 0], "strength": 0.5},
                     {"force": "turbulence", "speed": 1, "size": 0.3, "rate": 2},
                     {"force": "vortex", "place": [0, 0, 0], "circulation": 1, "core": 0.2, "rate": 1},
                     {"force": "repulsion", "stiffness": 50, "distance": 0.01}],
          "sub_emitters": [{"on": "impact", "parent": "spark", "kind": "bit", "least_impact": 0.2, "lifetime": [0.1, 0.2]}]})",
      keys +
          R"("colliders": [{"type": "half-space", "restitution": 0.3}, {"type": "sphere", "center": [0.6, 0.4, 0], "radius": 0.1}], )");
}

TEST(Particles, TheSameBitsAtTheSameTickForAnyFrames) {
  const auto run = [](double rate, int threads) {
    Scene scene = built(busy());
    scene.world.set_threads(threads);
    // Frames that end off the ticks, then exactly at the same one.
    for (int i = 1; double(i) / rate < 0.99; ++i) EXPECT_TRUE(scene.world.update(1 / rate).good());
    while (scene.world.clock().ticks() < 240)
      EXPECT_TRUE(scene.world
                      .update(scene.world.clock().time_at(scene.world.clock().ticks() + 1) + 1e-9 - scene.world.time() -
                              scene.world.clock().remainder())
                      .good());
    EXPECT_EQ(scene.world.clock().ticks(), 240);
    return scene;
  };
  const Scene a = run(60, 1), b = run(23.976, 1), c = run(1000, 2);
  const SceneParticles &first = a.particles[0], &other = b.particles[0], &third = c.particles[0];
  ASSERT_GT(first.body().size(), 100);
  EXPECT_GT(first.counts().impacts, 50);
  EXPECT_GT(first.counts().died, 100);
  for (const SceneParticles* each : {&other, &third}) {
    ASSERT_EQ(first.body().size(), each->body().size());
    EXPECT_TRUE((first.body().positions() == each->body().positions()).all());
    EXPECT_TRUE((first.body().velocities() == each->body().velocities()).all());
    EXPECT_EQ(first.counts().born, each->counts().born);
  }
}

// Two of the scenes that come with Hooke: what is thrown is there for its lifetime, and nobody was refused.
TEST(Particles, OfTheExampleScenesAreAsManyAsTheirRatesMake) {
  for (const char* name : {"sparks", "embers"}) {
    SCOPED_TRACE(name);
    Scene scene = build(read_scene(std::filesystem::path(HOOKE_SCENES_FOLDER) / (std::string(name) + ".json")));
    ASSERT_TRUE(scene.world.update(scene.description.preroll + 0.25).good());
    for (std::size_t i = 0; i < scene.particles.size(); ++i) {
      const ParticleBody& says = scene.description.particles[i];
      double least = 0, most = 0;
      std::vector<bool> thrown(says.kinds.size(), false);
      for (const ParticleEmitter& each : says.emitters) {
        const particles::EmitterSettings& s = each.settings;
        const double seconds = scene.shown_time() - s.start;
        least += s.rate.least() * std::min(seconds, s.lifetime.least);
        most += s.rate.most() * std::min(seconds, s.lifetime.most);
        for (const particles::Burst& burst : s.bursts)
          most += double(burst.count) * (burst.period > 0 ? std::floor(seconds / burst.period) + 1 : 1);
        thrown[std::size_t(s.kind)] = true;
      }
      const SceneParticles& particles = scene.particles[i];
      Index count = 0;
      for (const int kind : particles.view().kinds) count += thrown[std::size_t(kind)];
      EXPECT_GT(count, says.settings.dies_on_impact ? 0 : 0.98 * least);
      EXPECT_LT(count, 1.02 * most);
      EXPECT_GT(most, 100);
      EXPECT_EQ(particles.counts().refused, 0);
      EXPECT_TRUE(particles.body().positions().allFinite());
    }
  }
}

TEST(Particles, AViewHasARowAParticle) {
  Scene scene = built(busy());
  scene.world.update(0.5);
  const SceneParticles& particles = scene.particles[0];
  const ParticleView view = particles.view();
  const Index n = particles.body().size();
  ASSERT_GT(n, 100);
  EXPECT_EQ(particles.counts().born - particles.counts().died - particles.counts().displaced, n);
  EXPECT_EQ(view.positions.rows(), n);
  EXPECT_EQ(view.colors.rows(), n);
  EXPECT_EQ(Index(view.serials.size()), n);
  int bits = 0;
  for (Index i = 0; i < n; ++i) {
    EXPECT_GE(view.lives[i], 0);
    EXPECT_LE(view.lives[i], 1);
    if (view.kinds[std::size_t(i)] == 0) {
      EXPECT_FLOAT_EQ(view.radii[i], 0.01f);
      continue;
    }
    ++bits;
    const double born = view.radii[i] / std::max(1e-6f, 1 - view.lives[i]);
    EXPECT_TRUE(std::abs(born - 0.01) < 1e-4 || std::abs(born - 0.005) < 1e-4) << born;
  }
  EXPECT_GT(bits, 10);
  Points<float> trail;
  EXPECT_EQ(particles.trail(0, trail), 4);
}

TEST(Particles, AreMovedByTheMethodAndPrecisionOfTheCommandLine) {
  SceneDescription scene = parse_scene(system(""), "s");
  override_solver(scene, "rk4", 1e-3, "double");
  const MotionFacts facts = build(scene).particles[0].body().motion_facts();
  EXPECT_EQ(facts.method, "rk4");
  EXPECT_EQ(facts.precision, "double");
  EXPECT_EQ(facts.wanted_dt, 1e-3);
  const auto message = [&](const std::string& method, const std::string& precision) -> std::string {
    try {
      override_solver(scene, method, 0, precision);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message("filtered-leapfrog", ""), HasSubstr("particles \"p\": the method must be one of explicit-euler"));
  EXPECT_THAT(message("", "double-float"),
              HasSubstr("particles \"p\": the precision must be float or double, got double-float"));
}

TEST(Particles, AreLeftOutOfErrorEstimatesAndChangeNone) {
  const std::string cloth =
      R"({"type": "soft", "name": "a", "grid": {"size": [1, 1], "points": [5, 5]}, "pin": "top"})";
  const std::string jet = R"({"type": "particles", "name": "p", "emitters": [{"rate": 100}]})";
  const auto estimate = [](const std::string& bodies) {
    return estimate_errors(built(with_bodies(bodies, R"("duration": 0.5, )"))).bodies;
  };
  const auto alone = estimate(cloth), both = estimate(jet + ", " + cloth);
  ASSERT_EQ(both.size(), 1u);
  EXPECT_EQ(both[0].body, "a");
  EXPECT_EQ(both[0].error, alone[0].error);
  EXPECT_GT(both[0].error, 0);
}

}  // namespace
}  // namespace hooke::scene
