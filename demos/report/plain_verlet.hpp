// Velocity Verlet over a list of springs, as it comes out of the pen in an hour: plain scalar code on
// records, no reordering, no vectors, no tricks. The yardstick of the report and of the benchmarks. Knows
// nothing of the library, so that it can be compiled for a single machine.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace hooke::report {

template <class S>
class PlainVerlet {
 public:
  using Vec = std::array<S, 3>;
  struct Spring {
    int a, b;           // points
    S stiffness, rest;  // [N/m], [m]
  };

  /// @param inverse_masses [1/kg], 0 where held  @param gravity [m/s²], on free points
  PlainVerlet(std::vector<Vec> positions, std::vector<Vec> velocities, std::vector<S> inverse_masses,
              std::vector<Spring> springs, const Vec& gravity)
      : x_(std::move(positions)),
        v_(std::move(velocities)),
        f_(x_.size()),
        w_(std::move(inverse_masses)),
        springs_(std::move(springs)),
        gravity_(gravity) {}

  void run(int steps, double duration) {
    const S h = S(duration / steps);
    pull();
    for (int step = 0; step < steps; ++step) {
      kick(h / 2);
      for (std::size_t i = 0; i < x_.size(); ++i)
        for (int k = 0; k < 3; ++k) x_[i][k] += h * v_[i][k];
      pull();
      kick(h / 2);
    }
  }

  const std::vector<Vec>& positions() const { return x_; }

 private:
  void pull() {
    std::fill(f_.begin(), f_.end(), Vec{});
    for (const Spring& spring : springs_) {
      const Vec& p = x_[std::size_t(spring.a)];
      const Vec& q = x_[std::size_t(spring.b)];
      const Vec d{q[0] - p[0], q[1] - p[1], q[2] - p[2]};
      const S length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const S scale = spring.stiffness * (length - spring.rest) / length;
      for (int k = 0; k < 3; ++k) {
        f_[std::size_t(spring.a)][k] += scale * d[k];
        f_[std::size_t(spring.b)][k] -= scale * d[k];
      }
    }
  }

  void kick(S time) {
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (w_[i] == S(0)) continue;
      for (int k = 0; k < 3; ++k) v_[i][k] += time * (w_[i] * f_[i][k] + gravity_[k]);
    }
  }

  std::vector<Vec> x_, v_, f_;
  std::vector<S> w_;
  std::vector<Spring> springs_;
  Vec gravity_;
};

}  // namespace hooke::report
