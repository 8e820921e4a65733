// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/latency_table.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::bench {
namespace {

LatencyCell cell(double p50_us, std::uint64_t lost = 0) {
  LatencyCell result{.latencies_us = std::vector<double>(1000, p50_us), .sent = 1000 + lost};
  result.lost = lost;
  return result;
}

// Row 0 is the floor, row 1 best effort, row 2 the chain.
struct Measured {
  LatencyPlan plan{.rows = {{"udp", "raw UDP"}, {"best-effort", "hop"}, {"chain", "chain"}},
                   .rates_hz = {1000.0},
                   .loads = {Load::kNone},
                   .directions = {Direction::kOneWay}};
  LatencyCells cells;
  explicit Measured(double chain_us, std::uint64_t lost = 0) {
    const auto key = [](std::size_t row) {
      return CellKey{Load::kNone, 1000.0, row, Direction::kOneWay};
    };
    cells[key(0)] = cell(25.0);
    cells[key(1)] = cell(50.0);
    cells[key(2)] = cell(chain_us, lost);
  }
  [[nodiscard]] ChainVerdict verdict() const { return judge_chain(plan, 2, 1, cells); }
};

TEST(LatencyFigures, ArePercentilesByRankAndNothingWhereTooFewSamplesTell) {
  LatencyCell some;
  for (int i = 1; i <= 200; ++i) some.latencies_us.push_back(201.0 - i);
  const LatencyFigures figures = figures_of(some);
  EXPECT_EQ(figures.p50_us, 100.0);
  EXPECT_EQ(figures.p99_us, 198.0);
  EXPECT_TRUE(std::isnan(figures.p999_us)) << "0.2 samples lie beyond it";
  EXPECT_EQ(figures.max_us, 200.0);
  EXPECT_TRUE(std::isnan(figures_of({}).p50_us));
}

TEST(LatencyTable, RatiosAreToTheRowsOfTheSameBlock) {
  const Measured measured(100.0);
  const auto json = latency_json(measured.plan, {.floor = 0, .best_effort = 1}, measured.cells);
  const auto& chain = json.at("rows").at(2);
  EXPECT_EQ(chain.at("row"), "chain");
  EXPECT_EQ(chain.at("p50_over_floor"), 4.0);
  EXPECT_EQ(chain.at("p99_over_best_effort"), 2.0);
  EXPECT_NE(latency_table(measured.plan, {.floor = 0, .best_effort = 1}, measured.cells)
                .find("  4.00   4.00|   2.00   2.00|     0     0"),
            std::string::npos);
}

TEST(ChainGoals, AreMissedByASlowChainAndByALostSample) {
  EXPECT_TRUE(Measured(2.2 * 50.0).verdict().met);
  EXPECT_FALSE(Measured(2.21 * 50.0).verdict().met);
  EXPECT_FALSE(Measured(100.0, 1).verdict().met);
}

TEST(ChainGoals, AreMissedWhereNothingWasMeasured) {
  Measured measured(100.0);
  measured.cells.clear();
  EXPECT_FALSE(measured.verdict().met);
}

}  // namespace
}  // namespace zerodrift::bench
