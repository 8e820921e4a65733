// SPDX-License-Identifier: Apache-2.0
// Publishes temperature from the twin, a record, or the thermometers that Linux shows as files.
#include "common/service/publisher_main.h"
#include "services/thermal_publisher/thermal_publisher_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift::services;
  return zerodrift::service::run_publisher<ThermalPublisherNode, ThermalPublisherOptions>(
      "Publishes the temperatures of a gyro.", "thermal_publisher", argc, argv);
}
