// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "services/zerodrift/commands.h"

namespace zerodrift::services {

inline constexpr std::uint32_t kBenchDomain = 231;  // away from anything that runs

// `zerodrift bench latency`, and the hidden commands its own processes are.
void add_bench_latency(CLI::App& bench, Run& run);

}  // namespace zerodrift::services
