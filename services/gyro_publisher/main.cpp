// SPDX-License-Identifier: Apache-2.0
// Publishes angular_rate from the twin, a record, or a gyro on a serial port.
#include "common/service/publisher_main.h"
#include "services/gyro_publisher/gyro_publisher_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift::services;
  return zerodrift::service::run_publisher<GyroPublisherNode, GyroPublisherOptions>(
      "Publishes a gyro's angular rates.", "gyro_publisher", argc, argv);
}
