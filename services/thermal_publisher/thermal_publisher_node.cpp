// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_publisher_node.h"

#include <stdexcept>
#include <utility>

#include "common/record/probe_topic.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/one_of.h"
#include "common/service/sensor_clock.h"

namespace zerodrift::services {

using service::Severity;
using namespace std::chrono_literals;

namespace {

constexpr auto kStopCheck = 100ms;

}  // namespace

void add_options(CLI::App& app, ThermalPublisherOptions& options) {
  const std::map<std::string, ThermalSourceKind> sources{
      {"simulation", ThermalSourceKind::kSimulation},
      {"record", ThermalSourceKind::kRecord},
      {"sysfs", ThermalSourceKind::kSysfs},
      {"ros2", ThermalSourceKind::kRos2}};
  app.add_option("--source", options.kind,
                 "simulation, record, sysfs, or ros2:[PROBE=]TOPIC of sensor_msgs/Temperature; "
                 "probe coil without a name")
      ->required()
      ->transform(replay::source_of(sources, options.ros2.topic));
  replay::add_options(app, options.publisher, "the gyro whose temperatures these are");
  app.add_option("--sysfs-root", options.sysfs_root, "sysfs: where to look for thermometers")
      ->capture_default_str();
  app.add_option("--probe", options.probes,
                 "sysfs: NAME=FILE (repeatable); all that are found without. ros2: NAME=TOPIC of "
                 "another probe");
  app.add_option("--rate", options.sysfs_rate_hz,
                 "sysfs: readings a second; ros2: how many are expected, to tell silence")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  replay::add_options(app, options.ros2);
}

ThermalPublisherNode::ThermalPublisherNode(const ThermalPublisherOptions& options)
    : options_(options),
      host_("thermal_publisher", options.network, options.supervision),
      gyro_id_(options.publisher.gyro_id),
      temperatures_(host_, gyro_id_, options.publisher.speed, options.publisher.wait_for) {
  if (options_.kind == ThermalSourceKind::kSysfs) {
    open_sysfs();
  } else if (options_.kind == ThermalSourceKind::kRos2) {
    open_ros2();
  } else {
    source_ =
        open_thermal_source(options_.kind, options_.publisher, replay::warn_by(host_, gyro_id_));
  }
}

void ThermalPublisherNode::open_sysfs() {
  std::vector<drivers::ThermometerFile> files;
  for (const std::string& text : options_.probes) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw std::invalid_argument("--probe: found '" + text + "', expected NAME=FILE");
    }
    files.push_back(drivers::describe_thermometer(text.substr(0, equals), text.substr(equals + 1)));
  }
  if (files.empty()) files = drivers::discover_thermometers(options_.sysfs_root);
  if (files.empty()) {
    throw std::invalid_argument(
        options_.sysfs_root + ": no hwmon, IIO or 1-wire thermometer found; name one with --probe");
  }
  for (auto& file : files) thermometers_.emplace_back(std::move(file));
}

int ThermalPublisherNode::run() {
  const auto publish = [this] {
    if (!thermometers_.empty()) return publish_sysfs();
    if (!ros2_.empty()) return publish_ros2();
    temperatures_.publish(source_, stopping_);
  };
  return replay::run_publisher(host_, gyro_id_, stopping_, publish, [this] { return status(); });
}

void ThermalPublisherNode::publish_sysfs() {
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(1.0 / options_.sysfs_rate_hz));
  auto due = std::chrono::steady_clock::now();
  service::SensorClock clock(service::await_clocks());
  while (!stopping_) {
    for (auto& thermometer : thermometers_) {
      service::follow_wall_clock(clock, host_, gyro_id_);
      const auto reading = thermometer.read(clock.at(service::monotonic_ns()));
      if (!reading.sample.measured) {
        host_.raise({.code = "no_temperature",
                     .severity = Severity::kWarning,
                     .text = reading.reason,
                     .gyro_id = gyro_id_,
                     .sensor_time_ns = reading.sample.time.count()});
      }
      temperatures_.publish(reading.sample, stopping_);
    }
    due += period;
    while (!stopping_ && std::chrono::steady_clock::now() < due) {
      std::this_thread::sleep_for(
          std::min<std::chrono::nanoseconds>(kStopCheck, due - std::chrono::steady_clock::now()));
    }
  }
}

void ThermalPublisherNode::open_ros2() {
  std::vector<std::string> named = options_.probes;
  if (!options_.ros2.topic.empty() || named.empty())
    named.insert(named.begin(), options_.ros2.topic);
  ros2_participant_.emplace(host_, options_.network, options_.ros2);
  for (const std::string& text : named) {
    const auto topic = record::parse_probe_topic(text);
    if (!topic) {
      throw std::invalid_argument(
          "ros2: found '" + text +
          "', expected TOPIC or PROBE=TOPIC, such as coil=/imu/temperature");
    }
    ros2_.push_back(std::make_unique<replay::RosTemperatureSource>(
        host_, gyro_id_, *ros2_participant_, topic->topic,
        core::RosTemperatures(topic->probe, core::ClockSource::kHardware),
        [this](const core::TemperatureSample& reading) {
          const std::lock_guard lock(readings_mutex_);
          readings_.push_back(reading);
          readings_came_.notify_one();
        }));
  }
}

std::deque<core::TemperatureSample> ThermalPublisherNode::await_readings() {
  std::unique_lock lock(readings_mutex_);
  readings_came_.wait_for(lock, kStopCheck, [this] { return !readings_.empty(); });
  return std::exchange(readings_, {});
}

void ThermalPublisherNode::publish_ros2() {
  const std::int64_t began_ns = service::monotonic_ns();
  while (!stopping_) {
    for (const auto& reading : await_readings()) temperatures_.publish(reading, stopping_);
    for (auto& source : ros2_)
      source->report(1e-9 * static_cast<double>(service::monotonic_ns() - began_ns));
    ros2_participant_->report();
  }
}

service::Status ThermalPublisherNode::status() const {
  const std::uint64_t published = temperatures_.published();
  service::Status status;
  status.state = published > 0 ? service::State::kRunning : service::State::kWaiting;
  status.metrics = {{"readings_published", "1", static_cast<double>(published)}};
  status.summary = std::to_string(published) + " readings published";
  status.flow = {.topic = dds::kTemperature.name,
                 .end = dds::Direction::kWriter,
                 .samples = published,
                 .interval_s = 1.0 / options_.sysfs_rate_hz,
                 .paced = thermometers_.empty() && ros2_.empty()};
  if (ros2_.empty()) return status;
  double received = 0.0;
  double missing = 0.0;
  double unstamped = 0.0;
  for (const auto& source : ros2_) {
    received += static_cast<double>(source->watch().received());
    missing += static_cast<double>(source->watch().missing());
    unstamped += static_cast<double>(source->watch().unstamped());
  }
  status.metrics.push_back({"ros2_messages", "1", received});
  status.metrics.push_back({"ros2_messages_missing", "1", missing});
  status.metrics.push_back({"ros2_stamps_missing", "1", unstamped});
  if (ros2_participant_->is_hosts()) {
    status.flow->topic = ros2_.front()->topic();
    status.flow->end = dds::Direction::kReader;
  }
  return status;
}

}  // namespace zerodrift::services
