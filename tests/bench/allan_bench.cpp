// SPDX-License-Identifier: Apache-2.0
// Cost of the Allan statistics: time a sample, memory, time of a report. Figures, no verdict.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <random>
#include <vector>

#include "common/allan/coefficients.h"
#include "common/allan/deviations.h"
#include "common/allan/rolling_allan.h"

namespace zerodrift::allan {
namespace {

constexpr std::size_t kRecord = 5 * 3600 * 200;  // 5 h at 200 Hz

std::vector<double> white_rates(std::size_t count) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(7e-5, 4e-6);
  std::vector<double> rates(count);
  for (double& y : rates) y = noise(random);
  return rates;
}

RollingAllanOptions options(std::int64_t grid) {
  return {.grid = grid == 0 ? TauGrid::kOctave : TauGrid::kQuarterOctave, .longest_tau_s = 1e5};
}

// Arguments: 0 octave, 1 quarter octave.
void rolling_add(benchmark::State& state) {
  const auto rates = white_rates(kRecord);
  RollingAllan allan(options(state.range(0)));
  std::size_t i = 0;
  for (auto _ : state) {
    allan.add(rates[i]);
    i = i + 1 == kRecord ? 0 : i + 1;
  }
  state.counters["bytes"] = static_cast<double>(allan.memory_bytes());
  state.counters["taus"] = static_cast<double>(allan.tau_count());
}
BENCHMARK(rolling_add)->Arg(0)->Arg(1)->MinTime(1.0);

void rolling_points(benchmark::State& state) {
  RollingAllan allan(options(state.range(0)));
  for (const double y : white_rates(kRecord)) allan.add(y);
  for (auto _ : state) benchmark::DoNotOptimize(allan.points(Span::kRolling));
}
BENCHMARK(rolling_points)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void coefficients(benchmark::State& state) {
  RollingAllan allan(options(state.range(0)));
  for (const double y : white_rates(kRecord)) allan.add(y);
  const auto points = allan.points(Span::kSinceStart);
  for (auto _ : state) benchmark::DoNotOptimize(fit_coefficients(points));
}
BENCHMARK(coefficients)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void batch_overlapping(benchmark::State& state) {
  const auto angle = angle_from_rate(white_rates(kRecord), 0.005);
  for (auto _ : state) benchmark::DoNotOptimize(overlapping_allan(angle, 0.005, TauGrid::kOctave));
}
BENCHMARK(batch_overlapping)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace zerodrift::allan

BENCHMARK_MAIN();
