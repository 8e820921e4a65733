// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_publisher_node.h"

#include <stdexcept>

#include "common/dds/conversions.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/receipt.h"

namespace zerodrift::services {

using service::Severity;
using namespace std::chrono_literals;

namespace {

constexpr auto kStopCheck = 100ms;
constexpr auto kReceiveWithin = 2000ms;
constexpr core::SensorTime kAhead = 10s;  // of what is needed, so that rates never wait for long
constexpr core::SensorTime kAfterTheEnd = 1h;  // beyond any rate sample of the record
constexpr std::uint64_t kInFlight = 256;  // readings of one probe; half the history kept for it

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
  app.add_option("--record", options.source.record, "record: a .csv, .csv.gz or .csv.xz file");
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
      host_("thermal_publisher", options.network),
      pacer_(host_.participant(), options.gyro_id, options.wait_for),
      clock_(service::parse_speed(options.speed)) {
  if (options_.source.kind == ThermalSourceKind::kSysfs) {
    open_sysfs();
  } else {
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
        publish_source();
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
      // What was published before is still good.
      wait_for_receipts();
    }
    service::request_stop();
  });
  const auto exit_code = [this] { return failed_ ? service::kExitBadInput : service::kExitDone; };
  host_.run([this] { return status(); }, {},
            [&] { service::end_within(service::kStopWithin, exit_code()); });
  stopping_ = true;
  publisher.join();
  return exit_code();
}

void ThermalPublisherNode::publish_source() {
  if (pacer_.anybody_to_wait_for()) {
    while (!stopping_ && !pacer_.wait_for_consumers(kStopCheck)) {
    }
  }
  core::SensorTime newest{0};
  std::optional<core::SensorTime> first;
  while (!stopping_) {
    const auto sample = source_();
    if (!sample) break;
    if (!first) first = sample->time;
    newest = sample->time;
    if (!pacer_.anybody_to_wait_for()) {
      clock_.wait_until(sample->time, stopping_);
    } else if (sample->time - *first > kAhead && !wait_until_needed(sample->time - kAhead)) {
      return;
    }
    publish(*sample);
  }
  if (!stopping_ && first) mark_the_end(newest);
}

bool ThermalPublisherNode::wait_until_needed(core::SensorTime time) {
  while (!pacer_.wait_until_needed(time, kStopCheck)) {
    if (stopping_) return false;
  }
  return true;
}

// Says for each probe that nothing more comes, so that nobody waits for it.
void ThermalPublisherNode::mark_the_end(core::SensorTime newest) {
  for (const auto& [name, probe] : probes_) {
    core::TemperatureSample last;
    last.probe = name;
    last.sequence = probe.next_sequence;
    last.time = newest + kAfterTheEnd;
    last.measured = false;
    last.clock = core::ClockSource::kReplay;
    publish(last);
  }
  wait_for_receipts();
}

void ThermalPublisherNode::wait_for_receipts() {
  for (const auto& [name, probe] : probes_) {
    service::wait_for_receipt(*probe.writer, kReceiveWithin, stopping_);
  }
}

void ThermalPublisherNode::publish_sysfs() {
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(1.0 / options_.sysfs_rate_hz));
  auto due = std::chrono::steady_clock::now();
  while (!stopping_) {
    for (auto& thermometer : thermometers_) {
      const auto reading = thermometer.read(core::SensorTime{service::unix_time_ns()});
      if (!reading.sample.measured) {
        host_.raise({.code = "no_temperature",
                     .severity = Severity::kWarning,
                     .text = reading.reason,
                     .gyro_id = options_.gyro_id,
                     .sensor_time_ns = reading.sample.time.count()});
      }
      publish(reading.sample);
    }
    due += period;
    while (!stopping_ && std::chrono::steady_clock::now() < due) {
      std::this_thread::sleep_for(
          std::min<std::chrono::nanoseconds>(kStopCheck, due - std::chrono::steady_clock::now()));
    }
  }
}

// A writer a probe (topics.h says why); late matches get what was written before.
ThermalPublisherNode::Probe& ThermalPublisherNode::probe(const std::string& name) {
  Probe& known = probes_[name];
  if (!known.writer) {
    known.writer =
        std::make_unique<dds::Writer<msg::Temperature>>(host_.participant(), host_.observer());
  }
  return known;
}

void ThermalPublisherNode::publish(const core::TemperatureSample& sample) {
  Probe& source = probe(sample.probe);
  source.next_sequence = sample.sequence + 1;
  auto message = dds::to_message(sample, options_.gyro_id);
  if (source.writer->write(message)) ++published_;
  if (!pacer_.anybody_to_wait_for() || ++source.in_flight < kInFlight) return;
  service::wait_for_receipt(*source.writer, kReceiveWithin, stopping_);
  source.in_flight = 0;
}

service::Status ThermalPublisherNode::status() const {
  service::Status status;
  status.state = published_ > 0 ? service::State::kRunning : service::State::kWaiting;
  status.metrics = {{"readings_published", "1", static_cast<double>(published_)}};
  status.summary = std::to_string(published_) + " readings published";
  return status;
}

}  // namespace zerodrift::services
