// SPDX-License-Identifier: Apache-2.0
// Publishes temperature from the twin, a record, or the thermometers that Linux shows as files.
#include "common/service/main.h"

#include "common/service/realtime.h"
#include "services/thermal_publisher/thermal_publisher_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Publishes the temperatures of a gyro.", "thermal_publisher");
  services::ThermalPublisherOptions options;
  service::RealtimeOptions realtime;
  service::add_network_options(app, options.network);
  service::add_supervision_options(app, options.supervision);
  service::add_realtime_options(app, realtime);
  services::add_options(app, options);
  return service::run_main(app, argc, argv, [&] {
    service::apply(realtime);
    return services::ThermalPublisherNode(options).run();
  });
}
