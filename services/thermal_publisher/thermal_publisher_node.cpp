// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_publisher_node.h"

#include <stdexcept>

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
      {"sysfs", ThermalSourceKind::kSysfs}};
  app.add_option("--source", options.kind, "simulation, record or sysfs")
      ->required()
      ->transform(service::one_of(sources));
  replay::add_options(app, options.publisher, "the gyro whose temperatures these are");
  app.add_option("--sysfs-root", options.sysfs_root, "sysfs: where to look for thermometers")
      ->capture_default_str();
  app.add_option("--probe", options.sysfs_probes,
                 "sysfs: NAME=FILE (repeatable); all that are found without");
  app.add_option("--rate", options.sysfs_rate_hz, "sysfs: readings a second")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

ThermalPublisherNode::ThermalPublisherNode(const ThermalPublisherOptions& options)
    : options_(options),
      host_("thermal_publisher", options.network, options.supervision),
      gyro_id_(options.publisher.gyro_id),
      temperatures_(host_, gyro_id_, options.publisher.speed, options.publisher.wait_for) {
  if (options_.kind == ThermalSourceKind::kSysfs) {
    open_sysfs();
  } else {
    source_ =
        open_thermal_source(options_.kind, options_.publisher, replay::warn_by(host_, gyro_id_));
  }
}

void ThermalPublisherNode::open_sysfs() {
  std::vector<drivers::ThermometerFile> files;
  for (const std::string& text : options_.sysfs_probes) {
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
    if (thermometers_.empty()) return temperatures_.publish(source_, stopping_);
    publish_sysfs();
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
                 .paced = options_.kind != ThermalSourceKind::kSysfs};
  return status;
}

}  // namespace zerodrift::services
