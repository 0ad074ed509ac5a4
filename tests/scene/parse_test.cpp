// Every rule of the scene format that can be broken, and the words that tell where and how.
#include <hooke/error.hpp>
#include <scene/parse.hpp>
#include <scene/scene.hpp>

#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

namespace hooke::scene {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A file around the JSON of one body, of more keys, or of one collider.
std::string with_body(const std::string& body) { return R"({"hooke": 1, "bodies": [)" + body + "]}"; }
std::string with_keys(const std::string& keys) { return R"({"hooke": 1, "bodies": [], )" + keys + "}"; }
std::string with_collider(const std::string& keys) { return with_keys(R"("colliders": [{)" + keys + "}]"); }
std::string raw(const std::string& keys) {
  return with_body(R"({"type": "soft", "name": "a", "points": [[0,0,0],[1,0,0],[2,0,0],[3,0,0]])" +
                   (keys.empty() ? "" : ", " + keys) + "}");
}
std::string grid(const std::string& keys) {
  return with_body(R"({"type": "soft", "name": "a", "grid": {"size": [1, 1], "points": [3, 4]}, )" + keys + "}");
}
std::string spring(const std::string& keys) { return raw(R"("mass": 1, "springs": [{)" + keys + "}]"); }

struct Case {
  const char* name;
  std::string text;
  std::string message;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      {"Empty", "", "scene.json: line 1, column 1"},
      {"NotJson", "{\n  \"hooke\": 1,\n  bodies: []}", "scene.json: line 3, column 3"},
      {"CutOff", R"({"hooke": 1, "bodies": [{"type": "soft")", "scene.json: line 1, column"},
      {"TrailingText", R"({"hooke": 1, "bodies": []} x)", "scene.json: line 1, column"},
      {"Comment", "{\"hooke\": 1, // one\n \"bodies\": []}", "scene.json: line 1, column"},
      {"BadUtf8", "{\"hooke\": 1, \"title\": \"\xff\", \"bodies\": []}", "scene.json: line 1, column"},
      {"NotAnObject", "[1, 2]", "scene.json: must be an object, got an array of 2"},
      {"NoVersion", R"({"bodies": []})", "the key \"hooke\" is missing"},
      {"WrongVersion", R"({"hooke": 2, "bodies": []})", "hooke: must be 1, the version of the format, got 2"},
      {"VersionAsText", R"({"hooke": "1", "bodies": []})", "hooke: must be 1"},
      {"NoBodies", R"({"hooke": 1})", "the key \"bodies\" is missing"},
      {"BodiesNoArray", R"({"hooke": 1, "bodies": {}})", "bodies: must be an array, got an object"},
      {"UnknownKey", with_keys(R"("gravitation": 1)"), "gravitation: unknown key; known here: hooke, title, gravity"},
      {"UnknownKeyDeep", grid(R"("wind": {"velocty": [0,0,0]})"), "bodies[0].wind.velocty: unknown key"},
      {"KeyTwice", R"({"hooke": 1, "hooke": 1, "bodies": []})", "hooke: this key appears twice"},
      {"KeyTwiceDeep", with_body(R"({"type": "soft", "drag": {"linear": 1, "linear": 2}})"),
       "bodies[0].drag.linear: this key appears twice"},
      {"TooDeep", with_keys("\"title\": " + std::string(2000, '[') + std::string(2000, ']')), "title[0]"},
      {"TooLargeNumber", with_keys(R"("duration": 1e999)"), "duration: must be finite"},
      {"TooLargeInArray", raw(R"("masses": [1, 1e999, 1, 1])"), "bodies[0].masses[1]: must be finite"},
      {"GravityLength", with_keys(R"("gravity": [0, -9.81])"),
       "gravity: must be an array of 3 numbers, got an array of 2"},
      {"GravityText", with_keys(R"("gravity": [0, "-9.81", 0])"), "gravity[1]: must be a number"},
      {"GravityNull", with_keys(R"("gravity": null)"), "gravity: must be an array of 3 numbers, got null"},
      {"DampingOne", with_keys(R"("damping": 1)"), "damping: must be a fraction per second, from 0 to below 1, got 1"},
      {"DampingNegative", with_keys(R"("damping": -0.1)"), "damping: must be a fraction"},
      {"DurationZero", with_keys(R"("duration": 0)"), "duration: must be positive"},
      {"FrameRateZero", with_keys(R"("frame_rate": 0)"), "frame_rate: must be from 0.001 to 1e4 [1/s], got 0"},
      {"TickRateNegative", with_keys(R"("tick_rate": -240)"), "tick_rate: must be"},
      {"PrerollNegative", with_keys(R"("preroll": -1)"), "preroll: must be"},
      {"TitleLineBreak", with_keys(R"("title": "a\nb")"), "title: must have no control characters"},
      {"NoType", with_body(R"({"name": "a"})"), "bodies[0]: the key \"type\" is missing"},
      {"UnknownType", with_body(R"({"type": "jelly"})"),
       "bodies[0].type: must be one of soft, particles, rigid, got \"jelly\""},
      {"RigidNotYet", with_body(R"({"type": "rigid"})"), "bodies[0].type: bodies of type \"rigid\" are not available"},
      {"NoForm", with_body(R"({"type": "soft"})"),
       "bodies[0]: needs exactly one of points, grid, mesh and cape, got 0"},
      {"TwoForms", grid(R"("points": [[0,0,0]])"),
       "bodies[0]: needs exactly one of points, grid, mesh and cape, got 2"},
      {"EmptyName", with_body(R"({"type": "soft", "name": ""})"), "bodies[0].name: must not be empty"},
      {"NameTwice", with_body(R"({"type": "soft", "name": "a", "points": [[0,0,0]], "mass": 1},
                    {"type": "soft", "name": "a", "points": [[0,0,0]], "mass": 1})"),
       "bodies[1].name: two bodies are called \"a\""},
      {"NoMass", raw(""), "bodies[0]: raw points need \"masses\""},
      {"MassAndMasses", raw(R"("mass": 1, "masses": [1,1,1,1])"), "bodies[0].mass: excludes masses"},
      {"MassZero", raw(R"("masses": [1, 0, 1, 1])"), "bodies[0].masses[1]: must be positive [kg], got 0"},
      {"MassNegative", raw(R"("masses": [1, 1, 1, -2])"), "bodies[0].masses[3]: must be positive [kg], got -2"},
      {"MassesLength", raw(R"("masses": [1, 1])"), "bodies[0].masses: must have one mass a point, 4, got 2"},
      {"VelocitiesLength", raw(R"("mass": 1, "velocities": [[0,0,0]])"),
       "bodies[0].velocities: must have one entry a point, 4, got 1"},
      {"NoPoints", with_body(R"({"type": "soft", "points": [], "mass": 1})"),
       "bodies[0].points: must have at least one point"},
      {"PointLength", with_body(R"({"type": "soft", "points": [[0, 0]], "mass": 1})"),
       "bodies[0].points[0]: must be an array of 3"},
      {"SpringPoint", spring(R"("points": [0, 9], "stiffness": 1)"),
       "bodies[0].springs[0].points[1]: must be below the point count 4, got 9"},
      {"SpringPointNegative", spring(R"("points": [-1, 0], "stiffness": 1)"),
       "bodies[0].springs[0].points[0]: must be a whole number from 0"},
      {"SpringPointFraction", spring(R"("points": [0, 1.5], "stiffness": 1)"),
       "bodies[0].springs[0].points[1]: must be a point index, got 1.5"},
      {"SpringPointHuge", spring(R"("points": [0, 18446744073709551615], "stiffness": 1)"),
       "points[1]: must be below the point count"},
      {"SpringToItself", spring(R"("points": [2, 2], "stiffness": 1)"),
       "bodies[0].springs[0].points: must be two different points"},
      {"SpringOnePoint", spring(R"("points": [2], "stiffness": 1)"),
       "bodies[0].springs[0].points: must be the two points"},
      {"SpringNoStiffness", spring(R"("points": [0, 1])"), "bodies[0].springs[0]: the key \"stiffness\" is missing"},
      {"SpringNegative", spring(R"("points": [0, 1], "stiffness": -5)"),
       "bodies[0].springs[0].stiffness: must be 0 or more [N/m], got -5"},
      {"SpringRest", spring(R"("points": [0, 1], "stiffness": 1, "rest_length": -1)"),
       "rest_length: must be 0 or more [m]"},
      {"SpringDamping", spring(R"("points": [0, 1], "stiffness": 1, "damping": "high")"), "damping: must be a number"},
      {"PinsRange", raw(R"("mass": 1, "pins": [0, 4])"), "bodies[0].pins[1]: must be below the point count 4, got 4"},
      {"PinOnRaw", raw(R"("mass": 1, "pin": [0])"), "bodies[0].pin: belongs to grids and meshes"},
      {"PinsOnGrid", grid(R"("pins": [0])"), "bodies[0].pins: belongs to raw points; grids and meshes have \"pin\""},
      {"MassesOnGrid", grid(R"("masses": [1])"), "bodies[0].masses: belongs to raw points"},
      {"WindOnRaw", raw(R"("mass": 1, "wind": {})"), "bodies[0].wind: needs triangles"},
      {"MaterialOnRaw", raw(R"("mass": 1, "material": {})"), "bodies[0].material: belongs to grids"},
      {"GridNoSize", with_body(R"({"type": "soft", "grid": {"points": [3, 3]}})"),
       "bodies[0].grid: the key \"size\" is missing"},
      {"GridOneColumn", with_body(R"({"type": "soft", "grid": {"size": [1, 1], "points": [1, 3]}})"),
       "bodies[0].grid.points[0]: must be a whole number from 2"},
      {"GridTooMany", with_body(R"({"type": "soft", "grid": {"size": [1, 1], "points": [100000, 100000]}})"),
       "bodies[0].grid.points: must make at most"},
      {"GridSizeNegative", with_body(R"({"type": "soft", "grid": {"size": [1, -1], "points": [3, 3]}})"),
       "bodies[0].grid.size[1]: must be positive"},
      {"GridParallel", with_body(R"({"type": "soft", "grid": {"size": [1, 1], "points": [3, 3], "right": [0, 2, 0]}})"),
       "bodies[0].grid: right and down must be two different"},
      {"GridNoDirection",
       with_body(R"({"type": "soft", "grid": {"size": [1, 1], "points": [3, 3], "down": [0, 0, 0]}})"),
       "bodies[0].grid.down: must be a direction"},
      {"PinIndex", grid(R"("pin": [0, 12])"), "bodies[0].pin[1]: must be below the point count 12, got 12"},
      {"PinEdge", grid(R"("pin": ["upper"])"), "bodies[0].pin[0]: must be one of top, bottom, left, right"},
      {"PinDriven", grid(R"("pin_motion": [{"points": [0]}])"),
       "bodies[0].pin_motion[0]: needs translate, swing or keys"},
      {"PinDrivenTwice",
       grid(R"("pin_motion": [{"points": "top", "translate": [0,1,0]}, {"points": [1], "translate": [0,1,0]}])"),
       "bodies[0].pin_motion[1].points: point 1 is driven by two groups"},
      {"KeysOrder",
       grid(
           R"("pin_motion": [{"points": [0], "keys": [{"time": 1, "offset": [0,0,0]}, {"time": 1, "offset": [0,1,0]}]}])"),
       "bodies[0].pin_motion[0].keys[1].time: must be later than the key before"},
      {"KeysAndSwing", grid(R"("pin_motion": [{"points": [0], "keys": [], "translate": [0,0,0]}])"),
       "bodies[0].pin_motion[0].keys: excludes translate and swing"},
      {"MaterialDensity", grid(R"("material": {"density": 0})"),
       "bodies[0].material.density: must be positive [kg/m2], got 0"},
      {"MaterialRatio", grid(R"("material": {"damping_ratio": {"stretch": -1}})"),
       "bodies[0].material.damping_ratio.stretch: must be 0 or more"},
      {"FixedNoStiffness", grid(R"("material": {"mass": 1})"), "bodies[0].material: the key \"stiffness\" is missing"},
      {"FixedMixed", grid(R"("material": {"mass": 1, "density": 1, "stiffness": {"structural": 1}})"),
       "bodies[0].material.density: unknown key"},
      {"WindSeed", grid(R"("wind": {"seed": -1})"), "bodies[0].wind.seed: must be a whole number from 0"},
      {"WindPeriod", grid(R"("wind": {"gust_period": 0})"), "bodies[0].wind.gust_period: must be positive [s], got 0"},
      {"Method", grid(R"("solver": {"method": "euler"})"),
       "bodies[0].solver.method: must be one of explicit-euler, semi-implicit-euler"},
      {"Precision", grid(R"("solver": {"precision": "half"})"),
       "bodies[0].solver.precision: must be one of float, double, double-float, got \"half\""},
      {"DtNegative", grid(R"("solver": {"dt": -1e-3})"), "bodies[0].solver.dt: must be positive [s], got -0.001"},
      {"Thickness", grid(R"("thickness": -1)"), "bodies[0].thickness: must be 0 or more [m]"},
      {"Color", grid(R"("color": [0, 2, 0])"), "bodies[0].color[1]: must be from 0 to 1"},
      {"MeshMissing", with_body(R"({"type": "soft", "mesh": "none.obj"})"), "bodies[0].mesh: ./none.obj: cannot open"},
      {"MeshNoObj", with_body(R"({"type": "soft", "mesh": "broken.obj"})"), "broken.obj: not an OBJ file"},
      {"CapeNoHuman", with_body(R"({"type": "soft", "cape": {"human": "bob"}})"),
       "bodies[0].cape.human: there is no human collider called \"bob\""},
      {"ColliderType", with_collider(R"("type": "cone")"),
       "colliders[0].type: must be one of half-space, sphere, capsule, box, mesh, lathe, level-set, human, got "
       "\"cone\""},
      {"BoxNoSize", with_collider(R"("type": "box", "center": [0,0,0])"), "colliders[0]: the key \"size\" is missing"},
      {"BoxFlat", with_collider(R"("type": "box", "center": [0,0,0], "size": [1,0,1])"),
       "colliders[0].size[1]: must be positive [m], got 0"},
      {"BoxAxis",
       with_collider(R"("type": "box", "center": [0,0,0], "size": [1,1,1], "rotation": {"axis": [0,0,0], "angle": 9})"),
       "colliders[0].rotation.axis: must be a direction, not of length 0"},
      {"BoxAngle", with_collider(R"("type": "box", "center": [0,0,0], "size": [1,1,1], "rotation": {"axis": [0,1,0]})"),
       "colliders[0].rotation: the key \"angle\" is missing"},
      {"SolidMeshMissing", with_collider(R"("type": "mesh", "file": "none.obj")"),
       "colliders[0].file: ./none.obj: cannot open"},
      {"SolidMeshBroken", with_collider(R"("type": "mesh", "file": "broken.obj")"),
       "colliders[0].file: ./broken.obj: "},
      {"SolidMeshOpen", with_collider(R"("type": "mesh", "file": "open.obj")"),
       "colliders[0].file: level_set_from_mesh: the mesh must be closed, got 3 open edges"},
      {"SolidMeshVoxel", with_collider(R"("type": "mesh", "file": "open.obj", "voxel": -1)"),
       "colliders[0].voxel: must be positive [m], got -1"},
      {"LatheShort", with_collider(R"("type": "lathe", "center": [0,0,0], "profile": [[1, 0]])"),
       "colliders[0].profile: must have from 2 to 10000 points, got 1"},
      {"LatheRadius", with_collider(R"("type": "lathe", "center": [0,0,0], "profile": [[0, 0], [-1, 0], [0, 1]])"),
       "colliders[0].profile[1][0]: must be 0 or more [m], got -1"},
      {"LatheOnAxis", with_collider(R"("type": "lathe", "center": [0,0,0], "profile": [[1, 0], [0, 1], [1, 2]])"),
       "colliders[0].profile[1]: only the first and the last point may be on the axis"},
      {"LatheTwice", with_collider(R"("type": "lathe", "center": [0,0,0], "profile": [[1, 0], [1, 0]])"),
       "colliders[0].profile[1]: is the same as the point before"},
      {"LatheAxis", with_collider(R"("type": "lathe", "center": [0,0,0], "profile": [[0, 0], [0, 1]])"),
       "colliders[0].profile: must have a point off the axis"},
      {"LatheVoxel", with_collider(R"("type": "lathe", "center": [0,0,0], "profile": [[1, 0], [1, 1]], "voxel": 1e-5)"),
       "colliders[0].profile: level_set_from_mesh: must be at most 2^28 voxels"},
      {"LevelSetMissing", with_collider(R"("type": "level-set", "file": "none.vdb")"),
       "colliders[0].file: ./none.vdb: cannot open"},
      {"LevelSetNone", with_collider(R"("type": "level-set", "file": "broken.obj")"),
       "colliders[0].file: ./broken.obj: is not an OpenVDB file"},
      {"LevelSetKey", with_collider(R"("type": "level-set", "file": "broken.obj", "voxel": 1)"),
       "colliders[0].voxel: unknown key"},
      {"ColliderNoRadius", with_collider(R"("type": "sphere", "center": [0,0,0])"),
       "colliders[0]: the key \"radius\" is missing"},
      {"ColliderRadius", with_collider(R"("type": "sphere", "center": [0,0,0], "radius": 0)"),
       "colliders[0].radius: must be positive [m], got 0"},
      {"ColliderFriction", with_collider(R"("type": "half-space", "friction": -1)"),
       "colliders[0].friction: must be 0 or more"},
      {"ColliderRestitution", with_collider(R"("type": "half-space", "restitution": 1.5)"),
       "colliders[0].restitution: must be from 0 to 1"},
      {"ColliderMotion", with_collider(R"("type": "half-space", "motion": {})"), "colliders[0].motion: unknown key"},
      {"ColliderTwice",
       with_keys(R"("colliders": [{"type": "half-space", "name": "a"}, {"type": "half-space", "name": "a"}])"),
       "colliders[1].name: two colliders are called \"a\""},
      {"HumanMotion", with_collider(R"("type": "human", "motion": "none.bvh")"),
       "colliders[0]: there is no motion file ./none.bvh; the recorded walk is in the Debian package "
       "assimp-testmodels"},
      {"HumanPreroll", with_collider(R"("type": "human", "motion": "broken.obj")"),
       "colliders[0]: the human stands still"},
      {"HumanNoMotion", with_keys(R"("preroll": 3, "colliders": [{"type": "human", "motion": "broken.obj"}])"),
       "colliders[0]: "},
      {"Camera", with_keys(R"("camera": {"eye": [0,1,0], "target": [0,0,0]})"),
       "camera: must not look straight up or down"},
      {"CameraFov", with_keys(R"("camera": {"eye": [0,1,5], "target": [0,0,0], "fov": 180})"),
       "camera.fov: must be from 1 to 120"},
      {"CameraFollow", with_keys(R"("camera": {"eye": [0,1,5], "target": [0,0,0], "follow": 1})"),
       "camera.follow: must be true or false"},
  };
  return all;
}

class BrokenScene : public ::testing::TestWithParam<Case> {};

TEST_P(BrokenScene, IsToldInOneLineWithPathAndRule) {
  test::TemporaryFolder folder;
  folder.write("broken.obj", "this is no mesh\n");
  folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  std::string message = "no error";
  try {
    SceneDescription description = parse_scene(GetParam().text, "scene.json", folder.path());
    build(description);
  } catch (const Error& error) {
    message = error.what();
  }
  // Files are named as they were found.
  if (const auto at = message.find(folder.path().string()); at != std::string::npos)
    message.replace(at, folder.path().string().size(), ".");
  EXPECT_THAT(message, HasSubstr(GetParam().message));
  EXPECT_THAT(message, ::testing::StartsWith("scene.json: "));
  EXPECT_THAT(message, Not(HasSubstr("\n")));
  EXPECT_LT(message.size(), 1000u);
}

INSTANTIATE_TEST_SUITE_P(All, BrokenScene, ::testing::ValuesIn(cases()),
                         [](const auto& each) { return std::string(each.param.name); });

TEST(BrokenScene, TheUnbrokenFormsOfTheCasesAreFine) {
  for (const std::string& text :
       {with_body(""), raw(R"("mass": 1)"), grid(R"("pin": ["top"])"), spring(R"("points": [0, 1], "stiffness": 1)"),
        with_collider(R"("type": "half-space")")})
    EXPECT_NO_THROW(build(parse_scene(text, "scene.json"))) << text;
}

}  // namespace
}  // namespace hooke::scene
