// Files of panels: which scenes they make, and what they refuse.
#include <hooke/error.hpp>
#include <hooke/point_body.hpp>
#include <io/temporary_folder.hpp>
#include <scene/figures.hpp>
#include <scene/library.hpp>
#include <scene/panels.hpp>
#include <scene/scene.hpp>

#include <gmock/gmock.h>

namespace hooke::scene {
namespace {

using ::testing::HasSubstr;

const char* const kPair = R"("scene": {"hooke": 1, "duration": 1,
  "bodies": [{"type": "soft", "points": [[0,0,0], [1,0,0]], "mass": 1,
              "springs": [{"points": [0,1], "stiffness": 5, "rest_length": 1}]}]})";

Panels panels_of(const std::string& rest) {
  test::TemporaryFolder folder;
  return read_panels(folder.write("panels.json", std::string("{\"hooke\": 1, ") + kPair + ", " + rest + "}"));
}

TEST(Panels, ChangeTheSceneTheWholeFileFirst) {
  const Panels panels = panels_of(R"("set": {"/duration": 2, "/damping": 0.5},
    "panels": [{"title": "a"}, {"title": "b", "set": {"/damping": 0.25, "/bodies/0/solver/method": "rk4"}}])");
  ASSERT_EQ(panels.panels.size(), 2u);
  EXPECT_EQ(panels.columns, 2);
  EXPECT_EQ(panels.panels[0].scene.duration, 2);
  EXPECT_EQ(panels.panels[0].scene.damping, 0.5);
  EXPECT_EQ(panels.panels[1].scene.damping, 0.25);
  EXPECT_EQ(panels.panels[0].scene.bodies[0].solver.method, "velocity-verlet");
  EXPECT_EQ(panels.panels[1].scene.bodies[0].solver.method, "rk4");
}

TEST(Panels, ThatBreakARuleAreToldInOneLine) {
  const std::pair<const char*, const char*> cases[] = {
      {R"("panels": [])", "panels: must have 1 to 16 panels"},
      {R"("panels": [{}])", "panels[0]: the key \"title\" is missing"},
      {R"("panels": [{"title": "a", "scene": "no-such"}])", "panels[0].scene: must be a scene file"},
      {R"("panels": [{"title": "a", "set": {"duration": 2}}])", "\"duration\" must point into the scene"},
      {R"("panels": [{"title": "a", "set": {"/bodies/7/mass": 2}}])", "bodies[1]"},
      {R"("panels": [{"title": "a", "set": {"/duration": -2}}])", "panels[0]: duration: must be positive"},
      {R"("panels": [{"title": "a"}, {"title": "b", "set": {"/duration": 2}}])", "the duration and the frame_rate"},
      {R"("columns": 3, "panels": [{"title": "a"}])", "columns: must be"},
      {R"("figures": ["mass"], "panels": [{"title": "a"}])", "figures[0]: must be"},
  };
  for (const auto& [text, message] : cases) {
    std::string told = "no error";
    try {
      panels_of(text);
    } catch (const Error& error) {
      told = error.what();
    }
    EXPECT_THAT(told, HasSubstr(message));
    EXPECT_THAT(told, HasSubstr("panels.json: "));
    EXPECT_THAT(told, ::testing::Not(HasSubstr("\n")));
  }
  EXPECT_THROW(find_panels("no-such-panels"), Error);
}

TEST(Panels, ThatComeWithHookeCanBeBuilt) {
  for (const char* name : {"flag-winds", "six-methods", "far-jelly"}) {
    const Panels panels = find_panels(name);
    EXPECT_FALSE(panels.title.empty()) << name;
    for (const Panel& panel : panels.panels) EXPECT_NO_THROW(build(panel.scene)) << name << " " << panel.title;
  }
}

// All six cubes lie still by the end of the film, none crushed and none in the stone.
TEST(JellyScene, EndsAtRest) {
  Scene scene = build(find_scene("jelly"));
  for (int i = 0; i < 6 * 60; ++i) ASSERT_TRUE(scene.world.update(1 / 60.0).good());
  ASSERT_EQ(scene.bodies.size(), 6u);
  for (const SceneBody& body : scene.bodies) EXPECT_TRUE(body.body->asleep()) << body.body->name();
  EXPECT_LT(worst_stretch(scene), 0.5);
  EXPECT_LT(worst_penetration(scene), 1e-5);
}

const PointBody<float>& only_body(const Scene& scene) {
  return dynamic_cast<const PointBody<float>&>(*scene.bodies.at(0).body);
}

// What the far jelly shows, for the second in which it lands.
TEST(FarJelly, MovesWithTheSameBitsFromAnOriginOfItsOwnAndNotInPlainFloat) {
  const Panels panels = find_panels("far-jelly");
  std::vector<Points<float>> places;
  for (const Panel& panel : panels.panels) {
    Scene scene = build(panel.scene);
    for (int i = 0; i < 60; ++i) scene.world.update(1 / 60.0);
    places.push_back(only_body(scene).state().position);
  }
  ASSERT_EQ(places.size(), 6u);
  for (const std::size_t far : {1u, 2u}) EXPECT_TRUE((places[far] == places[0]).all()) << far;
  for (const std::size_t plain : {3u, 4u, 5u}) {
    const Vec3 shift = panels.panels[plain].scene.camera->origin + Vec3(0, 0.75, 0);
    const double off = ((places[plain].cast<double>().rowwise() - shift.transpose().array()) - places[0].cast<double>())
                           .abs()
                           .maxCoeff();
    EXPECT_GT(off, 1e-3) << plain;
  }
}

}  // namespace
}  // namespace hooke::scene
