// SPDX-License-Identifier: Apache-2.0
// A gyro and its thermometer with a hardware clock, so that nobody waits for anybody; until a stop
// signal. The same values in every run.
#include <chrono>

#include "common/service/host.h"
#include "common/service/main.h"
#include "tests/bench/synthetic_gyro.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Publishes a synthetic gyro in real time.", "host_gyro");
  zerodrift::dds::NetworkOptions network;
  bench::SyntheticGyroOptions options;
  service::add_network_options(app, network);
  app.add_option("--rate", options.rate_hz, "samples a second");
  app.add_option("--sensor-speed", options.sensor_speed, "sensor time over the host's");
  return service::run_main(app, argc, argv, [&] {
    zerodrift::dds::Participant participant("gyro_publisher", network);
    const bench::SyntheticGyro gyro(participant, options);
    while (!service::wait_for_stop(std::chrono::seconds(1))) {
    }
    return service::kExitDone;
  });
}
