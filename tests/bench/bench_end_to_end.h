// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/bench/bench.h"

namespace zerodrift::bench {

// `zerodrift_bench end-to-end`, and the hidden command its publisher is.
void add_bench_end_to_end(CLI::App& bench, Run& run);

}  // namespace zerodrift::bench
