// The person who wears the cape: recorded motion on a body of capsules with a smooth skin.
// The motion is 01_01.bvh of the CMU motion capture database. The data used in this project
// was obtained from mocap.cs.cmu.edu; the database was created with funding from NSF
// EIA-0196217. Debian ships the file in its package assimp-testmodels.
//
// What lives here is the person over time; what a cape does is not known here.
#pragma once

#include <hooke/shapes.hpp>
#include <human/body.hpp>
#include <human/skinning.hpp>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace hooke::human {

struct HumanSettings {
  std::filesystem::path motion = "/usr/share/assimp/models/BVH/01_01.bvh";
  double height = 1.75;   ///< [m] standing, crown to sole
  double from = 4.8;      ///< [s] recording time at t = 0
  double until = 11.65;   ///< [s] recording time of the frozen pose
  double hold = 1.5;      ///< [s] stands at rest before moving, so that a cape can settle
  double blend_in = 1.5;  ///< [s] from the rest pose into the recording, ends at t = 0
  double settle = 0.3;    ///< [s] over which playback slows down to a stop
  double filter_hz = 8;   ///< [Hz] low-pass of the recording
  /// [m] how far arms are kept from trunk and thighs, surface to surface: room for cloth that
  /// keeps its distance from both. More turns the arms farther out; 0 leaves them as recorded.
  double limb_gap = 0.036;
  bool plant_feet = true;  ///< hold standing feet in place, which drift in the recording
  SkinSettings skin;
};

/// World points bound to the skeleton.
struct Attachment {
  Points<double> points{0, 3};              ///< [m] where they are at the time of binding
  std::vector<Influence> influences;        ///< one a point
  std::vector<io::JointFrame> bind_frames;  ///< the pose at the time of binding
};

/// A person of capsules, in the shown time t [s]:
///   start_time() … -blend_in       stands at rest,
///   -blend_in … 0                  blends into the recording, which already plays,
///   0 … freeze_time() - settle     recording time from + t,
///   … freeze_time()                playback slows down to a stop,
///   from then on                   exactly the same pose for ever.
/// Velocity is continuous everywhere. y is up, the floor is y = 0, the shown path lies around
/// the origin. The recorded floor wanders by some centimetres; the person is lowered smoothly
/// so that the lowest foot is at the floor whenever it stands. Immutable and thread-safe.
class Human {
 public:
  /// Throws hooke::Error when the motion is missing or unusable and std::invalid_argument
  /// when a setting is out of range. Cost: under two seconds, most of it the skin.
  explicit Human(const HumanSettings& settings = {});

  double start_time() const;   ///< [s] -(hold + blend_in)
  double freeze_time() const;  ///< [s] until - from + settle/2
  double recording_time(double t) const;

  Index capsule_count() const;
  const std::vector<BoneCapsule>& bones() const;  ///< one a capsule
  const std::vector<std::string>& joint_names() const;

  /// Frames of all joints. Precondition: out.size() == joint_names().size(). A few µs.
  void pose(double t, std::span<io::JointFrame> out) const;

  /// World capsules. Precondition: out.size() == capsule_count(). A few µs.
  void capsules(double t, std::span<Capsule> out) const;

  const TriangleMesh& skin() const;  ///< in bind pose: arms half raised; the triangles are those of any t
  void skin(double t, Points<double>& vertices) const;

  /// Greatest distance [m] of a skin vertex outside the union of the capsules, at t0, t0 + 1/rate, … t1.
  double skin_clearance(double t0, double t1, double rate) const;

  /// Bind world points to the skeleton as the nearest skin moves, smoothly weighted.
  Attachment attach(const Points<double>& world_points, double t0) const;
  /// Bind world points rigidly to one joint. Throws std::invalid_argument when there is no such joint.
  Attachment attach(const Points<double>& world_points, double t0, const std::string& joint) const;
  /// Where bound points are at t; exactly rigid for one joint. Does not allocate when `out` has
  /// the right size.
  void attached(const Attachment& attachment, double t, Points<double>& out) const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

}  // namespace hooke::human
