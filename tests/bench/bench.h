// SPDX-License-Identifier: Apache-2.0
// The subcommands of `zerodrift_bench`. Each adds itself to the command line and sets `run` when it
// is chosen.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace zerodrift::bench {

using Run = std::function<int()>;

void add_bench_end_to_end(CLI::App& app, Run& run);
void add_bench_latency(CLI::App& app, Run& run);
void add_bench_svr(CLI::App& app, Run& run);
void add_bench_allan(CLI::App& app, Run& run);
void add_bench_fail_over(CLI::App& app, Run& run);
void add_bench_record(CLI::App& app, Run& run);
void add_bench_console(CLI::App& app, Run& run);

}  // namespace zerodrift::bench
