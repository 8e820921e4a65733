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
  CLI::App app(
      "Zero-drift compensation of gyros: simulate, compensate, compare, diagnose, record, control.",
      "zerodrift");
  app.require_subcommand(1);
  services::Run run;
  services::add_simulate(app, run);
  services::add_compensate(app, run);
  services::add_compare(app, run);
  services::add_navigate(app, run);
  services::add_allan(app, run);
  services::add_diagnose(app, run);
  services::add_calibrate(app, run);
  services::add_record(app, run);
  services::add_replay(app, run);
  services::add_info(app, run);
  services::add_export(app, run);
  services::add_control(app, run);
  services::add_config(app, run);
  services::add_health(app, run);
  services::list_programs(app);
  const int exit_code = service::run_main(app, argc, argv, [&] { return run(); });
  return services::end_of_output(exit_code);
} catch (const std::exception& error) {  // no such program, or no memory for the options
  std::fprintf(stderr, "zerodrift: %s\n", error.what());
  return zerodrift::service::kExitBadInput;
}
