// Whatever a scene file holds, it is read or refused with one line; it never crashes or hangs.
#include <hooke/error.hpp>
#include <scene/reader.hpp>
#include <scene/scene.hpp>

#include <fuzz.hpp>
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

namespace hooke::scene {
namespace {

constexpr Index kMostPointsToBuild = 3000;

class Mutator : public test::Damage {
 public:
  using Damage::Damage;

  // Some value of the tree replaced by one of another kind or size, dropped or doubled.
  void structure(Json& json) {
    Json* here = &json;
    while (here->is_structured() && !here->empty() && below(8) != 0) {
      auto child = here->begin();
      std::advance(child, std::ptrdiff_t(below(here->size())));
      if (here->is_object() && below(12) == 0) {
        here->erase(child);
        return;
      }
      if (here->is_array() && below(12) == 0) {
        here->push_back(Json(*child));
        return;
      }
      here = &*child;
    }
    static const std::vector<Json> values{nullptr,
                                          true,
                                          0,
                                          1,
                                          -1,
                                          2,
                                          1e300,
                                          -1e300,
                                          1e-300,
                                          4000000000u,
                                          0.5,
                                          1e9,
                                          "",
                                          "top",
                                          "soft",
                                          "float",
                                          "verlet",
                                          Json::array(),
                                          Json::object(),
                                          {0, 0, 0},
                                          {1, 2},
                                          {{0, 0, 0}, {0, 0, 0}},
                                          -0.0,
                                          12345678901234567890u};
    *here = values[below(values.size())];
  }
};

Index points_of(const SceneDescription& scene) {
  Index count = 0;
  for (const SoftBody& body : scene.bodies) {
    if (const auto* grid = std::get_if<Grid>(&body.form)) count += Index(grid->columns) * grid->rows;
    if (const auto* box = std::get_if<LatticeBox>(&body.form))
      count += Index(box->points[0]) * box->points[1] * box->points[2];
    if (const auto* cape = std::get_if<CapeCut>(&body.form)) count += Index(cape->columns) * cape->rows;
    if (const auto* raw = std::get_if<RawPoints>(&body.form)) count += raw->points.rows();
  }
  // A particle's memory is that of its capacity; the scenes' own must be built.
  for (const ParticleBody& body : scene.particles) count += body.settings.capacity / 100;
  return count;
}

// Humans and level sets.
bool builds_slowly(const SceneDescription& scene) {
  for (const ColliderDescription& collider : scene.colliders)
    if (!std::holds_alternative<MovingShape>(collider.solid)) return true;
  return false;
}

// Returns whether it was a scene.
bool survives(const std::string& text) {
  try {
    const SceneDescription description = parse_scene(text, "fuzz.json", HOOKE_SCENES_FOLDER);
    if (points_of(description) > kMostPointsToBuild || builds_slowly(description)) return true;
    const Scene scene = build(description);
    for (const SceneBody& body : scene.bodies) EXPECT_TRUE(body.body->positions().allFinite()) << text;
    return true;
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_TRUE(message.starts_with("fuzz.json: ")) << message;
    EXPECT_LT(message.size(), 2000u);
    return false;
  }
}

TEST(Fuzz, MutatedScenesAreReadOrRefused) {
  const std::uint64_t seed = test::fuzz_seed();
  SCOPED_TRACE("HOOKE_SEED=" + std::to_string(seed));
  std::vector<std::string> texts{
      R"({"hooke": 1, "damping": 0.1, "bodies": [
    {"type": "soft", "name": "a", "points": [[0,0,0],[1,0,0],[2,0,0]], "masses": [1,1,1], "velocities": [[0,0,0],[0,1,0],[0,0,0]],
     "springs": [{"points": [0,1], "stiffness": 5, "damping": 1, "rest_length": 0.5}, {"points": [1,2], "stiffness": 7}],
     "pins": [0], "drag": {"linear": 0.1}, "solver": {"method": "rk4", "dt": 1e-3, "precision": "double"}},
    {"type": "soft", "name": "b", "grid": {"size": [1, 1], "points": [4, 4]}, "pin": ["top", 7],
     "material": {"mass": 1, "stiffness": {"structural": 5, "shear": 2}, "damping": 0.1}}]})",
      R"({"hooke": 1, "preroll": 1, "bodies": [{"type": "particles", "name": "p", "capacity": 1000, "at_capacity": "oldest-dies",
     "seed": 3, "prewarm": 1, "trail": 2, "contact": {"radius": 0.01, "restitution": 0.5, "rest_speed": 0.1, "exact": true, "dies": false},
     "kinds": [{"name": "a", "look": "spark", "color": {"temperature": [[0, 2600], [1, 900]]}, "intensity": 5},
               {"name": "b", "look": "smoke", "color": [[0, [1, 1, 1]], [1, [0, 0, 0]]], "size": [[0, 1], [1, 2]], "opacity": 0.5}],
     "emitters": [{"shape": "cone", "radius": 0.1, "angle": 10, "position": [0, 1, 0], "axis": [1, 0, 0], "spread": 5,
                   "rate": [[0, 10], [1, 20]], "start": -1, "stop": 4, "speed": [1, 2], "lifetime": [1, 2], "mass": 0.1, "size": 0.01,
                   "motion": {"translate": [1, 0, 0]}, "inherit": 0.5, "kind": "b"},
                  {"shape": "line", "to": [1, 0, 0], "bursts": [{"time": 1, "count": 10, "period": 0.5}]}],
     "forces": [{"force": "linear-drag", "coefficient": 1, "wind": [1, 0, 0]}, {"force": "attractor", "place": [0, 0, 0], "strength": 1},
                {"force": "turbulence", "speed": 1, "size": 1, "turnover": 1, "seed": 1, "rate": 1},
                {"force": "vortex", "place": [0, 0, 0], "axis": [0, 1, 0], "circulation": 1, "core": 1, "updraught": 1, "rate": 1},
                {"force": "repulsion", "stiffness": 1, "distance": 1}],
     "sub_emitters": [{"on": "impact", "parent": "a", "kind": "b", "probability": 0.5, "count": [1, 2], "least_impact": 1, "axis": [0, 1, 0],
                       "spread": 10, "speed": 1, "inherit": 1, "lifetime": 1, "size": 0.1, "mass": 1}],
     "solver": {"method": "rk4", "dt": 1e-3, "precision": "double"}}]})"};
  for (const auto& entry : std::filesystem::directory_iterator(HOOKE_SCENES_FOLDER))
    if (entry.path().extension() == ".json") texts.push_back(test::contents(entry.path()));
  Mutator mutator(seed);
  const int rounds = test::fuzz_rounds(4000);
  int scenes = 0;
  for (int round = 0; round < rounds; ++round) {
    const std::string& text = texts[mutator.below(texts.size())];
    if (round % 2) {
      scenes += survives(mutator(text, "[]{}\",:-.0e"));
    } else {
      Json json = Json::parse(text);
      for (std::size_t i = 0, n = 1 + mutator.below(3); i < n; ++i) mutator.structure(json);
      scenes += survives(json.dump());
    }
    if (HasFailure()) break;
  }
  // Neither is everything refused nor everything taken.
  EXPECT_GT(scenes, rounds / 100);
  EXPECT_LT(scenes, rounds / 10 * 9);
}

}  // namespace
}  // namespace hooke::scene
