// Whatever a scene file holds, it is read or refused with one line; it never crashes or hangs.
#include <hooke/error.hpp>
#include <scene/reader.hpp>
#include <scene/scene.hpp>

#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <cstdlib>
#include <random>

namespace hooke::scene {
namespace {

constexpr Index kMostPointsToBuild = 3000;
constexpr int kRounds = 4000;

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }

  // Bytes changed, cut, doubled or swapped for something that hurts.
  std::string bytes(std::string text) {
    for (std::size_t i = 0, n = 1 + below(4); i < n && !text.empty(); ++i) {
      const std::size_t at = below(text.size());
      switch (below(6)) {
        case 0:
          text[at] = char(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(10));
          break;
        case 2:
          text.insert(at, text.substr(below(text.size()), below(40)));
          break;
        case 3:
          text.resize(at);
          break;
        case 4:
          text.insert(at, 1, "[]{}\",:-.0e"[below(11)]);
          break;
        default:
          text[at] = char(text[at] ^ char(1 << below(8)));
      }
    }
    return text;
  }

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

 private:
  std::mt19937 random_;
};

Index points_of(const SceneDescription& scene) {
  Index count = 0;
  for (const SoftBody& body : scene.bodies) {
    if (const auto* grid = std::get_if<Grid>(&body.form)) count += Index(grid->columns) * grid->rows;
    if (const auto* cape = std::get_if<CapeCut>(&body.form)) count += Index(cape->columns) * cape->rows;
    if (const auto* raw = std::get_if<RawPoints>(&body.form)) count += raw->points.rows();
  }
  return count;
}

bool has_human(const SceneDescription& scene) {
  for (const ColliderDescription& collider : scene.colliders)
    if (std::holds_alternative<human::HumanSettings>(collider.solid)) return true;
  return false;
}

// Returns whether it was a scene.
bool survives(const std::string& text) {
  try {
    const SceneDescription description = parse_scene(text, "fuzz.json", HOOKE_SCENES_FOLDER);
    if (points_of(description) > kMostPointsToBuild || has_human(description)) return true;
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
  const char* const given = std::getenv("HOOKE_SEED");
  const unsigned seed = given ? unsigned(std::strtoul(given, nullptr, 10)) : std::random_device()();
  std::printf("HOOKE_SEED=%u\n", seed);
  SCOPED_TRACE("HOOKE_SEED=" + std::to_string(seed));
  std::vector<std::string> texts{R"({"hooke": 1, "damping": 0.1, "bodies": [
    {"type": "soft", "name": "a", "points": [[0,0,0],[1,0,0],[2,0,0]], "masses": [1,1,1], "velocities": [[0,0,0],[0,1,0],[0,0,0]],
     "springs": [{"points": [0,1], "stiffness": 5, "damping": 1, "rest_length": 0.5}, {"points": [1,2], "stiffness": 7}],
     "pins": [0], "drag": {"linear": 0.1}, "solver": {"method": "rk4", "dt": 1e-3, "precision": "double"}},
    {"type": "soft", "name": "b", "grid": {"size": [1, 1], "points": [4, 4]}, "pin": ["top", 7],
     "material": {"mass": 1, "stiffness": {"structural": 5, "shear": 2}, "damping": 0.1}}]})"};
  for (const auto& entry : std::filesystem::directory_iterator(HOOKE_SCENES_FOLDER))
    if (entry.path().extension() == ".json") texts.push_back(test::contents(entry.path()));
  Mutator mutator(seed);
  int scenes = 0;
  for (int round = 0; round < kRounds; ++round) {
    const std::string& text = texts[mutator.below(texts.size())];
    if (round % 2) {
      scenes += survives(mutator.bytes(text));
    } else {
      Json json = Json::parse(text);
      for (std::size_t i = 0, n = 1 + mutator.below(3); i < n; ++i) mutator.structure(json);
      scenes += survives(json.dump());
    }
    if (HasFailure()) break;
  }
  // Neither is everything refused nor everything taken.
  EXPECT_GT(scenes, kRounds / 100);
  EXPECT_LT(scenes, kRounds * 9 / 10);
}

}  // namespace
}  // namespace hooke::scene
