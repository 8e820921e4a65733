// SPDX-License-Identifier: Apache-2.0
// Latency of the online SVR on two synthetic drifts of 15 000 points: a ramp and a heat/cool cycle.
// RBF kernel, gamma 3, C 10, epsilon 0.02. One call of add() on a full window learns one sample and
// forgets one. The counters mean_us, median_us, p99_us and max_us are of the single calls; each
// call counts with its shortest time in five identical runs, because on a shared machine a longer
// one tells of other programs: the learner does the same to the bit in every run. worst_us is the
// longest of all single times, interruptions included.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <vector>

#include "common/regression/kernel.h"
#include "common/regression/online_svr.h"
#include "common/regression/svr_predictor.h"
#include "tests/bench/synthetic_drift.h"

namespace zerodrift::regression {
namespace {

using bench::DriftPoint;
using bench::DriftRecord;
using bench::synthetic_drift;

constexpr std::size_t kPoints = 15000;
constexpr int kRuns = 5;

OnlineSvrOptions options(std::size_t capacity) {
  OnlineSvrOptions options;
  options.dimension = bench::kDriftFeatures;
  options.capacity = capacity;
  options.recent_capacity = capacity / 2;
  options.kernel.gamma = 3.0;
  options.epsilon = 0.02;
  options.box_constraint = 10.0;
  return options;
}

std::vector<DriftPoint> record_of(const benchmark::State& state) {
  return synthetic_drift(state.range(1) != 0 ? DriftRecord::kCycle : DriftRecord::kRamp, kPoints);
}

// The shortest time of each call over all runs, and the longest of all.
class CallTimes {
 public:
  explicit CallTimes(std::size_t calls) : shortest_us_(calls, kNever) {}

  void record(std::size_t call, double us) {
    shortest_us_[call] = std::min(shortest_us_[call], us);
    worst_us_ = std::max(worst_us_, us);
  }

  void report(benchmark::State& state) {
    std::sort(shortest_us_.begin(), shortest_us_.end());
    double total = 0.0;
    for (const double us : shortest_us_) total += us;
    state.counters["mean_us"] = total / static_cast<double>(shortest_us_.size());
    state.counters["median_us"] = quantile(0.5);
    state.counters["p99_us"] = quantile(0.99);
    state.counters["max_us"] = quantile(1.0);
    state.counters["worst_us"] = worst_us_;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  [[nodiscard]] double quantile(double q) const {
    return shortest_us_[static_cast<std::size_t>(q * static_cast<double>(shortest_us_.size() - 1))];
  }

  std::vector<double> shortest_us_;
  double worst_us_ = 0.0;
};

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
  const auto points = record_of(state);
  OnlineSvrOptions svr_options = options(capacity);
  svr_options.window = state.range(2) != 0 ? WindowPolicy::kTwoTier : WindowPolicy::kFifo;
  CallTimes times(kPoints - capacity);
  double events = 0.0, margin = 0.0, support = 0.0;
  for (auto _ : state) {
    OnlineSvr svr(svr_options);
    for (std::size_t i = 0; i < kPoints; ++i) {
      UpdateReport result;
      const double us = time_us([&] { result = svr.add(points[i].x, points[i].label); });
      if (i < capacity) continue;
      times.record(i - capacity, us);
      events += static_cast<double>(result.events);
      const SetCounts counts = svr.set_counts();
      margin += static_cast<double>(counts.margin);
      support += static_cast<double>(counts.margin + counts.error);
    }
  }
  const auto calls = static_cast<double>(kPoints - capacity) * kRuns;
  state.counters["events"] = events / calls;
  state.counters["margin"] = margin / calls;
  state.counters["support"] = support / calls;
  times.report(state);
}

// Arguments: as above. Batches of 16 predictions a reading, so that the clock doesn't count.
void Predict(benchmark::State& state) {
  constexpr std::size_t kBatch = 16;
  const auto capacity = static_cast<std::size_t>(state.range(0));
  const auto points = record_of(state);
  SvrPredictor predictor(bench::kDriftFeatures, capacity);
  const std::size_t first = (capacity + kBatch) / kBatch;
  CallTimes times(kPoints / kBatch - first);
  for (auto _ : state) {
    OnlineSvr svr(options(capacity));
    for (std::size_t i = 0; i < kPoints; ++i) {
      svr.add(points[i].x, points[i].label);
      const std::size_t batch = i / kBatch;
      if (i % kBatch != 0 || batch < first) continue;
      predictor.assign(svr);
      double total = 0.0;
      const double us = time_us([&] {
        for (std::size_t k = 0; k < kBatch; ++k) total += predictor.predict(points[i - k].x);
      });
      benchmark::DoNotOptimize(total);
      times.record(batch - first, us / static_cast<double>(kBatch));
    }
  }
  state.counters["support"] = static_cast<double>(predictor.support_size());
  times.report(state);
}

// One kernel row. Arguments: capacity; KernelKind.
void KernelRow(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0));
  Kernel kernel;
  kernel.kind = static_cast<KernelKind>(state.range(1));
  kernel.gamma = 3.0;
  const auto points = synthetic_drift(DriftRecord::kCycle, count);
  std::vector<double> columns(bench::kDriftFeatures * count), row(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t d = 0; d < bench::kDriftFeatures; ++d) {
      columns[d * count + i] = points[i].x[d];
    }
  }
  for (auto _ : state) {
    evaluate_row(kernel, {columns.data(), count, bench::kDriftFeatures, count}, points[0].x.data(),
                 row.data());
    benchmark::DoNotOptimize(row.data());
    benchmark::ClobberMemory();
  }
}

BENCHMARK(LearnAndForget)
    ->ArgsProduct({{200, 500, 1000, 2000}, {0, 1}, {0, 1}})
    ->ArgNames({"W", "cycle", "two_tier"})
    ->Iterations(kRuns)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(Predict)
    ->ArgsProduct({{200, 500, 1000, 2000}, {0, 1}})
    ->ArgNames({"W", "cycle"})
    ->Iterations(kRuns)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(KernelRow)
    ->ArgsProduct({{200, 500, 1000, 2000}, {0, 1, 2, 3, 4}})
    ->ArgNames({"W", "kind"})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace zerodrift::regression

BENCHMARK_MAIN();
