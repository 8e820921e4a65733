// SPDX-License-Identifier: Apache-2.0
// Takes the drift off: angular_rate + temperature [+ rate_reference] -> compensated_rate.
#include "common/service/main.h"

#include "common/service/large_blocks.h"
#include "common/service/realtime.h"
#include "services/compensation/options.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app(
      "Compensates the zero drift of gyros, by experts for each axis, an online SVR among them.",
      "compensation");
  services::CompensationArguments arguments;
  service::RealtimeOptions realtime;
  service::add_network_options(app, arguments.node.network);
  service::add_supervision_options(app, arguments.node.supervision);
  service::add_realtime_options(app, realtime);
  services::add_options(app, arguments);
  return service::run_main(app, argc, argv, [&] {
    const auto options = arguments.complete();
    service::apply(realtime);
    service::return_large_blocks();
    return services::CompensationNode(options).run();
  });
}
