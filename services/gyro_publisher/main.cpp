// SPDX-License-Identifier: Apache-2.0
// Publishes angular_rate from the twin, a record, or a gyro on a serial port.
#include "common/service/main.h"

#include "services/gyro_publisher/gyro_publisher_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Publishes a gyro's angular rates.", "gyro_publisher");
  services::GyroPublisherOptions options;
  service::add_network_options(app, options.network);
  services::add_options(app, options);
  return service::run_main(app, argc, argv,
                           [&] { return services::GyroPublisherNode(options).run(); });
}
