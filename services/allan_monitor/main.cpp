// SPDX-License-Identifier: Apache-2.0
// Rolling Allan statistics of raw and compensated rates: compensated_rate -> allan_report.
#include "common/service/main.h"

#include "common/service/time_option.h"
#include "services/allan_monitor/allan_monitor_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Watches the noise of gyros, raw beside compensated.", "allan_monitor");
  services::AllanMonitorOptions options;
  service::add_network_options(app, options.network);
  service::add_supervision_options(app, options.supervision);
  service::show_default_in("s", app.add_option("--window", options.window_s, "rolling window")
                                    ->transform(service::in_seconds_above_0()));
  service::show_default_in(
      "s", app.add_option("--longest-tau", options.longest_tau_s, "longest cluster time")
               ->transform(service::in_seconds_above_0()));
  service::show_default_in("s",
                           app.add_option("--period", options.period_s, "time between two reports")
                               ->transform(service::in_seconds_above_0()));
  app.add_option("--max-gyros", options.max_gyros, "gyros watched at most")
      ->check(CLI::Range(1, 128))
      ->capture_default_str();
  return service::run_main(app, argc, argv,
                           [&] { return services::AllanMonitorNode(options).run(); });
}
