// A skin around the capsules of a body and how it follows the joints. Time is not known here.
#pragma once

#include <human/body.hpp>

#include <array>

namespace hooke::human {

/// The joints that move a point, and how much: weights sum to 1.
struct Influence {
  std::array<int, 4> joints{0, 0, 0, 0};
  std::array<double, 4> weights{1, 0, 0, 0};
};

/// Rigid motion of a joint since some other pose, as a unit dual quaternion.
struct DualQuaternion {
  Eigen::Vector4d real{0, 0, 0, 1};  ///< x y z w
  Eigen::Vector4d dual{0, 0, 0, 0};
};

/// The motion that takes points of `from` to points of `to`.
DualQuaternion motion_between(const io::JointFrame& from, const io::JointFrame& to);

/// A point moved by the normalised weighted sum of its joints' motions.
Vec3 blend(const Influence& influence, std::span<const DualQuaternion> motions, const Vec3& point);

struct SkinSettings {
  double voxel_size = 0.0095;   ///< [m]
  double blend_radius = 0.006;  ///< [m] how far creases between capsules are filled
  double weight_width = 0.03;   ///< [m] over which one joint hands over to the next
  int smoothing = 100;          ///< rounds of volume-preserving smoothing of the bind pose
  double clearance = 0.012;     ///< [m] no vertex ends farther outside its capsules
};

/// Dual quaternion skinning of the smooth union of a body's capsules. Afterwards vertices
/// that left their capsules are drawn back to less than `clearance` outside.
class Skinning {
 public:
  Skinning(const Body& body, const io::LocalPose& bind_pose, const SkinSettings& settings);

  const TriangleMesh& mesh() const { return mesh_; }  ///< in bind pose
  const std::vector<Influence>& influences() const { return influences_; }

  /// Vertices in another pose. Does not allocate when `out` has the right size.
  /// Cost: four dual quaternions and about six capsules a vertex.
  void deform(std::span<const io::JointFrame> frames, std::span<const Capsule> capsules, Points<double>& out) const;

  /// Greatest distance [m] of a vertex outside the union of all capsules, `floor` if less.
  double greatest_distance(const Points<double>& vertices, std::span<const Capsule> capsules, double floor) const;

 private:
  void smooth(std::span<const Capsule> capsules);
  void find_weights(const Body& body, std::span<const Capsule> capsules);
  void find_neighbours(std::span<const Capsule> capsules);

  SkinSettings settings_;
  TriangleMesh mesh_;
  std::vector<io::JointFrame> bind_frames_;
  std::vector<Influence> influences_;
  std::vector<int> near_;        // capsules near a vertex in bind pose, vertex after vertex
  std::vector<int> near_start_;  // where a vertex's capsules begin, one more at the end
};

}  // namespace hooke::human
