// When particles die. A tick asks for those whose time has come and looks at nobody else.
#pragma once

#include <hooke/types.hpp>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace hooke::particles {

/// Times of death by particle [s]; infinity: never. Of every block of particles the earliest is known, or a time
/// before it: what was early once stays so until somebody looks.
class Deaths {
 public:
  Deaths() = default;
  explicit Deaths(Index capacity)
      : time_(std::size_t(capacity), kNever), earliest_(std::size_t((capacity + kBlock - 1) / kBlock), kNever) {}

  double operator[](Index i) const { return time_[std::size_t(i)]; }
  std::span<const double> times(Index count) const { return {time_.data(), std::size_t(count)}; }

  void set(Index i, double time) {
    time_[std::size_t(i)] = time;
    double& earliest = earliest_[std::size_t(i / kBlock)];
    earliest = std::min(earliest, time);
    first_ = std::min(first_, time);
  }

  /// Everybody lives on for so many seconds more.
  void shift(double seconds) {
    for (double& time : time_) time += seconds;
    for (double& time : earliest_) time += seconds;
    first_ += seconds;
  }

  /// Appends who of the first `count` dies up to `now`, in order. They are told once: their places must be set anew
  /// or fall behind the last. Cost: one comparison while nobody dies, else one a block, and the blocks of the dying.
  void take(double now, Index count, std::vector<Index>& dead) {
    if (first_ > now) return;
    first_ = kNever;
    for (Index begin = 0; begin < count; begin += kBlock) {
      double& earliest = earliest_[std::size_t(begin / kBlock)];
      if (earliest <= now) {
        earliest = kNever;
        for (Index i = begin; i < std::min(begin + kBlock, count); ++i)
          if (time_[std::size_t(i)] <= now)
            dead.push_back(i);
          else
            earliest = std::min(earliest, time_[std::size_t(i)]);
      }
      first_ = std::min(first_, earliest);
    }
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  // Some eight lines of the cache: about the root of a life in ticks, where looking at blocks and at those in them
  // cost the same.
  static constexpr Index kBlock = 64;

  std::vector<double> time_;
  std::vector<double> earliest_;  // by block
  double first_ = kNever;         // of all
};

}  // namespace hooke::particles
