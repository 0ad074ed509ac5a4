// From descriptions to worlds.
#include <hooke/error.hpp>
#include <hooke/io/mesh_cache.hpp>
#include <hooke/io/output_file.hpp>
#include <hooke/vdb/volume_file.hpp>
#include <io/temporary_folder.hpp>
#include <scene/figures.hpp>
#include <scene/form.hpp>
#include <scene/library.hpp>
#include <scene/scene.hpp>

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hooke::scene {
namespace {

Scene scene_of(const std::string& keys) { return build(parse_scene(R"({"hooke": 1, )" + keys + "}", "scene.json")); }

// The same grid, written out point by point and spring by spring.
std::string raw_json_of(const Scene& scene) {
  const SceneBody& sheet = scene.bodies[0];
  const Points<double> x = sheet.body->positions();
  const Values<double> m = sheet.body->masses();
  std::string points, masses, springs, pins;
  const auto comma = [](std::string& text) { text += text.empty() ? "" : ","; };
  for (Index i = 0; i < x.rows(); ++i) {
    comma(points);
    points += "[" + io::text_of(x(i, 0)) + "," + io::text_of(x(i, 1)) + "," + io::text_of(x(i, 2)) + "]";
    comma(masses);
    masses += io::text_of(m[i]);
    if (!sheet.body->pinned(i)) continue;
    comma(pins);
    pins += std::to_string(i);
  }
  for (const softbody::Spring& spring : sheet.network->springs) {
    comma(springs);
    springs += "{\"points\":[" + std::to_string(spring.a) + "," + std::to_string(spring.b) +
               "],\"stiffness\":" + io::text_of(spring.stiffness) + "}";
  }
  return R"("bodies": [{"type": "soft", "name": "sheet", "points": [)" + points + R"(], "masses": [)" + masses +
         R"(], "springs": [)" + springs + R"(], "pins": [)" + pins + R"(], "solver": {"precision": "double"}}])";
}

TEST(HangingSheet, IsTheStandardSheet) {
  for (const auto& [n, springs] : {std::pair{32, 5826u}, {64, 23938u}, {128, 97026u}}) {
    SceneDescription description = hanging_sheet(n);
    override_solver(description, "", 0, "double");
    const Scene scene = build(description);
    const SceneBody& sheet = scene.bodies[0];
    EXPECT_EQ(sheet.network->springs.size(), springs);
    const Points<double> x = sheet.body->positions();
    const double h = 1.0 / (n - 1), tilt = std::sqrt(0.5);
    double worst = 0;
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c)
        worst = std::max(
            worst,
            (Vec3(c * h - 0.5, -r * h * tilt, r * h * tilt).transpose().array() - x.row(r * n + c)).abs().maxCoeff());
    EXPECT_LT(worst, 5e-16);
    EXPECT_TRUE((sheet.body->masses() == 0.3 / (n * n)).all());
    for (Index i = 0; i < x.rows(); ++i) ASSERT_EQ(sheet.body->pinned(i), i < n);
    for (const softbody::Spring& spring : sheet.network->springs) {
      const double k = spring.family == softbody::Family::Stretch ? 500
                       : spring.family == softbody::Family::Shear ? 100
                                                                  : 5;
      ASSERT_EQ(spring.stiffness, k);
      ASSERT_EQ(spring.damping, 0);
    }
  }
}

TEST(Grid, MovesBitwiseLikeTheSamePointsWrittenOut) {
  SceneDescription description = hanging_sheet(32);
  override_solver(description, "", 0, "double");
  Scene grid = build(description);
  Scene raw = scene_of(raw_json_of(grid));
  grid.world.update(0.1);
  raw.world.update(0.1);
  EXPECT_TRUE((grid.bodies[0].body->positions() == raw.bodies[0].body->positions()).all());
  EXPECT_TRUE((grid.bodies[0].body->velocities() == raw.bodies[0].body->velocities()).all());
  EXPECT_GT(grid.world.momentum().norm(), 0);
}

TEST(Grid, EdgesAndCornersHaveTheirNames) {
  const auto pinned = [](const std::string& pin) {
    const Scene scene =
        scene_of(R"("bodies": [{"type": "soft", "grid": {"size": [1, 1], "points": [3, 4]}, "pin": )" + pin + "}]");
    std::vector<int> out;
    for (int i = 0; i < 12; ++i)
      if (scene.bodies[0].body->pinned(i)) out.push_back(i);
    return out;
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(pinned(R"("top")"), ElementsAre(0, 1, 2));
  EXPECT_THAT(pinned(R"("bottom")"), ElementsAre(9, 10, 11));
  EXPECT_THAT(pinned(R"(["left"])"), ElementsAre(0, 3, 6, 9));
  EXPECT_THAT(pinned(R"("right")"), ElementsAre(2, 5, 8, 11));
  EXPECT_THAT(pinned(R"(["top-left", "bottom-right", 4, 4])"), ElementsAre(0, 4, 11));
  EXPECT_THAT(pinned(R"(["top-right", "bottom-left"])"), ElementsAre(2, 9));
}

TEST(Defaults, AreThoseOfTheManual) {
  const SceneDescription scene = parse_scene(R"({"hooke": 1, "bodies": [
      {"type": "soft", "points": [[0,0,0],[1,0,0]], "mass": 2, "springs": [{"points": [0,1], "stiffness": 5}]}]})",
                                             "s");
  EXPECT_EQ(scene.gravity, Vec3(0, -9.81, 0));
  EXPECT_EQ(scene.frame_rate, 60);
  EXPECT_EQ(scene.tick_rate, 240);
  EXPECT_EQ(scene.damping, 0);
  EXPECT_EQ(scene.bodies[0].solver.method, "velocity-verlet");
  EXPECT_EQ(scene.bodies[0].solver.precision, softbody::Precision::Automatic);
  const Scene built = build(scene);
  EXPECT_EQ(built.bodies[0].network->springs[0].damping, 0);
  EXPECT_EQ(built.bodies[0].rest[0], 1);
  EXPECT_EQ(built.bodies[0].body->masses()[0], 1);
}

TEST(Origin, ChangesNoBitOfTheMotionRelativeToIt) {
  const auto run = [](const std::string& origin) {
    Scene scene = scene_of(R"("bodies": [{"type": "soft", "origin": )" + origin +
                           R"(, "grid": {"size": [1, 1], "points": [5, 5]}, "pin": "top"}])");
    scene.world.update(0.25);
    return scene.bodies[0].body->velocities();
  };
  EXPECT_TRUE((run("[0, 0, 0]") == run("[1e6, -7, 0.3]")).all());
}

TEST(DrivenPins, AreExactlyWhereShownTimePutsThem) {
  Scene scene = scene_of(R"("preroll": 0.5, "bodies": [{"type": "soft", "grid": {"size": [1, 1], "points": [3, 3]},
      "solver": {"precision": "double"},
      "pin_motion": [{"points": "top-left", "translate": [1, 0, 0]},
                     {"points": ["top-right"], "swing": {"amplitude": [0, 0.1, 0], "period": 1}},
                     {"points": [1], "keys": [{"time": 0, "offset": [0,0,0]}, {"time": 1, "offset": [0,0,2]}]}]}])");
  scene.world.update(0.5);
  const Points<double> start = scene.bodies[0].body->start_positions();
  EXPECT_EQ(scene.shown_time(), 0);
  EXPECT_TRUE((scene.bodies[0].body->positions().topRows(3) == start.topRows(3)).all()) << "still during the preroll";
  scene.world.update(0.25);
  const Points<double> moved = scene.bodies[0].body->positions() - start;
  EXPECT_NEAR(moved(0, 0), 0.25, 1e-12);
  EXPECT_NEAR(moved(2, 1), 0.1, 1e-12);
  scene.world.update(0.25);
  EXPECT_NEAR((scene.bodies[0].body->positions() - start)(1, 2), 1, 1e-12);
  scene.world.update(0.75);
  EXPECT_NEAR((scene.bodies[0].body->positions() - start)(1, 2), 2, 1e-12);
}

TEST(Wind, RunsOnShownTime) {
  const auto speed_after = [](const std::string& preroll, double seconds) {
    Scene scene = scene_of(R"("gravity": [0, 0, 0], "preroll": )" + preroll +
                           R"(, "bodies": [{"type": "soft", "grid": {"size": [1, 1], "points": [3, 3]},
                               "wind": {"velocity": [0, 0, 5], "gust": 0.5, "stop": 0, "fade": 0.2}}])");
    scene.world.update(seconds);
    return scene.world.momentum().z();
  };
  EXPECT_EQ(speed_after("0", 0.5), 0) << "the wind stopped at shown time 0";
  EXPECT_GT(speed_after("0.5", 0.5), 1e-3) << "and blew in the preroll";
}

TEST(Colliders, MoveByShownTime) {
  const Scene scene = scene_of(R"("bodies": [], "preroll": 1, "colliders": [
      {"type": "sphere", "center": [1, 2, 3], "radius": 1, "motion": {"translate": [0, 0, 2]}},
      {"type": "capsule", "a": [0,0,0], "b": [0,1,0], "radius": 1, "motion": {"keys": [{"time": 0, "offset": [1,0,0]}]}}])");
  std::vector<Shape> shapes = scene.world.colliders()[0].shapes;
  scene.world.colliders()[0].motion(3, shapes);
  EXPECT_EQ(std::get<Sphere>(shapes[0]).center, Vec3(1, 2, 7));
  shapes = scene.world.colliders()[1].shapes;
  scene.world.colliders()[1].motion(3, shapes);
  EXPECT_EQ(std::get<Capsule>(shapes[0]).a, Vec3(1, 0, 0));
}

TEST(Colliders, ABoxIsWhereAndAsItIsSaid) {
  const Scene scene = scene_of(R"("bodies": [], "colliders": [
      {"type": "box", "center": [1, 2, 3], "size": [2, 4, 6], "rotation": {"axis": [0, 0, 5], "angle": 90},
       "motion": {"translate": [0, 1, 0]}}])");
  std::vector<Shape> shapes = scene.world.colliders()[0].shapes;
  scene.world.colliders()[0].motion(2, shapes);
  const auto& box = std::get<Box>(shapes[0]);
  EXPECT_EQ(box.center, Vec3(1, 4, 3));
  EXPECT_EQ(box.half_extent, Vec3(1, 2, 3));
  EXPECT_LT((box.axes.col(0) - Vec3(0, 1, 0)).norm(), 1e-12);
  EXPECT_NEAR(signed_distance(box, Vec3(4, 4, 3)), 1, 1e-12);  // 2 m of its own y lie along x
}

double volume_of(const TriangleMesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices.row(t[0]).matrix(), b = mesh.vertices.row(t[1]).matrix(),
               c = mesh.vertices.row(t[2]).matrix();
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

TEST(Lathe, TurnsProfilesInEitherSenseIntoSolids) {
  const double share = 48 / (2 * std::numbers::pi) * std::sin(2 * std::numbers::pi / 48);  // of the disc
  const double disc = std::numbers::pi * share;
  const auto volume = [&](std::vector<std::array<double, 2>> profile) {
    const double up = volume_of(turned_on_lathe(profile, 48));
    std::reverse(profile.begin(), profile.end());
    EXPECT_NEAR(volume_of(turned_on_lathe(profile, 48)), up, 1e-12);
    return up;
  };
  EXPECT_NEAR(volume({{0.5, 0}, {0.5, 2}}), 0.25 * 2 * disc, 1e-9);              // cylinder
  EXPECT_NEAR(volume({{0, 0}, {1, 0}, {0, 3}}), disc, 1e-9);                     // cone
  EXPECT_NEAR(volume({{0, 0}, {1, 0}, {1, 1}, {0.8, 1}, {0.8, 0.2}, {0, 0.2}}),  // bowl
              (1 - 0.64 * 0.8) * disc, 1e-9);
  EXPECT_NEAR(volume({{1, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 0}}), 3 * disc, 1e-9);  // ring
}

TEST(Lathe, IsCollidedWithAsItIsDrawn) {
  const Scene scene = scene_of(R"("bodies": [], "colliders": [
      {"type": "half-space"},
      {"type": "lathe", "center": [1, 2, 3], "profile": [[0, 0], [0.5, 0], [0.5, 1], [0.4, 1], [0.4, 0.2], [0, 0.2]],
       "voxel": 0.02, "motion": {"translate": [0, 0, 1]}}])");
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0], nullptr);
  ASSERT_NE(scene.meshes[1], nullptr);
  std::vector<Shape> shapes = scene.world.colliders()[1].shapes;
  scene.world.colliders()[1].motion(2, shapes);
  EXPECT_EQ(std::get<LevelSet>(shapes[0]).offset, Vec3(1, 2, 5));
  EXPECT_NEAR(signed_distance(shapes[0], Vec3(1, 2.1, 5)), -0.1, 0.01);      // the bottom
  EXPECT_NEAR(signed_distance(shapes[0], Vec3(1, 2.6, 5)), 0.4, 0.02);       // the hollow
  EXPECT_NEAR(signed_distance(shapes[0], Vec3(1.45, 2.6, 5)), -0.05, 0.01);  // the wall
  for (Index v = 0; v < scene.meshes[1]->vertices.rows(); v += 7)
    EXPECT_NEAR(signed_distance(shapes[0], Vec3(scene.meshes[1]->vertices.row(v).matrix().transpose()) + Vec3(1, 2, 5)),
                0, 0.02);
}

TEST(LevelSets, FromMeshesAndFilesHoldACloth) {
  test::TemporaryFolder folder;
  io::write_obj(folder / "drum.obj", turned_on_lathe({{0.3, 0}, {0.3, 0.5}}, 32).vertices,
                turned_on_lathe({{0.3, 0}, {0.3, 0.5}}, 32).triangles);
  const std::string body =
      R"("bodies": [{"type": "soft", "grid": {"size": [1, 1], "points": [20, 20], "right": [1, 0, 0],
      "down": [0, 0, 1]}, "origin": [0, 0.55, -0.5], "thickness": 0.01}])";
  const auto built = [&](const std::string& collider, const Scene* reuse = nullptr) {
    return build(
        parse_scene(R"({"hooke": 1, "colliders": [)" + collider + "], " + body + "}", "scene.json", folder.path()),
        reuse);
  };
  const std::string drum = R"({"type": "mesh", "file": "drum.obj", "voxel": 0.02})";
  Scene scene = built(drum);
  vdb::write_level_set(folder / "drum.vdb", *std::get<LevelSet>(scene.world.colliders()[0].shapes[0]).grid, "drum");
  Scene again = built(drum, &scene);
  EXPECT_EQ(again.meshes[0], scene.meshes[0]) << "taken over";
  Scene file = built(R"({"type": "level-set", "file": "drum.vdb", "grid": "drum"})");
  EXPECT_NEAR(volume_of(*file.meshes[0]), volume_of(*scene.meshes[0]), 0.05 * volume_of(*scene.meshes[0]));
  for (Scene* each : {&scene, &file}) {
    EXPECT_EQ(worst_penetration(*each), 0);
    ASSERT_TRUE(each->world.update(0.6).good());
    const Points<double> x = each->bodies[0].body->positions();
    EXPECT_GT(x.row(10 * 20 + 10)[1], 0.5) << "on the drum";
    EXPECT_LT(x.row(0)[1], 0.45) << "a corner hangs";
    EXPECT_LT(worst_penetration(*each), 2e-3);
  }
}

TEST(Keys, AreMetExactlyAndJoinedWithoutJumps) {
  Drive drive;
  drive.keys = {{0, {0, 0, 0}}, {1, {1, 0, 0}}, {3, {1, 2, 0}}};
  for (const Key& key : drive.keys) EXPECT_EQ(drive.offset(key.time), key.offset);
  const double h = 1e-6;
  for (double t = -0.5; t < 3.5; t += 0.01) {
    EXPECT_LT((drive.offset(t + h) - drive.offset(t)).norm(), 3 * h);
    const Vec3 before = (drive.offset(t) - drive.offset(t - h)) / h,
               after = (drive.offset(t + h) - drive.offset(t)) / h;
    EXPECT_LT((after - before).norm(), 1e-3);
  }
  EXPECT_EQ(drive.offset(-1), Vec3(0, 0, 0));
  EXPECT_EQ(drive.offset(9), Vec3(1, 2, 0));
}

TEST(Stretch, IsThatOfTheWorstFreeSpring) {
  Scene scene =
      scene_of(R"("bodies": [{"type": "soft", "points": [[0,0,0],[1.25,0,0],[0,9,0]], "mass": 1, "pins": [0, 2],
      "springs": [{"points": [0,1], "stiffness": 5, "rest_length": 1}, {"points": [0,2], "stiffness": 5, "rest_length": 1}]}])");
  EXPECT_DOUBLE_EQ(worst_stretch(scene), 0.25);
}

TEST(NamedScenes, AllParseAndHaveTitles) {
  const std::vector<NamedScene> scenes = named_scenes();
  EXPECT_GE(scenes.size(), 8u);
  for (const NamedScene& scene : scenes) {
    SceneDescription description;
    EXPECT_NO_THROW(description = find_scene(scene.name)) << scene.name;
    EXPECT_FALSE(description.title.empty()) << scene.name;
    if (scene.name.starts_with("cape")) continue;  // a human takes seconds; the command's tests run it
    Scene built = build(description);
    EXPECT_TRUE(built.world.update(0.05).good()) << scene.name;
  }
  EXPECT_THROW(find_scene("no-such-scene"), Error);
}

TEST(Solver, MethodsThatTakeNoForcesOfVelocityAreFoundOut) {
  for (const Method* method : methods()) {
    if (method->accepts_velocity_forces) continue;
    SceneDescription description = find_scene("flag");
    override_solver(description, std::string(method->name), 0, "");
    EXPECT_THROW(build(description), Error);
  }
}

}  // namespace
}  // namespace hooke::scene
