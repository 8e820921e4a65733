// SPDX-License-Identifier: Apache-2.0
// What `zerodrift_bench latency` measured, as text and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tests/bench/latency_run.h"

namespace zerodrift::bench {

// The rows that others are compared with, as indices of the plan's rows.
struct LatencyReferences {
  std::size_t floor = 0;
  std::size_t best_effort = 0;
};

// A block for each load and rate, with ratios of the same block.
std::string latency_table(const LatencyPlan& plan, const LatencyReferences& references,
                          const LatencyCells& cells);
nlohmann::ordered_json latency_json(const LatencyPlan& plan, const LatencyReferences& references,
                                    const LatencyCells& cells);

// The chain's bars (two hops): p50 and p99 one way over those of one best-effort hop, at each rate
// on the idle machine. Text, and whether all are met.
struct ChainVerdict {
  std::string text;
  bool met = false;
};
ChainVerdict judge_chain(const LatencyPlan& plan, std::size_t chain, std::size_t best_effort,
                         const LatencyCells& cells);

}  // namespace zerodrift::bench
