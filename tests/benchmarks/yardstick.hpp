// The yardstick of the benchmarks, compiled with -O3 -march=native as its user would.
#pragma once

#include <string>
#include <vector>

namespace hooke::bench {

/// A sheet of springs and gravity alone, in plain arrays.
struct PlainSheet {
  struct Spring {
    int a, b;
    double stiffness, rest;  // [N/m], [m]
  };
  std::vector<double> positions;       ///< [m], x, y, z of every point
  std::vector<double> inverse_masses;  ///< [1/kg], 0 where held
  std::vector<Spring> springs;
  double gravity[3] = {0, -9.81, 0};  ///< [m/s²]
};

/// What a run of the yardstick from rest came to.
struct YardstickRun {
  double seconds = 0;             ///< processor time of the steps
  std::vector<double> positions;  ///< [m], x, y, z of every point
};

template <class S>
YardstickRun run_yardstick(const PlainSheet& sheet, int steps, double duration);

extern template YardstickRun run_yardstick<float>(const PlainSheet&, int, double);
extern template YardstickRun run_yardstick<double>(const PlainSheet&, int, double);

/// Multiplies and adds to each of seven arrays in place, from first to before last: what memory allows. Values stay.
void read_modify_write(float* const arrays[7], long first, long last);

/// How the yardstick was compiled.
std::string yardstick_flags();

}  // namespace hooke::bench
