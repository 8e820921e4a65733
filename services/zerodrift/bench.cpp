// SPDX-License-Identifier: Apache-2.0
// zerodrift bench: what is measured, each in files of its own.
#include "services/zerodrift/bench_end_to_end.h"
#include "services/zerodrift/bench_latency.h"
#include "services/zerodrift/commands.h"

namespace zerodrift::services {

void add_bench(CLI::App& app, Run& run) {
  auto* bench = app.add_subcommand("bench", "measure");
  bench->require_subcommand(1);
  add_bench_end_to_end(*bench, run);
  add_bench_latency(*bench, run);
  add_bench_svr(*bench, run);
  add_bench_allan(*bench, run);
  add_bench_fail_over(*bench, run);
  add_bench_record(*bench, run);
  add_bench_console(*bench, run);
  add_bench_fleet(*bench, run);
}

}  // namespace zerodrift::services
