#include "rounds.hpp"

#include <algorithm>
#include <ctime>

namespace hooke::bench {

namespace {

double read(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

}  // namespace

double cpu_seconds() { return read(CLOCK_PROCESS_CPUTIME_ID); }
double wall_seconds() { return read(CLOCK_MONOTONIC); }

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

double Contender::least() const { return *std::min_element(times.begin(), times.end()); }

void take_turns(std::vector<Contender>& contenders, int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (Contender& contender : contenders) contender.times.push_back(contender.run());
}

Ratio times_faster(const Contender& a, const Contender& b) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < a.times.size(); ++i) ratios.push_back(b.times[i] / a.times[i]);
  return {median(ratios), b.least() / a.least()};
}

}  // namespace hooke::bench
