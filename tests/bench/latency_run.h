// SPDX-License-Identifier: Apache-2.0
// A whole measurement: rows, rates, loads and directions, the rows taking turns.
#pragma once

#include <compare>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/bench/latency_row.h"

namespace zerodrift::bench {

enum class Load : std::uint8_t { kNone, kHog };  // kHog: one more process that never rests

struct LatencyPlan {
  std::vector<RowOptions> rows;
  std::vector<double> rates_hz;
  std::vector<Load> loads;
  std::vector<Direction> directions;
  double duration_s = 1.0;     // of each row, rate and load, one way; a round trip gets half of it
  unsigned lose_permille = 0;  // datagrams lost at every socket
  BenchSetting setting{};
};

struct CellKey {
  Load load = Load::kNone;
  double rate_hz = 0.0;
  std::size_t row = 0;  // of the plan
  Direction direction = Direction::kOneWay;
  auto operator<=>(const CellKey&) const = default;
};

using LatencyCells = std::map<CellKey, LatencyCell>;

// `progress` gets 0 to 1. Returns early with what there is when a stop signal came. Throws
// std::runtime_error.
LatencyCells measure_latencies(LatencyPlan plan, const std::function<void(double)>& progress);

// Percentiles of a cell, us; NaN where too few samples tell them (fewer than two beyond).
struct LatencyFigures {
  double p50_us, p99_us, p999_us, max_us;
};
LatencyFigures figures_of(const LatencyCell& cell);

}  // namespace zerodrift::bench
