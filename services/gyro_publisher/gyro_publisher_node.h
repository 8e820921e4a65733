// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/drivers/driver_error.h"
#include "common/drivers/serial_gyro.h"
#include "common/replay/rate_replay.h"
#include "common/replay/ros2_source.h"
#include "common/service/command_server.h"
#include "common/service/host.h"
#include "common/twin/disturbance.h"
#include "services/gyro_publisher/gyro_source.h"

namespace zerodrift::services {

struct GyroPublisherOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  bool free_running = false;  // as a sensor: nobody is waited for
  GyroSourceOptions source;
  drivers::SerialGyroOptions serial;
  replay::RosOptions ros2{};
};

void add_options(CLI::App& app, GyroPublisherOptions& options);

// Publishes until the source ends or a stop signal comes.
class GyroPublisherNode {
 public:
  explicit GyroPublisherNode(const GyroPublisherOptions& options);
  // Exit code: the source may turn out bad on the way.
  int run();

 private:
  void publish_serial();
  void publish_ros2();
  service::CommandVerdict obey(const msg::Command& command);
  std::string inject(const std::string& argument);
  std::string replay(const std::string& argument);
  replay::RateReplay::Delivery disturb(core::AngularRateSample& sample);
  void report_link(const drivers::KvhLinkStatistics& now);
  void report_frame_rate(core::SensorTime now);
  void report_no_frame(core::SensorTime now);
  service::Status status() const;

  GyroPublisherOptions options_;
  service::Host host_;
  std::uint32_t gyro_id_;
  replay::RateReplay rates_;
  dds::Writer<msg::Temperature> temperature_writer_;  // a serial gyro's own thermometer
  GyroSource source_;
  std::optional<drivers::SerialGyro> serial_;
  drivers::KvhLinkStatistics reported_link_{};
  bool has_other_rate_ = false;  // as reported
  std::optional<replay::RosParticipant> ros2_participant_;
  std::unique_ptr<replay::RosRateSource> ros2_;

  std::atomic<bool> stopping_{false};
  std::mutex disturber_mutex_;  // between commands and samples
  twin::Disturber disturber_;
  service::CommandServer commands_;
};

}  // namespace zerodrift::services
