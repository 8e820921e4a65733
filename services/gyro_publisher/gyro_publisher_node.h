// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/drivers/driver_error.h"
#include "common/drivers/serial_gyro.h"
#include "common/service/host.h"
#include "common/service/replay_clock.h"
#include "common/service/replay_pacer.h"
#include "services/gyro_publisher/gyro_source.h"

namespace zerodrift::services {

struct GyroPublisherOptions {
  dds::NetworkOptions network;
  std::uint32_t gyro_id = 1;
  GyroSourceOptions source;
  std::string speed = "1";
  std::vector<std::string> wait_for{"compensation"};
  drivers::SerialGyroOptions serial;
};

void add_options(CLI::App& app, GyroPublisherOptions& options);

// Publishes until the source ends or a stop signal comes.
class GyroPublisherNode {
 public:
  explicit GyroPublisherNode(const GyroPublisherOptions& options);
  // Exit code: the source may turn out bad on the way.
  int run();

 private:
  void publish_source();
  void publish_serial();
  void publish(const core::AngularRateSample& sample);
  void publish(const core::RateReferenceSample& reference);
  bool wait_for_consumers();
  bool wait_for_room(std::uint64_t sequence);
  void finish();
  void tell_of_link(const drivers::KvhLinkStatistics& now);
  service::Status status() const;

  GyroPublisherOptions options_;
  service::Host host_;
  service::ReplayPacer pacer_;
  service::ReplayClock clock_;
  dds::Writer<msg::AngularRate> writer_;
  dds::Writer<msg::RateReference> reference_writer_;
  dds::Writer<msg::Temperature> temperature_writer_;  // a serial gyro's own thermometer
  GyroSource source_;
  std::optional<drivers::SerialGyro> serial_;
  drivers::KvhLinkStatistics told_link_{};

  std::atomic<bool> stopping_{false};
  std::atomic<bool> finished_{false};
  std::atomic<bool> failed_{false};
  std::atomic<std::uint64_t> published_{0};
  std::atomic<std::uint64_t> refused_{0};
  std::uint64_t first_sequence_ = 0;
  std::uint64_t newest_sequence_ = 0;
};

}  // namespace zerodrift::services
