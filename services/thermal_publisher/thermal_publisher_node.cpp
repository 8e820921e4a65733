// SPDX-License-Identifier: Apache-2.0
#include "services/thermal_publisher/thermal_publisher_node.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/core/counted.h"
#include "common/drivers/driver_error.h"
#include "common/record/column_map.h"
#include "common/record/probe_topic.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/replay_pacer.h"
#include "common/service/sensor_clock.h"
#include "common/service/time_option.h"

namespace zerodrift::services {

using service::Severity;
using namespace std::chrono_literals;

namespace {

using service::kStopCheck;

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
  replay::add_options(app, options.publisher,
                      "the gyro whose temperatures and environment these are");
  app.add_option("--sysfs-root", options.sysfs_root, "sysfs: where to look for thermometers")
      ->capture_default_str();
  app.add_option("--probe", options.probes,
                 "sysfs: NAME=FILE (repeatable); all that are found without. ros2: NAME=TOPIC of "
                 "another probe");
  app.add_option("--channel", options.channels,
                 "sysfs: CHANNEL=FILE (repeatable) of the environment, as supply=/sys/class/hwmon/"
                 "hwmon1/in1_input; =-FILE where the sensor's axis points the other way");
  service::show_default_in(
      "Hz", app.add_option("--rate", options.sysfs_rate_hz,
                           "sysfs: readings a second; ros2: how many are expected, to tell silence")
                ->transform(service::in_hertz()));
  replay::add_ros2_options(app, options.ros2);
}

ThermalPublisherNode::ThermalPublisherNode(const ThermalPublisherOptions& options)
    : options_(options),
      host_("thermal_publisher", options.network, options.supervision),
      gyro_id_(options.publisher.gyro_id),
      temperatures_(host_, gyro_id_, options.publisher.speed, options.publisher.wait_for) {
  if (!options_.channels.empty() && options_.kind != ThermalSourceKind::kSysfs)
    throw std::invalid_argument(
        "--channel: is for --source sysfs; other sources say what they have");
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
    const std::string probe = text.substr(0, equals);
    const bool is_twice = std::any_of(files.begin(), files.end(),
                                      [&](const auto& file) { return file.probe == probe; });
    if (is_twice || probe.size() > drivers::kLongestProbe) {
      throw std::invalid_argument(fmt::format(
          "--probe: found '{}'{}, expected NAME=FILE, each NAME once and of at most {} bytes", text,
          is_twice ? " again" : "", drivers::kLongestProbe));
    }
    files.push_back(drivers::describe_thermometer(probe, text.substr(equals + 1)));
  }
  for (auto& file : files) thermometers_.emplace_back(std::move(file));
  open_environment();
  if (thermometers_.empty()) open_all_there_are();
}

// One that answers an error says nothing of the others.
void ThermalPublisherNode::open_all_there_are() {
  for (const auto& file : drivers::discover_thermometers(options_.sysfs_root)) {
    try {
      thermometers_.emplace_back(file);
    } catch (const drivers::DriverError& error) {
      warn("no_temperature", file.path.string(), std::string("left out: ") + error.what(),
           core::SensorTime{0});
    }
  }
  if (thermometers_.empty() && !environment_) {
    throw std::invalid_argument(
        options_.sysfs_root + ": no hwmon, IIO or 1-wire thermometer found; name one with --probe");
  }
}

void ThermalPublisherNode::open_environment() {
  std::vector<drivers::EnvironmentFile> files;
  std::string names;
  for (std::size_t i = 0; i < core::kEnvironmentChannels; ++i)
    names += (i == 0 ? "" : ", ") + record::name(record::environment_channel(i));
  for (const std::string& text : options_.channels) {
    const auto equals = std::min(text.find('='), text.size());
    std::size_t channel = 0;
    while (channel < core::kEnvironmentChannels &&
           record::name(record::environment_channel(channel)) != text.substr(0, equals))
      ++channel;
    const bool is_twice = std::any_of(files.begin(), files.end(),
                                      [&](const auto& file) { return file.channel == channel; });
    if (equals == text.size() || channel == core::kEnvironmentChannels || is_twice) {
      throw std::invalid_argument("--channel: found '" + text + "'" + (is_twice ? " again" : "") +
                                  ", expected CHANNEL=FILE, once each, with one of " + names);
    }
    const bool is_reversed = text.substr(equals + 1).starts_with('-');
    files.push_back({channel, text.substr(equals + (is_reversed ? 2 : 1)), is_reversed});
  }
  if (!files.empty()) environment_.emplace(std::move(files));
}

int ThermalPublisherNode::run() {
  const auto publish = [this] {
    if (options_.kind == ThermalSourceKind::kSysfs) return publish_sysfs();
    if (!ros2_.empty()) return publish_ros2();
    temperatures_.publish(source_, stopping_);
  };
  return replay::run_publisher(host_, gyro_id_, stopping_, publish, [this] { return status(); });
}

// Each file has a thread, so that one that hangs doesn't keep the others. A supervisor limits how
// many a service may have (TasksMax=, pids_limit).
void ThermalPublisherNode::start_reading() {
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(1.0 / options_.sysfs_rate_hz));
  const auto start = [&](std::string what, std::function<void()> read) {
    readers_.push_back(std::make_unique<PeriodicReader>(std::move(what), period, std::move(read)));
  };
  try {
    if (environment_)
      start("environment", [this] { found({.reading = environment_->read(core::SensorTime{0})}); });
    for (auto& thermometer : thermometers_) {
      start(thermometer.file().path.string(),
            [this, &thermometer] { found({.reading = thermometer.read()}); });
    }
  } catch (const std::system_error& error) {
    const std::size_t started = readers_.size();
    readers_.clear();  // ending needs a thread, too
    throw std::invalid_argument(fmt::format(
        "{} found, each read by a thread of its own, of which {} could be started: {}; name those "
        "wanted with --probe NAME=FILE, or raise the limit of tasks (TasksMax=, pids_limit)",
        core::counted(thermometers_.size(), "thermometer"), started, error.code().message()));
  }
}

void ThermalPublisherNode::publish_sysfs() {
  service::SensorClock clock(service::await_clocks());
  start_reading();
  while (!stopping_) {
    for (Found& found : await_found()) {
      service::follow_wall_clock(clock, host_, gyro_id_);
      const core::SensorTime time = clock.at(found.monotonic_ns);
      std::visit([&](auto& reading) { publish(reading, time); }, found.reading);
    }
    for (const auto& reader : readers_) {
      const double overdue_s = core::seconds(reader->overdue());
      if (overdue_s > 0.0) {
        warn("no_temperature", reader->what(),
             fmt::format("{}: it was asked {:.1f} s ago and has not answered", reader->what(),
                         overdue_s),
             clock.at(service::monotonic_ns()));
      }
    }
  }
  readers_.clear();
}

void ThermalPublisherNode::publish(drivers::ThermometerReading& reading, core::SensorTime time) {
  reading.sample.time = time;
  if (!reading.sample.measured) warn("no_temperature", reading.sample.probe, reading.reason, time);
  temperatures_.publish(reading.sample, stopping_);
}

void ThermalPublisherNode::publish(drivers::EnvironmentReading& reading, core::SensorTime time) {
  reading.sample.time = time;
  for (const auto& [channel, reason] : reading.not_measured)
    warn("no_environment", record::name(record::environment_channel(channel)), reason, time);
  temperatures_.publish(reading.sample, stopping_);
}

// Its publisher has stamped it.
void ThermalPublisherNode::publish(const core::TemperatureSample& reading,
                                   core::SensorTime /*time*/) {
  temperatures_.publish(reading, stopping_);
}

void ThermalPublisherNode::warn(const std::string& code, const std::string& subject,
                                const std::string& text, core::SensorTime time) {
  host_.raise({.code = code,
               .severity = Severity::kWarning,
               .text = text,
               .gyro_id = gyro_id_,
               .sensor_time_ns = time.count(),
               .subject = subject});
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
        [this](const core::TemperatureSample& reading) { found({.reading = reading}); }));
  }
}

void ThermalPublisherNode::found(Found&& one) {
  one.monotonic_ns = service::monotonic_ns();
  const std::lock_guard lock(found_mutex_);
  found_.push_back(std::move(one));
  found_any_.notify_one();
}

std::deque<ThermalPublisherNode::Found> ThermalPublisherNode::await_found() {
  std::unique_lock lock(found_mutex_);
  found_any_.wait_for(lock, kStopCheck, [this] { return !found_.empty(); });
  return std::exchange(found_, {});
}

void ThermalPublisherNode::publish_ros2() {
  const std::int64_t began_ns = service::monotonic_ns();
  while (!stopping_) {
    for (Found& found : await_found()) {
      std::visit([&](auto& reading) { publish(reading, core::SensorTime{0}); }, found.reading);
    }
    for (auto& source : ros2_)
      source->report(1e-9 * static_cast<double>(service::monotonic_ns() - began_ns));
    ros2_participant_->report();
  }
}

service::Status ThermalPublisherNode::status() const {
  const std::uint64_t published = temperatures_.published();
  service::Status status;
  status.state = published > 0 ? service::State::kRunning : service::State::kWaiting;
  status.summary = core::counted(published, "reading") + " published";
  const auto is_unstamped = [](const auto& source) { return source->watch().unstamped() > 0; };
  const auto unstamped_source = std::find_if(ros2_.begin(), ros2_.end(), is_unstamped);
  if (published == 0 && unstamped_source != ros2_.end()) {
    status.state = service::State::kDegraded;
    status.summary += ": all messages of " + (*unstamped_source)->topic() + " lack a header.stamp";
  }
  service::StatusPart& of_gyro = status.parts.emplace_back();  // as the gyro's publisher
  of_gyro.name = std::to_string(gyro_id_);
  of_gyro.summary = status.summary;
  of_gyro.is_whole_process = true;
  of_gyro.metrics = {{"readings_published", "1", static_cast<double>(published)}};
  const bool has_environment_alone = environment_ && thermometers_.empty();
  status.flow = {.topic = has_environment_alone ? dds::kEnvironment.name : dds::kTemperature.name,
                 .end = dds::Direction::kWriter,
                 .samples = published,
                 .interval_s = 1.0 / options_.sysfs_rate_hz,
                 .paced = options_.kind != ThermalSourceKind::kSysfs && ros2_.empty()};
  if (ros2_.empty()) return status;
  double received = 0.0;
  double missing = 0.0;
  double unstamped = 0.0;
  for (const auto& source : ros2_) {
    received += static_cast<double>(source->watch().received());
    missing += static_cast<double>(source->watch().missing());
    unstamped += static_cast<double>(source->watch().unstamped());
  }
  of_gyro.metrics.push_back({"ros2_messages", "1", received});
  of_gyro.metrics.push_back({"ros2_messages_missing", "1", missing});
  of_gyro.metrics.push_back({"ros2_stamps_missing", "1", unstamped});
  if (ros2_participant_->is_hosts()) {
    status.flow->topic = ros2_.front()->topic();
    status.flow->end = dds::Direction::kReader;
  }
  return status;
}

}  // namespace zerodrift::services
