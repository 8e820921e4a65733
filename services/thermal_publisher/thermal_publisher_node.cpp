// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_publisher_node.h"

#include <stdexcept>

#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
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
  app.add_option("--source", options.source.kind, "simulation, record or sysfs")
      ->required()
      ->transform(CLI::CheckedTransformer(sources));
  app.add_option("--gyro-id", options.gyro_id, "the gyro whose temperatures these are")
      ->check(CLI::Range(1U, 4294967295U))
      ->capture_default_str();
  app.add_option("--model", options.source.model, "simulation: the twin's model file");
  app.add_option("--profile", options.source.profile, "simulation: what the experiment does");
  app.add_option("--seed", options.source.seed, "simulation: seed of all noise")
      ->capture_default_str();
  app.add_option("--record", options.source.record,
                 "record: a .csv, .csv.gz, .csv.xz or .mcap file");
  app.add_option("--columns", options.source.columns, "record: names and units of a foreign CSV");
  app.add_option("--duration", options.source.duration_s,
                 "simulation, record: stop after so many seconds");
  app.add_option("--speed", options.speed,
                 "simulation, record without consumers: times real time, or max")
      ->capture_default_str();
  app.add_option("--wait-for", options.wait_for,
                 "simulation, record: consumers to keep pace with; none with an empty value")
      ->delimiter(',')
      ->capture_default_str();
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
      temperatures_(host_, options.gyro_id, options.speed, options.wait_for) {
  if (options_.source.kind == ThermalSourceKind::kSysfs) {
    open_sysfs();
  } else {
    options_.source.gyro_id = options.gyro_id;
    source_ = open_thermal_source(options_.source, [this](const std::string& line) {
      host_.raise({.code = "record_warning",
                   .severity = Severity::kWarning,
                   .text = line,
                   .gyro_id = options_.gyro_id,
                   .sensor_time_ns = 0});
    });
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
  std::thread publisher([this] {
    try {
      if (thermometers_.empty()) {
        temperatures_.publish(source_, stopping_);
      } else {
        publish_sysfs();
      }
    } catch (const std::exception& error) {
      failed_ = true;
      host_.raise({.code = "source_failed",
                   .severity = Severity::kError,
                   .text = error.what(),
                   .gyro_id = options_.gyro_id,
                   .sensor_time_ns = 0});
    }
    service::request_stop();
  });
  const auto exit_code = [this] { return failed_ ? service::kExitBadInput : host_.exit_code(); };
  host_.run([this] { return status(); }, {},
            [&] { service::end_within(service::kStopWithin, exit_code()); });
  stopping_ = true;
  publisher.join();
  return exit_code();
}

void ThermalPublisherNode::publish_sysfs() {
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(1.0 / options_.sysfs_rate_hz));
  auto due = std::chrono::steady_clock::now();
  service::SensorClock clock(service::await_clocks());
  while (!stopping_) {
    for (auto& thermometer : thermometers_) {
      service::follow_wall_clock(clock, host_, options_.gyro_id);
      const auto reading = thermometer.read(clock.at(service::monotonic_ns()));
      if (!reading.sample.measured) {
        host_.raise({.code = "no_temperature",
                     .severity = Severity::kWarning,
                     .text = reading.reason,
                     .gyro_id = options_.gyro_id,
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
                 .paced = options_.source.kind != ThermalSourceKind::kSysfs};
  return status;
}

}  // namespace zerodrift::services
