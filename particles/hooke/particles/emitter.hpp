// Where and when particles are born, as a function of time alone: frames and ticks change nothing.
#pragma once

#include <hooke/particles/curve.hpp>
#include <hooke/particles/random.hpp>

#include <functional>
#include <limits>
#include <memory>
#include <variant>
#include <vector>

namespace hooke::particles {

/// A uniform distribution.
struct Range {
  double least = 0, most = 0;
  Range(double value = 0) : least(value), most(value) {}  // NOLINT: a number is a range
  Range(double low, double high) : least(low), most(high) {}
  double at(double share) const { return least + share * (most - least); }
};

/// Forms to be born on, around the emitter's position; `axis` is the emitter's.
struct PointSource {};
struct LineSource {
  Vec3 to{1, 0, 0};  ///< from the position to position + to [m]
};
struct DiscSource {
  double radius = 1, inner_radius = 0;  ///< [m], across the axis
};
/// A disc whose particles fly on the rays of a cone: along the axis at its centre, `angle` from it at the rim.
struct ConeSource {
  double radius = 0.1;  ///< [m], >= 0
  double angle = 0.3;   ///< [rad], in [0, π/2)
};
struct SphereSource {
  double radius = 1, inner_radius = 0;  ///< [m]; born in between, uniform in volume
};
struct BoxSource {
  Vec3 half_extent{0.5, 0.5, 0.5};  ///< [m]
};
struct MeshSource {
  std::shared_ptr<const TriangleMesh> mesh;  ///< uniform on its surface
};
using Source = std::variant<PointSource, LineSource, DiscSource, ConeSource, SphereSource, BoxSource, MeshSource>;

/// Many at once.
struct Burst {
  double time = 0;    ///< [s], of the emitter's clock
  Index count = 100;  ///< >= 0
  double period = 0;  ///< [s]; > 0: again and again
};

struct EmitterSettings {
  Source source = PointSource{};
  Vec3 position{0, 0, 0};  ///< [m]
  Vec3 axis{0, 1, 0};      ///< the direction of flight; any length
  /// Fly along the form's own normals (away from a sphere's centre, a mesh's outward normal) instead of the axis.
  bool along_normal = false;
  double spread = 0;  ///< half angle of the directions' cap around that [rad], in [0, π]
  Curve rate = 0;     ///< [1/s] over the emitter's clock
  std::vector<Burst> bursts;
  double start = 0;                                          ///< [s], where its clock is 0
  double stop = std::numeric_limits<double>::infinity();     ///< [s], end of births
  Range speed = 1;                                           ///< [m/s]
  Range lifetime = std::numeric_limits<double>::infinity();  ///< [s], > 0
  Range mass = 1;                                            ///< [kg], > 0
  Range size = 0.01;                                         ///< radius as drawn [m], >= 0
  std::function<Vec3(double t)> path;                        ///< moves the emitter: adds to its position [m]
  double inherit = 1;                                        ///< share of the path's velocity that its particles get
  int kind = 0;                                              ///< which of ParticleSettings::kinds they are
  std::uint64_t seed = 0;
};

/// A particle as it is born.
struct Birth {
  double time = 0;                            ///< [s]
  Vec3 position{0, 0, 0}, velocity{0, 0, 0};  ///< at that time, world
  double lifetime = std::numeric_limits<double>::infinity();
  double mass = 1, size = 0.01;
  int kind = 0;
  std::uint64_t number = 0;  ///< in its emitter's count
};

/// Holds no state but its settings: births between two times can be asked for again.
class Emitter {
 public:
  /// @throws std::invalid_argument naming the setting, the rule and the value
  explicit Emitter(EmitterSettings settings);

  const EmitterSettings& settings() const { return settings_; }

  /// Appends those born in [t0, t1), in the order of their times; the k-th of a rate when the rate's integral is
  /// k + ½. Intervals that meet give each particle once. Cost: births.
  void births(double t0, double t1, std::vector<Birth>& out) const;

 private:
  Birth birth(double time, std::uint64_t number) const;

  EmitterSettings settings_;
  Random random_;
  std::vector<double> area_sums_;  // of a mesh's triangles
};

/// Born of another particle's birth, death or impact.
struct SubEmitterSettings {
  enum class On { Birth, Death, Impact };
  On on = On::Death;
  int parent_kind = 0;               ///< which particles have such children
  double probability = 1;            ///< that an event has children at all
  Range count = 3;                   ///< a number of children; rounded down after adding a random share
  double least_impact = 0;           ///< [m/s], approach speed below which an impact has none
  Vec3 axis{0, 0, 0};                ///< direction of flight; (0, 0, 0): any, or the surface's normal for impacts
  double spread = 3.14159265358979;  ///< [rad] around it
  Range speed = 1;                   ///< [m/s], on top of what they inherit
  double inherit = 0.5;              ///< share of the parent's velocity
  Range lifetime = 0.5;              ///< [s]
  Range size = 0.005;                ///< [m]
  double mass = 1;                   ///< [kg]
  int kind = 1;                      ///< of the children; not parent_kind, or they would never end
  std::uint64_t seed = 0;
};

}  // namespace hooke::particles
