// SPDX-License-Identifier: Apache-2.0
#include "common/service/main.h"

#include <cstdio>
#include <exception>

#include "services/zerodrift/commands.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/programs.h"

int main(int argc, char** argv) try {
  using namespace zerodrift;
  const auto* program = argc > 1 ? services::find_program(argv[1]) : nullptr;
  if (program != nullptr) services::become(*program, argv + 1);
  CLI::App app("Zero-drift compensation of gyros: from simulation to control.", "zerodrift");
  app.require_subcommand(1);
  services::Run run;
  const auto made_by = services::invocation_of(service::version_line(), argc, argv);
  services::add_commands(app, run, made_by);
  services::list_programs(app);
  return services::end_of_output(service::run_main(app, argc, argv, [&] { return run(); }));
} catch (const std::exception& error) {  // no such program, or no memory for the options
  const auto [reason, exit_code] = zerodrift::service::refusal_of(error);
  std::fprintf(stderr, "zerodrift: %.*s\n", static_cast<int>(reason.size()), reason.data());
  return exit_code;
}
