// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/bench/bench.h"

namespace zerodrift::bench {

inline constexpr std::uint32_t kBenchDomain = 231;  // away from anything that runs

// `zerodrift_bench latency`, and the hidden commands its own processes are.
void add_bench_latency(CLI::App& bench, Run& run);

}  // namespace zerodrift::bench
