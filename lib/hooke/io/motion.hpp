// Recorded motion of a skeleton: reading it from a BVH file, cleaning it, and asking for
// the pose at any time. What the bones look like and what they carry is not known here.
#pragma once

#include <hooke/types.hpp>

#include <Eigen/Geometry>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hooke::io {

/// Where a joint is and how it is turned, in the space of the recording.
struct JointFrame {
  Vec3 position{0, 0, 0};                                        ///< [m] once the motion is scaled to metres
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit

  /// The point of space that has the coordinates `local` in this frame.
  Vec3 operator*(const Vec3& local) const { return position + rotation * local; }
};

/// One pose: the root's position and every joint's rotation relative to its parent.
struct LocalPose {
  Vec3 root{0, 0, 0};                         ///< [m]
  std::vector<Eigen::Quaterniond> rotations;  ///< unit, one a joint
};

/// A skeleton and how it moves. Parents come before their children; the end of a bone that
/// has no further joint is a joint too, named "EndSite_<parent>". Neighbouring frames hold
/// quaternions of the same sign (dot product >= 0), which low_pass and local_pose need.
struct Motion {
  std::vector<std::string> names;             ///< one a joint
  std::vector<int> parents;                   ///< one a joint, -1 for the root
  std::vector<Vec3> offsets;                  ///< [m] from the parent, in the parent's frame
  double frame_rate = 0;                      ///< [1/s], > 0
  double first_time = 0;                      ///< [s] recording time of frame 0
  std::vector<Vec3> root_positions;           ///< [m], one a frame
  std::vector<Eigen::Quaterniond> rotations;  ///< unit, frame after frame, one a joint

  Index joint_count() const { return static_cast<Index>(names.size()); }
  Index frame_count() const { return static_cast<Index>(root_positions.size()); }
  double last_time() const { return first_time + static_cast<double>(frame_count() - 1) / frame_rate; }
  /// Index of the joint with this name, -1 when there is none.
  int find(std::string_view name) const;
};

/// The motion in a BVH file, in the file's length unit. Throws hooke::Error, which names
/// the file and what is wrong, when it is missing, no BVH, truncated (fewer numbers than
/// its header promises), or has no joints, no frames or no usable frame time.
Motion read_motion(const std::filesystem::path& file);

/// Remove the first `count` frames; the others keep their times.
/// Precondition: 0 <= count < frame_count, else std::invalid_argument.
void drop_frames(Motion& motion, Index count);

/// Multiply all lengths. Precondition: factor > 0, else std::invalid_argument.
void scale(Motion& motion, double factor);

/// Zero-phase low-pass of root position and rotations: a Gaussian whose amplitude response
/// is 1/√2 at `cut_off` [Hz] and exp(-ln 2/2 (f/cut_off)²) at f. Quaternions are filtered
/// by component and normalised. The ends are continued by point reflection, so that a
/// constant and a straight line stay what they are.
/// Precondition: cut_off > 0, else std::invalid_argument. Cost: frames × joints × width.
void low_pass(Motion& motion, double cut_off);

/// The pose at a recording time, held still before the first and after the last frame.
/// Between frames Catmull-Rom splines of position and quaternion components, normalised:
/// passes through the frames, velocity is continuous. Allocates only when `out` has the
/// wrong size. Precondition: the motion has a frame.
void local_pose(const Motion& motion, double time, LocalPose& out);

/// Forward kinematics: frame of joint j = frame of its parent × (offset, rotation).
/// Precondition: out.size() == joint_count (asserted). Does not allocate.
void global_pose(const Motion& motion, const LocalPose& pose, std::span<JointFrame> out);

}  // namespace hooke::io
