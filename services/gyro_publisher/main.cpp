// SPDX-License-Identifier: Apache-2.0
// Publishes angular_rate from the twin, a record, or a gyro on a serial port.
#include "common/service/main.h"

#include "common/service/realtime.h"
#include "services/gyro_publisher/gyro_publisher_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Publishes a gyro's angular rates.", "gyro_publisher");
  services::GyroPublisherOptions options;
  service::RealtimeOptions realtime;
  service::add_network_options(app, options.network);
  service::add_supervision_options(app, options.supervision);
  service::add_realtime_options(app, realtime);
  services::add_options(app, options);
  return service::run_main(app, argc, argv, [&] {
    service::apply(realtime);
    return services::GyroPublisherNode(options).run();
  });
}
