// The same bits as when hashes.csv was written, by scene, method and precision, on the scalar path: with any compiler
// at any optimisation. To renew after a wanted change of the arithmetic:
//   HOOKE_RENEW_HASHES=1 stability_tests --gtest_filter='StateHash.*'
// and say in the commit what changed it.
#include <stability/scenes.hpp>
#include <stability/trial.hpp>

#include <gtest/gtest.h>

#include <cinttypes>
#include <cstdlib>
#include <fstream>
#include <map>

namespace hooke::stability {
namespace {

const char* const kFile = HOOKE_STABILITY_FOLDER "/hashes.csv";

// The methods of the core that this regression follows.
const char* const kMethods[]{"velocity-verlet", "verlet", "semi-implicit-euler", "rk4"};

std::map<std::string, std::string> measured_hashes() {
  std::map<std::string, std::string> out;
  for (const scene::SceneDescription& d : hashed_scenes())
    for (const char* method : kMethods)
      for (const auto precision : {softbody::Precision::Float, softbody::Precision::Double}) {
        Solver solver;
        solver.method = method;
        solver.precision = precision;
        scene::Scene scene = build(d, solver);
        if (const auto* body = dynamic_cast<const PointBody<float>*>(scene.bodies[0].body)) {
          EXPECT_FALSE(body->fused()) << d.file;
        }
        EXPECT_TRUE(scene.world.update(d.duration).good());
        const std::string name = d.file + "," + method + "," + std::string(softbody::precision_name(precision));
        out[name] = format("%016" PRIx64, state_hash(scene.world));
      }
  return out;
}

TEST(StateHash, IsTheOneOfTheFile) {
  const auto measured = measured_hashes();
  if (std::getenv("HOOKE_RENEW_HASHES")) {
    std::ofstream file(kFile);
    file << "scene,method,precision,hash\n";
    for (const auto& [name, hash] : measured) file << name << "," << hash << "\n";
    ASSERT_TRUE(file.good());
    GTEST_SKIP() << "written anew";
  }
  std::ifstream file(kFile);
  std::string line;
  std::getline(file, line);
  std::size_t known = 0;
  while (std::getline(file, line)) {
    const std::size_t comma = line.rfind(',');
    const auto found = measured.find(line.substr(0, comma));
    ASSERT_NE(found, measured.end()) << line;
    EXPECT_EQ(found->second, line.substr(comma + 1)) << found->first;
    ++known;
  }
  EXPECT_EQ(known, measured.size());
}

TEST(StateHash, SeesTheLastBitOfOneCoordinate) {
  scene::Scene scene = build(hashed_scenes()[0], {});
  const std::uint64_t before = state_hash(scene.world);
  Body& body = *scene.bodies[0].body;
  const Vec3 x = body.positions().row(9).matrix().transpose();
  body.set_position(9, {x.x(), x.y(), std::nextafter(float(x.z()), 1.0f)});
  EXPECT_NE(state_hash(scene.world), before);
  body.set_position(9, x);
  EXPECT_EQ(state_hash(scene.world), before);
}

}  // namespace
}  // namespace hooke::stability
