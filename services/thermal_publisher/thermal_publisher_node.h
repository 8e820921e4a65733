// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/drivers/sysfs_environment.h"
#include "common/drivers/sysfs_thermometer.h"
#include "common/replay/ros2_source.h"
#include "common/replay/temperature_replay.h"
#include "common/service/host.h"
#include "services/thermal_publisher/periodic_reader.h"
#include "services/thermal_publisher/thermal_source.h"

namespace zerodrift::services {

struct ThermalPublisherOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  ThermalSourceKind kind = ThermalSourceKind::kSimulation;
  replay::PublisherOptions publisher{};
  std::string sysfs_root = "/sys";
  // Of sysfs name=file, empty: all that are found; of ROS 2 name=topic, beside that of the source.
  std::vector<std::string> probes;
  std::vector<std::string> channels;  // of the environment, of sysfs: name=file
  replay::RosOptions ros2{};
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
  // What was read in a file, or received of ROS 2 and stamped there.
  struct Found {
    std::variant<core::TemperatureSample, drivers::ThermometerReading, drivers::EnvironmentReading>
        reading{};
    std::int64_t monotonic_ns = 0;
  };

  void open_sysfs();
  void open_all_there_are();
  void open_environment();
  void start_reading();
  void publish_sysfs();
  void publish(drivers::ThermometerReading& reading, core::SensorTime time);
  void publish(drivers::EnvironmentReading& reading, core::SensorTime time);
  void publish(const core::TemperatureSample& reading, core::SensorTime time);
  // `subject`: the sensor, of which each has events of its own.
  void warn(const std::string& code, const std::string& subject, const std::string& text,
            core::SensorTime time);
  void open_ros2();
  void publish_ros2();
  void found(Found&& one);  // any thread
  std::deque<Found> await_found();
  service::Status status() const;

  ThermalPublisherOptions options_;
  service::Host host_;
  std::uint32_t gyro_id_;
  replay::TemperatureReplay temperatures_;
  ThermalSource source_;
  std::vector<drivers::SysfsThermometer> thermometers_;
  std::optional<drivers::SysfsEnvironment> environment_;

  // What waits to be published: no endpoint is made on the middleware's thread.
  std::mutex found_mutex_;
  std::condition_variable found_any_;
  std::deque<Found> found_;
  std::optional<replay::RosParticipant> ros2_participant_;
  std::vector<std::unique_ptr<replay::RosTemperatureSource>> ros2_;

  std::atomic<bool> stopping_{false};
  std::vector<std::unique_ptr<PeriodicReader>> readers_;
};

}  // namespace zerodrift::services
