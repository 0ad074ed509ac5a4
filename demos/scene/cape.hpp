// Dresses a human in a cape: where its points are at the start and which of them hang on
// the shoulders. How it moves from there is a soft body's business.
#pragma once

#include <hooke/softbody/cloth.hpp>
#include <human/human.hpp>

namespace hooke::scene {

struct CapeSettings {
  double width = 0.9, height = 1.2;  ///< [m]
  int columns = 60, rows = 80;       ///< points across and down
  double thickness = 0.02;           ///< distance kept from the capsules [m]
  softbody::ClothMaterial material;
};

struct Cape {
  softbody::Cloth cloth;         ///< positions in world coordinates at time t0
  std::vector<Index> pins;       ///< along the shoulders and the neck
  human::Attachment attachment;  ///< of the pins, in the order of `pins`
};

/// @throws std::invalid_argument for settings that make no cloth
Cape dress(const human::Human& human, const CapeSettings& settings, double t0);

}  // namespace hooke::scene
