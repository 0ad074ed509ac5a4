// What a run is judged by: stretch of cloth, and how a cape lies on its wearer.
#pragma once

#include <scene/scene.hpp>

#include <string>
#include <utility>
#include <vector>

namespace hooke::scene {

/// Largest strain of structural springs (families Stretch and Raw), of those whose ends are not
/// both held; 0 where there is none.
double worst_stretch(const SceneBody& body);
/// … of all bodies.
double worst_stretch(const Scene& scene);

/// How deep the deepest point that is not held is inside a collider's surface, thickened by its body's thickness [m];
/// 0 where none is. Colliders that are functions do not count. Cost: points × shapes.
double worst_penetration(const Scene& scene);

/// Figures of one cape over the shown time.
class CapeFigures {
 public:
  /// @param body index of a cape in scene.bodies
  CapeFigures(const Scene& scene, std::size_t body);

  /// Looks at the present state: depths and pin error. Cost: points × capsules.
  void measure(const Scene& scene);
  /// Also takes down the strains; once a shown frame.
  void measure_frame(const Scene& scene);

  /// Greatest depth [m] of a free point inside the capsules' surface, thickened by the body's
  /// thickness, and inside the bare capsules; points within the thickness of two capsules or more do
  /// not count, for no surface can hold them. Negative: never touched.
  double depth() const { return depth_; }
  double bare_depth() const { return bare_depth_; }
  double pin_error() const { return pin_error_; }  ///< greatest distance of a pin from where it should be [m]
  double worst_stretch() const;
  double stretch_percentile(double share) const;  ///< of all structural springs in all frames
  /// (end of it [s], RMS over free points and looks [m/s]) of each half second after the wearer's last step.
  const std::vector<std::pair<double, double>>& settling() const { return settling_; }

  /// All of it, a line each.
  std::string text() const;

  /// For checkpoints: what was measured so far.
  void save(CheckpointWriter& out) const;
  void load(CheckpointReader& in);

 private:
  std::size_t body_;
  std::string name_;
  double thickness_;
  double freeze_;
  double depth_ = -1e300, bare_depth_ = -1e300, pin_error_ = 0;
  double depth_time_ = 0, bare_depth_time_ = 0, worst_time_ = 0;
  float worst_ = 0;
  mutable std::vector<float> strains_;
  std::vector<std::pair<double, double>> settling_;
  double speed_squared_ = 0;
  Index speeds_ = 0;
};

}  // namespace hooke::scene
