// SPDX-License-Identifier: Apache-2.0
// Latency of the online SVR on two synthetic drifts of 15 000 points: a ramp and a heat/cool cycle.
// RBF kernel, gamma 3, C 10, epsilon 0.02. One call of add() on a full window learns one sample and
// forgets one. The counters are the mean, median, 99th percentile and maximum of the single calls,
// in microseconds.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/regression/online_svr.h"
#include "common/regression/svr_predictor.h"

namespace zerodrift::regression {
namespace {

constexpr std::size_t kPoints = 15000;

struct Sample {
  std::array<double, 2> x;  // temperature and temperature rate, scaled to about [-1, 1]
  double y;                 // drift, scaled to about 1
};

double drift(double temperature, double rate) {
  return 0.5 * temperature + 0.3 * std::sin(2.5 * temperature) + 0.25 * rate;
}

// ramp: from one soak temperature towards another with a time constant of a third of the record.
// cycle: three heat/cool cycles. White noise of one epsilon on the drift: a third of the samples
// lies outside.
std::vector<Sample> synthetic_drift(bool is_cycle) {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(kPoints);
    const double phase = 6.0 * std::numbers::pi * t;
    const double temperature = is_cycle ? std::sin(phase) : 1.0 - 2.0 * std::exp(-3.0 * t);
    const double rate = is_cycle ? std::cos(phase) : std::exp(-3.0 * t);
    samples.push_back({{temperature, rate}, drift(temperature, rate) + noise(engine)});
  }
  return samples;
}

OnlineSvrOptions options(std::size_t capacity) {
  OnlineSvrOptions options;
  options.capacity = capacity;
  options.recent_capacity = capacity / 2;
  options.kernel.gamma = 3.0;
  options.epsilon = 0.02;
  options.box_constraint = 10.0;
  return options;
}

void report(benchmark::State& state, std::vector<double>& microseconds) {
  std::sort(microseconds.begin(), microseconds.end());
  const auto quantile = [&](double q) {
    return microseconds[static_cast<std::size_t>(q * static_cast<double>(microseconds.size() - 1))];
  };
  double total = 0.0;
  for (const double us : microseconds) total += us;
  state.counters["mean_us"] = total / static_cast<double>(microseconds.size());
  state.counters["median_us"] = quantile(0.5);
  state.counters["p99_us"] = quantile(0.99);
  state.counters["max_us"] = quantile(1.0);
}

template <typename Call>
double time_us(Call&& call) {
  const auto begin = std::chrono::steady_clock::now();
  call();
  const auto end = std::chrono::steady_clock::now();
  return std::chrono::duration<double, std::micro>(end - begin).count();
}

// Arguments: capacity; 0 ramp, 1 cycle; 0 FIFO, 1 two tiers.
void LearnAndForget(benchmark::State& state) {
  const auto capacity = static_cast<std::size_t>(state.range(0));
  const auto samples = synthetic_drift(state.range(1) != 0);
  OnlineSvrOptions svr_options = options(capacity);
  svr_options.window = state.range(2) != 0 ? WindowPolicy::kTwoTier : WindowPolicy::kFifo;
  std::vector<double> microseconds;
  double events = 0.0, margin = 0.0, support = 0.0;
  for (auto _ : state) {
    OnlineSvr svr(svr_options);
    for (std::size_t i = 0; i < kPoints; ++i) {
      UpdateReport result;
      const double us = time_us([&] { result = svr.add(samples[i].x, samples[i].y); });
      if (i < capacity) continue;
      microseconds.push_back(us);
      events += static_cast<double>(result.events);
      const SetCounts counts = svr.set_counts();
      margin += static_cast<double>(counts.margin);
      support += static_cast<double>(counts.margin + counts.error);
    }
  }
  const auto calls = static_cast<double>(microseconds.size());
  state.counters["events"] = events / calls;
  state.counters["margin"] = margin / calls;
  state.counters["support"] = support / calls;
  report(state, microseconds);
}

// Arguments: as above. Batches of 16 predictions a reading, so that the clock doesn't count.
void Predict(benchmark::State& state) {
  constexpr std::size_t kBatch = 16;
  const auto capacity = static_cast<std::size_t>(state.range(0));
  const auto samples = synthetic_drift(state.range(1) != 0);
  OnlineSvr svr(options(capacity));
  SvrPredictor predictor(2, capacity);
  std::vector<double> microseconds;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoints; ++i) {
      svr.add(samples[i].x, samples[i].y);
      if (i < capacity || i % kBatch != 0) continue;
      predictor.assign(svr);
      double total = 0.0;
      const double us = time_us([&] {
        for (std::size_t k = 0; k < kBatch; ++k) total += predictor.predict(samples[i - k].x);
      });
      benchmark::DoNotOptimize(total);
      microseconds.push_back(us / static_cast<double>(kBatch));
    }
  }
  state.counters["support"] = static_cast<double>(predictor.support_size());
  report(state, microseconds);
}

BENCHMARK(LearnAndForget)
    ->ArgsProduct({{200, 500, 1000, 2000}, {0, 1}, {0, 1}})
    ->ArgNames({"W", "cycle", "two_tier"})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(Predict)
    ->ArgsProduct({{200, 500, 1000, 2000}, {0, 1}})
    ->ArgNames({"W", "cycle"})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace zerodrift::regression

BENCHMARK_MAIN();
