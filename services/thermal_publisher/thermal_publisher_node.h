// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "common/drivers/sysfs_thermometer.h"
#include "common/replay/temperature_replay.h"
#include "common/service/host.h"
#include "services/thermal_publisher/thermal_source.h"

namespace zerodrift::services {

struct ThermalPublisherOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  ThermalSourceKind kind = ThermalSourceKind::kSimulation;
  replay::PublisherOptions publisher{};
  std::string sysfs_root = "/sys";
  std::vector<std::string> sysfs_probes;  // name=path; empty: all that are found
  double sysfs_rate_hz = 1.0;
};

void add_options(CLI::App& app, ThermalPublisherOptions& options);

// Publishes until the source ends or a stop signal comes.
class ThermalPublisherNode {
 public:
  explicit ThermalPublisherNode(const ThermalPublisherOptions& options);
  // Exit code: the source may turn out bad on the way.
  int run();

 private:
  void open_sysfs();
  void publish_sysfs();
  service::Status status() const;

  ThermalPublisherOptions options_;
  service::Host host_;
  std::uint32_t gyro_id_;
  replay::TemperatureReplay temperatures_;
  ThermalSource source_;
  std::vector<drivers::SysfsThermometer> thermometers_;

  std::atomic<bool> stopping_{false};
};

}  // namespace zerodrift::services
