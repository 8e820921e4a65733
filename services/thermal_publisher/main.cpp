// SPDX-License-Identifier: Apache-2.0
// Publishes temperatures and environment from the twin, a record, or what Linux shows as files.
#include "common/service/publisher_main.h"
#include "services/thermal_publisher/thermal_publisher_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift::services;
  return zerodrift::service::run_publisher<ThermalPublisherNode, ThermalPublisherOptions>(
      "Publishes the temperatures and the environment of a gyro.", "thermal_publisher", argc, argv);
}
