// Whatever a mesh or a recording holds, it is read or refused with one line; it never crashes or hangs.
#include <hooke/error.hpp>
#include <hooke/io/mesh_file.hpp>
#include <hooke/io/motion.hpp>
#include <io/temporary_folder.hpp>

#include <fuzz.hpp>

#include <gtest/gtest.h>

#include <functional>

#ifdef __SANITIZE_ADDRESS__
// assimp leaks the joints of a BVH file that it gives up.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp\n"; }
#endif

namespace hooke::io {
namespace {

// The share of damaged files that was read all the same.
double share_read(const std::string& name, const std::string& text, const std::string& special, int usual,
                  const std::function<void(const std::filesystem::path&)>& read) {
  const std::uint64_t seed = test::fuzz_seed();
  SCOPED_TRACE("HOOKE_SEED=" + std::to_string(seed));
  test::Damage damage(seed);
  const test::TemporaryFolder folder;
  const int rounds = test::fuzz_rounds(usual);
  int good = 0;
  for (int round = 0; round < rounds && !testing::Test::HasFailure(); ++round) {
    const auto file = folder.write(name, damage(text, special));
    try {
      read(file);
      ++good;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_NE(message.find(name), std::string::npos) << message;
      EXPECT_LT(message.size(), 2000u);
    }
  }
  return double(good) / rounds;
}

TEST(Fuzz, DamagedMeshesAreReadOrRefused) {
  const std::string text =
      "# a box\nmtllib none.mtl\no box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1.5e0\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "vt 0 0\nvn 0 0 1\ns off\nusemtl none\nf 4 3 2 1\nf 5/1 6/1 7/1 8/1\nf 1//1 2//1 6//1 5//1\nf 2/1/1 3/1/1 "
      "7/1/1 6/1/1\ng side\nf 3 4 -1 -2\nf -4 -8 -5\n";
  const double share = share_read("mesh.obj", text, "vf/-#\n\\ .e0", 4000, [](const auto& file) {
    const TriangleMesh mesh = read_obj(file);
    EXPECT_TRUE(mesh.vertices.allFinite());
    EXPECT_FALSE(mesh.triangles.empty());
    for (const Triangle& t : mesh.triangles)
      for (const int corner : t) {
        EXPECT_GE(corner, 0);
        EXPECT_LT(corner, mesh.vertices.rows());
      }
  });
  EXPECT_GT(share, 0.05);
  EXPECT_LT(share, 0.95);
}

TEST(Fuzz, DamagedRecordingsAreReadOrRefused) {
  const std::string text =
      "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
      "Xrotation\n JOINT Leg\n {\n  OFFSET 0 -2 0\n  CHANNELS 3 Zrotation Yrotation Xrotation\n  End Site\n  {\n   "
      "OFFSET 0 -1 0\n  }\n }\n}\nMOTION\nFrames: 3\nFrame Time: 0.008333\n0 1 0 10 20 30 1 2 3\n0 1.1 0 11 21 31 1 2 "
      "3\n0 1.2 -1e-3 12 22 32 1 2 3\n";
  const double share = share_read("walk.bvh", text, "{}:-.e0 \n", 2000, [](const auto& file) {
    Motion motion = read_motion(file);
    ASSERT_GT(motion.frame_count(), 0);
    ASSERT_GT(motion.joint_count(), 0);
    EXPECT_GT(motion.frame_rate, 0);
    ASSERT_EQ(motion.parents.size(), motion.names.size());
    ASSERT_EQ(motion.offsets.size(), motion.names.size());
    ASSERT_EQ(motion.rotations.size(), std::size_t(motion.frame_count() * motion.joint_count()));
    for (std::size_t j = 0; j < motion.parents.size(); ++j) {
      EXPECT_LT(motion.parents[j], int(j));
      EXPECT_TRUE(motion.offsets[j].allFinite());
    }
    for (const Vec3& root : motion.root_positions) EXPECT_TRUE(root.allFinite());
    for (const auto& turn : motion.rotations) EXPECT_TRUE(turn.coeffs().allFinite());
    LocalPose pose;
    local_pose(motion, motion.first_time, pose);
    std::vector<JointFrame> frames(std::size_t(motion.joint_count()));
    global_pose(motion, pose, frames);
  });
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.98);
}

}  // namespace
}  // namespace hooke::io
