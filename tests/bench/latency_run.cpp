// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/latency_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>

#include "common/service/host.h"

namespace zerodrift::bench {
namespace {

using namespace std::chrono_literals;

constexpr double kLongestTurn_s = 0.5;

double share_of(Direction direction) {
  return direction == Direction::kOneWay ? 1.0 : 0.5;
}

// One load and direction: all rows alive at once.
class Round {
 public:
  Round(const LatencyPlan& plan, Load load, Direction direction)
      : plan_(plan), load_(load), direction_(direction) {
    for (const RowOptions& row : plan.rows) {
      rows_.push_back(std::make_unique<LatencyRow>(row, direction, plan.setting));
    }
    order_.resize(rows_.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    for (auto& row : rows_) row->connect();
    for (auto& row : rows_) {
      if (plan.lose_permille > 0) row->lose_datagrams(plan.lose_permille);
    }
    if (load == Load::kHog) {
      hog_ = std::make_unique<BenchProcess>("zerodrift_bench", std::vector<std::string>{"busy"},
                                            BenchProcess::Streams::kTalks);
    }
  }

  // One turn of every row at every rate. False: a stop signal came.
  bool turn(double duration_s, LatencyCells& cells, const std::function<void()>& done) {
    for (const double rate_hz : plan_.rates_hz) {
      std::shuffle(order_.begin(), order_.end(), random_);
      for (const std::size_t row : order_) {
        if (service::wait_for_stop(0ms)) return false;
        rows_[row]->measure(rate_hz, duration_s, cells[{load_, rate_hz, row, direction_}]);
        done();
      }
    }
    return true;
  }

 private:
  const LatencyPlan& plan_;
  Load load_;
  Direction direction_;
  std::vector<std::unique_ptr<LatencyRow>> rows_;
  std::vector<std::size_t> order_;  // another in each turn: a row also feels who was there before
  std::mt19937 random_{1};
  std::unique_ptr<BenchProcess> hog_;
};

std::size_t turns_of(const LatencyPlan& plan, Direction direction) {
  return static_cast<std::size_t>(
      std::ceil(plan.duration_s * share_of(direction) / kLongestTurn_s));
}

// An upper bound of what one process sends: all turns, their warm-up, and the first samples.
std::size_t capacity_for(const LatencyPlan& plan) {
  double samples = 0.0;
  for (const double rate_hz : plan.rates_hz) samples += rate_hz * plan.duration_s + 100.0;
  const double turns = std::ceil(plan.duration_s / kLongestTurn_s);
  constexpr double kToConnect = 2000.0;
  return static_cast<std::size_t>(
      samples + 100.0 * turns * static_cast<double>(plan.rates_hz.size()) + kToConnect);
}

// Rank by rounding up, as in bench svr; NaN with fewer than two samples beyond it.
double percentile(const std::vector<double>& sorted, double share) {
  const auto count = static_cast<double>(sorted.size());
  constexpr double kFewestBeyond = 2.0 - 1e-9;  // 0.01 * 200 is a little less than 2
  if (count * (1.0 - share) < kFewestBeyond) return std::numeric_limits<double>::quiet_NaN();
  return sorted[static_cast<std::size_t>(std::max(1.0, std::ceil(share * count))) - 1];
}

}  // namespace

LatencyCells measure_latencies(LatencyPlan plan, const std::function<void(double)>& progress) {
  plan.setting.capacity = capacity_for(plan);
  std::size_t all = 0;
  for (const Direction direction : plan.directions) all += turns_of(plan, direction);
  all *= plan.loads.size() * plan.rates_hz.size() * plan.rows.size();
  std::size_t done = 0;
  LatencyCells cells;
  for (const Load load : plan.loads) {
    for (const Direction direction : plan.directions) {
      Round round(plan, load, direction);
      const std::size_t turns = turns_of(plan, direction);
      for (std::size_t i = 0; i < turns; ++i) {
        const bool goes_on =
            round.turn(plan.duration_s * share_of(direction) / static_cast<double>(turns), cells,
                       [&] { progress(static_cast<double>(++done) / static_cast<double>(all)); });
        if (!goes_on) return cells;
      }
    }
  }
  return cells;
}

LatencyFigures figures_of(const LatencyCell& cell) {
  std::vector<double> sorted = cell.latencies_us;
  std::sort(sorted.begin(), sorted.end());
  return {.p50_us = percentile(sorted, 0.5),
          .p99_us = percentile(sorted, 0.99),
          .p999_us = percentile(sorted, 0.999),
          .max_us = sorted.empty() ? std::numeric_limits<double>::quiet_NaN() : sorted.back()};
}

}  // namespace zerodrift::bench
