// Times that can be compared on a machine with neighbours: everything that is to be compared takes turns,
// and ratios are those of runs that stood next to each other.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace hooke::bench {

/// Something that is run again and again. `run` does it once and returns how long it took [s].
struct Contender {
  std::function<double()> run;
  std::vector<double> times;  ///< one a round

  double least() const;
};

/// a, b, c, a, b, c, …: every contender once a round.
void take_turns(std::vector<Contender>& contenders, int rounds);

/// How many times faster a is than b.
struct Ratio {
  double median = 0;  ///< of the ratios of the rounds
  double least = 0;   ///< of the least times
};
Ratio times_faster(const Contender& a, const Contender& b);

double median(std::vector<double> values);

double cpu_seconds();   ///< processor time of this process
double wall_seconds();  ///< of a steady clock

}  // namespace hooke::bench
