// A finished picture in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hooke::render {

/// 8-bit sRGB picture, three bytes a pixel, top row first, no padding.
struct Image {
  int width = 0;                  ///< [pixels]
  int height = 0;                 ///< [pixels]
  std::vector<std::uint8_t> rgb;  ///< 3 · width · height bytes

  /// The first of the three bytes of the pixel in column x of row y (row 0 is the top).
  const std::uint8_t* at(int x, int y) const { return rgb.data() + 3 * (static_cast<std::size_t>(y) * width + x); }
  std::uint8_t* at(int x, int y) { return rgb.data() + 3 * (static_cast<std::size_t>(y) * width + x); }
};

}  // namespace hooke::render
