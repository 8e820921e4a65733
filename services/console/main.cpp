// SPDX-License-Identifier: Apache-2.0
// The console: live data, commands and metrics for browsers, Foxglove clients and Prometheus.
#include "common/service/main.h"

#include "services/console/console_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Serves the console's page, the Foxglove WebSocket protocol and Prometheus metrics.",
               "console");
  services::ConsoleOptions options;
  services::add_options(app, options);
  options.commit = service::commit();
  return service::run_main(app, argc, argv, [&] { return services::ConsoleNode(options).run(); });
}
