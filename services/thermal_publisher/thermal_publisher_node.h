// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/drivers/sysfs_thermometer.h"
#include "common/service/host.h"
#include "common/service/replay_clock.h"
#include "common/service/replay_pacer.h"
#include "services/thermal_publisher/thermal_source.h"

namespace zerodrift::services {

struct ThermalPublisherOptions {
  dds::NetworkOptions network;
  std::uint32_t gyro_id = 1;
  ThermalSourceOptions source;
  std::string speed = "1";
  std::vector<std::string> wait_for{"compensation"};
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
  struct Probe {
    std::unique_ptr<dds::Writer<msg::Temperature>> writer;
    std::uint64_t next_sequence = 0;
    std::uint64_t in_flight = 0;  // since all was last received
  };

  Probe& probe(const std::string& name);
  void open_sysfs();
  void publish_source();
  void publish_sysfs();
  void publish(const core::TemperatureSample& sample);
  bool wait_until_needed(core::SensorTime time);
  void mark_the_end(core::SensorTime newest);
  void wait_for_receipts();
  service::Status status() const;

  ThermalPublisherOptions options_;
  service::Host host_;
  service::ReplayPacer pacer_;
  service::ReplayClock clock_;
  ThermalSource source_;
  std::vector<drivers::SysfsThermometer> thermometers_;

  std::map<std::string, Probe> probes_;

  std::atomic<bool> stopping_{false};
  std::atomic<bool> failed_{false};
  std::atomic<std::uint64_t> published_{0};
};

}  // namespace zerodrift::services
