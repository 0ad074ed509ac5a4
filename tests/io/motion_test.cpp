#include <hooke/error.hpp>
#include <hooke/io/motion.hpp>

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

namespace {

using namespace hooke;
using testing::HasSubstr;

const std::filesystem::path recorded = "/usr/share/assimp/models/BVH/01_01.bvh";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// A file that is gone when the test is.
class File {
 public:
  explicit File(const std::string& text) {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            (std::string("hooke_") + test->name() + std::to_string(count_++) + ".bvh");
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~File() { std::filesystem::remove(path_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  static inline int count_ = 0;
  std::filesystem::path path_;
};

std::string error_of(const std::filesystem::path& file) {
  try {
    io::read_motion(file);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

std::string small_bvh(const std::string& motion) {
  return "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n"
         " CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
         " JOINT Leg\n {\n  OFFSET 0 -2 0\n  CHANNELS 3 Zrotation Yrotation Xrotation\n"
         "  End Site\n  {\n   OFFSET 0 -1 0\n  }\n }\n}\n" +
         motion;
}

// One joint whose height and turn about x follow the functions.
template <class F>
io::Motion synthetic(Index frames, double rate, F value) {
  io::Motion motion;
  motion.names = {"root"};
  motion.parents = {-1};
  motion.offsets = {Vec3::Zero()};
  motion.frame_rate = rate;
  for (Index f = 0; f < frames; ++f) {
    const double x = value(static_cast<double>(f) / rate);
    motion.root_positions.emplace_back(0, x, 0);
    motion.rotations.emplace_back(Eigen::AngleAxisd(0.1 * x, Vec3::UnitX()));
  }
  return motion;
}

double greatest_height(const io::Motion& motion) {
  double greatest = 0;
  for (Index f = 30; f < motion.frame_count() - 30; ++f)
    greatest = std::max(greatest, std::abs(motion.root_positions[static_cast<std::size_t>(f)].y()));
  return greatest;
}

TEST(ReadMotion, GivesTheRecordingsJointsAndFrames) {
  const io::Motion motion = io::read_motion(recorded);
  EXPECT_EQ(motion.frame_count(), 2752);
  EXPECT_NEAR(motion.frame_rate, 120, 0.01);
  EXPECT_NEAR(motion.last_time() - motion.first_time, 22.92, 0.01);
  ASSERT_EQ(motion.joint_count(), 38);
  EXPECT_EQ(motion.names[0], "Hips");
  EXPECT_EQ(motion.parents[0], -1);
  const int arm = motion.find("LeftForeArm");
  ASSERT_GE(arm, 0);
  EXPECT_EQ(motion.names[static_cast<std::size_t>(motion.parents[static_cast<std::size_t>(arm)])], "LeftArm");
  EXPECT_NEAR(motion.offsets[static_cast<std::size_t>(arm)].x(), 4.983, 1e-5);
  EXPECT_EQ(motion.find("Tail"), -1);
  EXPECT_NEAR((motion.root_positions[2] - Vec3(9.3728, 17.8666, -17.3192)).norm(), 0, 1e-5);
  for (std::size_t j = 1; j < motion.parents.size(); ++j) EXPECT_LT(motion.parents[j], static_cast<int>(j));
}

TEST(ReadMotion, AppliesRotationsInTheOrderOfTheFile) {
  // Channels are Z Y X: the leg is first turned about x, which takes -y to -z, then about z,
  // which leaves it there. The other order would end at +x.
  const File file(small_bvh("MOTION\nFrames: 1\nFrame Time: 0.1\n1 2 3 90 0 90 0 0 0\n"));
  const io::Motion motion = io::read_motion(file.path());
  io::LocalPose pose;
  io::local_pose(motion, 0, pose);
  std::vector<io::JointFrame> frames(3);
  io::global_pose(motion, pose, frames);
  EXPECT_NEAR((frames[1].position - Vec3(1, 2, 1)).norm(), 0, 1e-6);
  EXPECT_NEAR((frames[2].position - Vec3(1, 2, 0)).norm(), 0, 1e-6);
  EXPECT_EQ(motion.names[2], "EndSite_Leg");
}

TEST(ReadMotion, NamesAMissingFile) {
  EXPECT_THAT(error_of("/nowhere/walk.bvh"), HasSubstr("/nowhere/walk.bvh: no such file"));
}

TEST(ReadMotion, RefusesWhatIsNoBvh) {
  for (const std::string text : {"", "   \n", "solid cube\nendsolid\n", "HIER", "\xff\xd8\xff\xe0 picture"}) {
    const File file(text);
    EXPECT_THAT(error_of(file.path()), HasSubstr(file.path().string())) << text;
  }
  EXPECT_THAT(error_of(std::filesystem::temp_directory_path()), HasSubstr("not a regular file"));
}

TEST(ReadMotion, RefusesAFileThatEndsEarly) {
  const std::string whole = text_of(recorded);
  ASSERT_GT(whole.size(), 100000u);
  for (const double part : {0.0001, 0.0005, 0.001, 0.0015, 0.0017, 0.0018, 0.01, 0.3, 0.5, 0.99}) {
    const File file(whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))));
    EXPECT_THAT(error_of(file.path()), HasSubstr(file.path().string())) << part;
  }
  // One frame less than the header promises.
  const std::size_t last_line = whole.find_last_of('\n', whole.find_last_not_of(" \r\n") - 1);
  const File file(whole.substr(0, last_line + 1));
  EXPECT_THAT(error_of(file.path()), HasSubstr(file.path().string()));
}

TEST(ReadMotion, RefusesAMotionWithoutFramesOrTime) {
  for (const std::string motion :
       {"", "MOTION\n", "MOTION\nFrames: 0\nFrame Time: 0.1\n", "MOTION\nFrames: 1\nFrame Time: 0\n0 0 0 0 0 0 0 0 0\n",
        "MOTION\nFrames: 1\nFrame Time: -0.1\n0 0 0 0 0 0 0 0 0\n",
        "MOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0 0 0 0 0 0 0\n"}) {
    const File file(small_bvh(motion));
    EXPECT_THAT(error_of(file.path()), HasSubstr(file.path().string())) << motion;
  }
}

TEST(LowPass, KeepsAConstantAndALine) {
  io::Motion still = synthetic(100, 120, [](double) { return 0.7; });
  io::low_pass(still, 8);
  for (const Vec3& p : still.root_positions) EXPECT_NEAR(p.y(), 0.7, 1e-12);
  io::Motion line = synthetic(100, 120, [](double t) { return 3 * t; });
  io::low_pass(line, 8);
  for (std::size_t f = 0; f < 100; ++f)
    EXPECT_NEAR(line.root_positions[f].y(), 3.0 * static_cast<double>(f) / 120, 1e-12);
}

TEST(LowPass, PassesSlowMotionAndStopsFastMotion) {
  const auto wave = [](double hz) { return [hz](double t) { return std::sin(2 * std::numbers::pi * hz * t + 0.3); }; };
  io::Motion slow = synthetic(600, 120, wave(1));
  io::low_pass(slow, 8);
  EXPECT_GT(greatest_height(slow), 0.99);
  io::Motion edge = synthetic(600, 120, wave(8));
  io::low_pass(edge, 8);
  EXPECT_NEAR(greatest_height(edge), std::sqrt(0.5), 0.02);
  io::Motion fast = synthetic(600, 120, wave(40));
  io::low_pass(fast, 8);
  EXPECT_LT(greatest_height(fast), 1e-3);
  for (std::size_t f = 30; f < 570; ++f) EXPECT_NEAR(fast.rotations[f].x(), 0, 1e-4);
}

TEST(LowPass, DoesNotShiftMotionInTime) {
  io::Motion bump = synthetic(121, 120, [](double t) { return std::exp(-1e3 * (t - 0.5) * (t - 0.5)); });
  io::low_pass(bump, 8);
  for (std::size_t k = 1; k < 60; ++k)
    EXPECT_NEAR(bump.root_positions[60 - k].y(), bump.root_positions[60 + k].y(), 1e-12);
}

TEST(LocalPose, PassesThroughFramesAndIsSmoothBetweenThem) {
  io::Motion motion = io::read_motion(recorded);
  io::drop_frames(motion, 1);
  EXPECT_NEAR(motion.first_time, 1 / motion.frame_rate, 1e-12);
  io::low_pass(motion, 8);
  io::LocalPose before;
  io::LocalPose at;
  io::LocalPose after;
  const double h = 1e-5;
  for (int f = 10; f < 2700; f += 7) {
    const double t = motion.first_time + f / motion.frame_rate;
    io::local_pose(motion, t - h, before);
    io::local_pose(motion, t, at);
    io::local_pose(motion, t + h, after);
    EXPECT_NEAR((at.root - motion.root_positions[static_cast<std::size_t>(f)]).norm(), 0, 1e-9);
    // Left and right velocity agree up to curvature × h.
    EXPECT_LT((after.root - 2 * at.root + before.root).norm() / h, 0.05);
    for (std::size_t j = 0; j < at.rotations.size(); ++j) {
      EXPECT_NEAR(at.rotations[j].norm(), 1, 1e-12);
      const Eigen::Vector4d jump =
          after.rotations[j].coeffs() - 2 * at.rotations[j].coeffs() + before.rotations[j].coeffs();
      EXPECT_LT(jump.norm() / h, 0.05) << motion.names[j] << " at frame " << f;
    }
  }
}

TEST(LocalPose, HoldsStillOutsideTheRecording) {
  const io::Motion motion = synthetic(10, 10, [](double t) { return t; });
  io::LocalPose pose;
  io::local_pose(motion, -5, pose);
  EXPECT_EQ(pose.root.y(), 0);
  io::local_pose(motion, 100, pose);
  EXPECT_NEAR(pose.root.y(), 0.9, 1e-15);
}

TEST(Motion, RefusesSenselessArguments) {
  io::Motion motion = synthetic(10, 10, [](double t) { return t; });
  EXPECT_THROW(io::drop_frames(motion, 10), std::invalid_argument);
  EXPECT_THROW(io::drop_frames(motion, -1), std::invalid_argument);
  EXPECT_THROW(io::scale(motion, 0), std::invalid_argument);
  EXPECT_THROW(io::low_pass(motion, -8), std::invalid_argument);
  io::scale(motion, 2);
  EXPECT_NEAR(motion.root_positions[9].y(), 1.8, 1e-15);
}

}  // namespace
