// No header of the library here: this file is compiled for one machine only.
#include "yardstick.hpp"

#include <report/plain_verlet.hpp>

#include <ctime>

namespace hooke::bench {

namespace {

double cpu() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

}  // namespace

template <class S>
YardstickRun run_yardstick(const PlainSheet& sheet, int steps, double duration) {
  using Verlet = report::PlainVerlet<S>;
  const std::size_t n = sheet.inverse_masses.size();
  std::vector<typename Verlet::Vec> x(n), v(n);
  std::vector<S> w(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 3; ++k) x[i][k] = S(sheet.positions[3 * i + k]);
    w[i] = S(sheet.inverse_masses[i]);
  }
  std::vector<typename Verlet::Spring> springs;
  springs.reserve(sheet.springs.size());
  for (const auto& s : sheet.springs) springs.push_back({s.a, s.b, S(s.stiffness), S(s.rest)});
  Verlet verlet(std::move(x), std::move(v), std::move(w), std::move(springs),
                {S(sheet.gravity[0]), S(sheet.gravity[1]), S(sheet.gravity[2])});
  YardstickRun out;
  __asm__ volatile("" : : "r"(&verlet) : "memory");  // nothing moves past the clock
  const double begin = cpu();
  verlet.run(steps, duration);
  __asm__ volatile("" : : "r"(&verlet) : "memory");
  out.seconds = cpu() - begin;
  for (const auto& p : verlet.positions())
    for (const S c : p) out.positions.push_back(double(c));
  return out;
}

template YardstickRun run_yardstick<float>(const PlainSheet&, int, double);
template YardstickRun run_yardstick<double>(const PlainSheet&, int, double);

void read_modify_write(float* const arrays[7], long first, long last) {
  // Numbers that the compiler does not know.
  volatile float one = 1, zero = 0;
  const float factor = one, add = zero;
  float* __restrict a = arrays[0], * __restrict b = arrays[1], * __restrict c = arrays[2], * __restrict d = arrays[3], * __restrict e = arrays[4], * __restrict f = arrays[5], * __restrict g = arrays[6];
#pragma GCC ivdep
  for (long i = first; i < last; ++i) {
    a[i] = a[i] * factor + add, b[i] = b[i] * factor + add, c[i] = c[i] * factor + add;
    d[i] = d[i] * factor + add, e[i] = e[i] * factor + add, f[i] = f[i] * factor + add;
    g[i] = g[i] * factor + add;
  }
}

std::string yardstick_flags() { return HOOKE_YARDSTICK_FLAGS; }

}  // namespace hooke::bench
