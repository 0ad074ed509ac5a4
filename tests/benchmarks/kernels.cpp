// Single kernels under Google Benchmark: what a step is made of. Its options are its own, see --help.
// Arguments of a benchmark: N, then 1 for a mesh without rows.
#include "sheet.hpp"

#include <hooke/softbody/spring_field.hpp>

#include <benchmark/benchmark.h>

namespace hooke::bench {
namespace {

using softbody::SpringField;
using softbody::WindField;

template <class S>
struct Loaded {
  SoftBodySettings settings;
  PointMasses<S> points;
  SpringField<S> springs;
  double count;

  Loaded(int n, bool mesh)
      : settings(hanging_sheet(n, mesh ? Form::Mesh : Form::Grid)),
        springs(settings.network, settings.positions.cast<S>()),
        count(double(settings.network->springs.size())) {
    points.position = settings.positions.cast<S>();
    points.velocity = Points<S>::Zero(points.position.rows(), 3);
    points.mass = settings.masses.cast<S>();
    points.inverse_mass = points.mass.inverse();
    for (const Index pin : settings.pins) points.inverse_mass[pin] = 0;
  }
};

// Tells the seconds of one of `each` things.
void per(benchmark::State& state, const char* thing, double each) {
  using benchmark::Counter;
  state.counters["seconds_each"] = Counter(each, Counter::kIsIterationInvariantRate | Counter::kInvert);
  state.SetLabel(thing);
}

// Forces and steps in one pass, 48 steps of velocity Verlet a call.
template <class S>
void fused_steps(benchmark::State& state) {
  Loaded<S> sheet(int(state.range(0)), state.range(1) != 0);
  const std::unique_ptr<Stepper<S>> stepper = sheet.springs.stepper();
  if (!stepper) {
    state.SkipWithError("this build has no fused kernels");
    return;
  }
  constexpr int kSteps = 48;
  const double h = 0.8 * yardstick_step(int(state.range(0)));
  std::vector<Stage> stages(kSteps, Stage{h, h});
  stages.front().kick = h / 2;
  stages.push_back({h / 2, 0});
  stepper->load(sheet.points, {}, {0, -9.81, 0}, nullptr);
  for (auto _ : state) stepper->run(stages, nullptr);
  per(state, "spring and step", sheet.count * kSteps);
}

// What a tick pays besides: the way into the stepper's layout and back.
template <class S>
void load_and_store(benchmark::State& state) {
  Loaded<S> sheet(int(state.range(0)), state.range(1) != 0);
  const std::unique_ptr<Stepper<S>> stepper = sheet.springs.stepper();
  if (!stepper) {
    state.SkipWithError("this build has no fused kernels");
    return;
  }
  LowParts<S> low;
  for (auto _ : state) {
    stepper->load(sheet.points, {}, {0, -9.81, 0}, nullptr);
    stepper->store(sheet.points, low);
  }
  per(state, "spring", sheet.count);
}

// Forces alone: what every method can use.
template <class S>
void spring_forces(benchmark::State& state) {
  Loaded<S> sheet(int(state.range(0)), state.range(1) != 0);
  Points<S> force = Points<S>::Zero(sheet.points.size(), 3);
  for (auto _ : state) {
    sheet.springs.add_force(sheet.points.position, sheet.points.velocity, 0, force);
    benchmark::ClobberMemory();
  }
  per(state, "spring", sheet.count);
}

// The bounds behind the automatic step, thirty times a simulated second.
template <class S>
void rate_bounds(benchmark::State& state) {
  Loaded<S> sheet(int(state.range(0)), state.range(1) != 0);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        sheet.springs.rate_bounds(sheet.points.position, sheet.points.velocity, sheet.points.inverse_mass));
  per(state, "spring", sheet.count);
}

template <class S>
void wind_forces(benchmark::State& state) {
  Loaded<S> sheet(int(state.range(0)), state.range(1) != 0);
  softbody::Wind air;
  air.velocity = {0, 0, -2};
  const WindField<S> wind(air, sheet.settings.triangles, sheet.points.size());
  Points<S> force = Points<S>::Zero(sheet.points.size(), 3);
  for (auto _ : state) {
    wind.add_force(sheet.points.position, sheet.points.velocity, 0, force);
    benchmark::ClobberMemory();
  }
  per(state, "triangle", double(sheet.settings.triangles.size()));
}

#define HOOKE_BENCH(kernel)                                                                        \
  BENCHMARK_TEMPLATE(kernel, float)->Args({64, 0})->Args({64, 1})->Args({256, 0})->Args({256, 1}); \
  BENCHMARK_TEMPLATE(kernel, double)->Args({64, 0})->Args({64, 1})->Args({256, 0})->Args({256, 1})
HOOKE_BENCH(fused_steps);
HOOKE_BENCH(load_and_store);
HOOKE_BENCH(spring_forces);
HOOKE_BENCH(rate_bounds);
HOOKE_BENCH(wind_forces);

}  // namespace
}  // namespace hooke::bench

BENCHMARK_MAIN();
