// SPDX-License-Identifier: Apache-2.0
// zerodrift_bench: what is measured, each in files of its own.
#include "common/service/main.h"

#include <cstdio>
#include <exception>

#include "services/zerodrift/ending.h"
#include "tests/bench/bench.h"

int main(int argc, char** argv) try {
  using namespace zerodrift;
  CLI::App app("Measures what zerodrift costs, and says whether its goals are met.",
               "zerodrift_bench");
  app.require_subcommand(1);
  bench::Run run;
  bench::add_bench_end_to_end(app, run);
  bench::add_bench_latency(app, run);
  bench::add_bench_svr(app, run);
  bench::add_bench_allan(app, run);
  bench::add_bench_fail_over(app, run);
  bench::add_bench_record(app, run);
  bench::add_bench_console(app, run);
  const int exit_code = service::run_main(app, argc, argv, [&] { return run(); });
  return services::end_of_output(exit_code);
} catch (const std::exception& error) {  // no memory for the options
  std::fprintf(stderr, "zerodrift_bench: %s\n", error.what());
  return zerodrift::service::kExitBadInput;
}
