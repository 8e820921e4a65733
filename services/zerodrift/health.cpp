// SPDX-License-Identifier: Apache-2.0
// Whether a service is well, by the file it writes: for health checks of containers.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/supervision.h"
#include "common/service/time_option.h"
#include "services/zerodrift/commands.h"

namespace zerodrift::services {
namespace {

struct HealthOptions {
  std::filesystem::path file;
  double at_most_s = 3.0;
  bool alive_is_enough = false;
};

int check(const HealthOptions& options) {
  try {
    service::Health health = service::read_health(options.file);
    if (options.alive_is_enough && health.state == "degraded") health.state = "running";
    const std::string reason = service::why_unhealthy(
        health, service::monotonic_ns(), std::chrono::duration<double>(options.at_most_s));
    if (reason.empty()) {
      std::printf("%s (pid %lld) is %s: %s\n", health.service.c_str(),
                  static_cast<long long>(health.process_id), health.state.c_str(),
                  health.summary.c_str());
      return service::kExitDone;
    }
    std::fprintf(stderr, "health: %s\n", reason.c_str());
  } catch (const std::runtime_error& error) {
    std::fprintf(stderr, "health: %s\n", error.what());
  }
  return service::kExitNo;
}

}  // namespace

void add_health(CLI::App& app, Run& run) {
  auto options = std::make_shared<HealthOptions>();
  CLI::App* command =
      app.add_subcommand("health", "Says whether a service of this machine is well");
  command->add_option("--file", options->file, "what the service was given as --health-file")
      ->envname("ZERODRIFT_HEALTH_FILE")
      ->required();
  service::show_default_in(
      "s", command->add_option("--max-age", options->at_most_s, "older means that it hangs")
               ->transform(service::in_seconds_above_0()));
  command->add_flag("--alive", options->alive_is_enough,
                    "degraded is well: to start it again would not help");
  command->callback([options, &run] { run = [options] { return check(*options); }; });
}

}  // namespace zerodrift::services
