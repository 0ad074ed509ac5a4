// Numbers as bytes. Not installed.
#pragma once

#include <hooke/types.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace hooke::io {

// Bytes as they go into a little-endian file.
class Bytes {
 public:
  void add(std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes_.push_back(std::byte(value >> shift & 0xff));
  }
  void add(float value) { add(std::bit_cast<std::uint32_t>(value)); }
  void add(std::uint8_t value) { bytes_.push_back(std::byte(value)); }
  void add(std::string_view text) {
    for (const char c : text) bytes_.push_back(std::byte(c));
  }
  void add(const Points<double>& points) {
    bytes_.reserve(bytes_.size() + std::size_t(points.size()) * 4);
    for (Index i = 0; i < points.rows(); ++i)
      for (int k = 0; k < 3; ++k) add(float(points(i, k)));
  }
  operator std::span<const std::byte>() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace hooke::io
