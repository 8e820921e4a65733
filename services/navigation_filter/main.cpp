// SPDX-License-Identifier: Apache-2.0
// Attitude from raw beside compensated rates: compensated_rate [+ rate_reference] -> navigation,
// rate_reference.
#include "common/service/main.h"

#include "common/navigation/arguments.h"
#include "common/service/time_option.h"
#include "services/navigation_filter/navigation_filter_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Navigates by gyros, raw beside compensated, and tells the compensation about rest.",
               "navigation_filter");
  services::NavigationFilterOptions options;
  navigation::NavigationArguments arguments;
  service::add_network_options(app, options.network);
  service::add_supervision_options(app, options.supervision);
  service::show_default_in(
      "s", navigation::add_arguments(app, arguments)->transform(service::in_seconds()));
  service::show_default_in(
      "s", app.add_option("--period", options.period_s, "time between two states published")
               ->transform(service::in_seconds())
               ->check(CLI::Range(0.05, 3600.0)));
  app.add_option("--max-gyros", options.max_gyros, "gyros navigated by at most")
      ->check(CLI::Range(1, 128))
      ->capture_default_str();
  app.add_flag("!--no-references", options.gives_references,
               "give no rate_reference back to the compensation");
  return service::run_main(app, argc, argv, [&] {
    options.navigation = arguments.complete();
    return services::NavigationFilterNode(options).run();
  });
}
