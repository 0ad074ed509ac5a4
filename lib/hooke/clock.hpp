// Time, counted in whole ticks and told in seconds.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace hooke {

/// A fixed-rate clock. Frames of any length are cut into whole ticks and what is left over
/// waits for the next frame, so the state at tick n never depends on how frames were cut.
class Clock {
 public:
  /// @param tick_rate ticks per second, > 0
  explicit Clock(double tick_rate = 240) : tick_rate_(tick_rate) {
    if (!(tick_rate > 0) || !std::isfinite(tick_rate))
      throw std::invalid_argument("Clock: tick_rate must be positive, got " + std::to_string(tick_rate) + " 1/s");
  }

  double tick() const { return 1 / tick_rate_; }   ///< length of a tick [s]
  double tick_rate() const { return tick_rate_; }  ///< [1/s]
  std::int64_t ticks() const { return ticks_; }    ///< ticks done since the start
  double time() const { return time_at(ticks_); }  ///< [s] since the start
  double time_at(std::int64_t tick) const { return static_cast<double>(tick) / tick_rate_; }
  double remainder() const { return remainder_; }  ///< [s] banked and not yet simulated

  /// Adds a frame's length and returns how many ticks it makes room for.
  /// @param seconds >= 0
  std::int64_t bank(double seconds) {
    if (!(seconds >= 0) || !std::isfinite(seconds))
      throw std::invalid_argument("Clock: frame time must not be negative, got " + std::to_string(seconds) + " s");
    remainder_ += seconds;
    // A frame that is a whole number of ticks but for rounding must yield exactly that number.
    const auto room = static_cast<std::int64_t>(std::floor(remainder_ * tick_rate_ + 1e-6));
    remainder_ = std::max(0.0, remainder_ - static_cast<double>(room) / tick_rate_);
    return room;
  }

  void count_tick() { ++ticks_; }

  /// Goes to another time: that of a checkpoint.
  /// @param ticks, remainder as they were told there, >= 0
  void set(std::int64_t ticks, double remainder) {
    ticks_ = ticks;
    remainder_ = remainder;
  }

 private:
  double tick_rate_;
  std::int64_t ticks_ = 0;
  double remainder_ = 0;
};

}  // namespace hooke
