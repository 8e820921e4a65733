// SPDX-License-Identifier: Apache-2.0
#include "services/gyro_publisher/gyro_publisher_node.h"

#include <fmt/core.h>

#include <array>
#include <map>

#include "common/core/counted.h"
#include "common/dds/conversions.h"
#include "common/service/counted_event.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/one_of.h"
#include "common/service/replay_pacer.h"
#include "common/service/sensor_clock.h"
#include "common/service/time_option.h"

namespace zerodrift::services {

using service::Severity;
using namespace std::chrono_literals;

namespace {

using service::kStopCheck;
constexpr auto kReopenEvery = 1000ms;
constexpr std::int64_t kPatienceNs = 5'000'000'000;  // until a line says that no frame came

}  // namespace

void add_options(CLI::App& app, GyroPublisherOptions& options) {
  const std::map<std::string, GyroSourceKind> sources{{"simulation", GyroSourceKind::kSimulation},
                                                      {"record", GyroSourceKind::kRecord},
                                                      {"serial", GyroSourceKind::kSerial},
                                                      {"ros2", GyroSourceKind::kRos2}};
  const std::map<std::string, drivers::RotationFormat> formats{
      {"delta_angle_rad", drivers::RotationFormat::kDeltaAngleRad},
      {"delta_angle_deg", drivers::RotationFormat::kDeltaAngleDeg},
      {"rate_rad_s", drivers::RotationFormat::kRateRadps},
      {"rate_deg_s", drivers::RotationFormat::kRateDegps}};
  const std::map<std::string, drivers::TemperatureFormat> units{
      {"C", drivers::TemperatureFormat::kDegC},
      {"C_100", drivers::TemperatureFormat::kHundredthDegC},
      {"F", drivers::TemperatureFormat::kDegF},
      {"F_100", drivers::TemperatureFormat::kHundredthDegF}};
  app.add_option("--source", options.source.kind,
                 "simulation, record, serial, or ros2:TOPIC of sensor_msgs/Imu")
      ->required()
      ->transform(replay::source_of(sources, options.ros2.topic));
  replay::add_options(app, options.source.publisher, "key of this gyro on all topics, from 1");
  app.add_option("--rate", options.source.rate_hz,
                 "simulation: sample rate; the model's nominal rate without")
      ->transform(service::in_hertz());
  app.add_flag(
      "--free-running", options.free_running,
      "simulation, record: as a sensor with a clock of its own, which waits for nobody and "
      "nobody for it: to try a deployment");
  app.add_option("--device", options.serial.device, "serial: tty of the gyro");
  app.add_option("--baud", options.serial.baud_rate, "serial: line speed")->capture_default_str();
  service::show_default_in(
      "Hz", app.add_option("--frame-rate", options.serial.frame_rate_hz, "serial: frames a second")
                ->transform(service::in_hertz()));
  app.add_option("--rotation", options.serial.rotation,
                 "serial: what the gyro sends; " +
                     service::name_in(formats, options.serial.rotation) + " without")
      ->transform(service::one_of(formats));
  app.add_option("--temperature-unit", options.serial.temperature,
                 "serial: what its thermometer sends (=tempunits)")
      ->transform(service::one_of(units))
      ->default_str(service::name_in(units, options.serial.temperature));
  app.add_option("--temperature-probe", options.serial.probe, "serial: name of its thermometer")
      ->capture_default_str();
  replay::add_ros2_options(app, options.ros2);
}

GyroPublisherNode::GyroPublisherNode(const GyroPublisherOptions& options)
    : options_(options),
      host_("gyro_publisher", options.network, options.supervision),
      gyro_id_(options.source.publisher.gyro_id),
      rates_(host_, gyro_id_, options.source.publisher.speed,
             options.free_running ? std::vector<std::string>{} : options.source.publisher.wait_for),
      temperature_writer_(host_.participant(), host_.observer()),
      disturber_(options.source.publisher.seed),
      commands_(host_, [this](const msg::Command& m) { return obey(m); }) {
  if (options_.source.kind == GyroSourceKind::kSerial) {
    serial_.emplace(options_.serial);
  } else if (options_.source.kind == GyroSourceKind::kRos2) {
    ros2_participant_.emplace(host_, options_.network, options_.ros2);
    ros2_ = std::make_unique<replay::RosRateSource>(
        host_, gyro_id_, *ros2_participant_, options_.ros2.topic,
        core::RosRates(core::ClockSource::kHardware),
        [this](const core::AngularRateSample& sample) { rates_.publish(sample); });
  } else {
    source_ = open_gyro_source(options_.source, replay::warn_by(host_, gyro_id_));
  }
}

int GyroPublisherNode::run() {
  const auto publish = [this] {
    if (serial_) return publish_serial();
    if (ros2_) return publish_ros2();
    rates_.publish(source_, stopping_,
                   [this](core::AngularRateSample& sample) { return disturb(sample); });
  };
  return replay::run_publisher(host_, gyro_id_, stopping_, publish, [this] { return status(); });
}

replay::RateReplay::Delivery GyroPublisherNode::disturb(core::AngularRateSample& sample) {
  if (options_.free_running) sample.clock = core::ClockSource::kHardware;
  const std::lock_guard lock(disturber_mutex_);
  return disturber_.apply(sample) == twin::Disturber::Delivery::kGive
             ? replay::RateReplay::Delivery::kGive
             : replay::RateReplay::Delivery::kDrop;
}

// ---------------------------------------- commands

service::CommandVerdict GyroPublisherNode::obey(const msg::Command& command) {
  const std::string name = command.name().c_str();
  const std::string argument = command.argument().c_str();
  try {
    if (serial_ || ros2_)
      throw std::invalid_argument("a real gyro is neither disturbed nor replayed");
    if (name != "inject" && name != "replay") {
      throw std::invalid_argument("unknown command '" + name + "'; known are inject, replay");
    }
    return {.outcome = service::CommandVerdict::Outcome::kAccepted,
            .text = name == "inject" ? inject(argument) : replay(argument)};
  } catch (const std::invalid_argument& error) {
    return {.text = error.what()};
  }
}

std::string GyroPublisherNode::inject(const std::string& argument) {
  if (argument == "clear") {
    const std::lock_guard lock(disturber_mutex_);
    disturber_.clear();
    return "nothing is injected any more";
  }
  const auto disturbance = twin::parse_disturbance(argument);
  const std::lock_guard lock(disturber_mutex_);
  if (!disturber_.begin(disturbance))
    throw std::invalid_argument("16 disturbances act already; inject clear ends them");
  return "injecting " + argument + " from the next sample on";
}

std::string GyroPublisherNode::replay(const std::string& argument) {
  constexpr std::string_view kSpeed = "speed ";
  if (argument == "pause") {
    rates_.clock().pause();
    return "the replay is paused";
  }
  if (argument == "resume") {
    rates_.clock().resume();
    return "the replay goes on";
  }
  if (!argument.starts_with(kSpeed)) {
    throw std::invalid_argument("found '" + argument +
                                "', expected pause, resume or speed N (or max)");
  }
  rates_.clock().set_speed(service::parse_speed(argument.substr(kSpeed.size()), "speed"));
  return "the replay goes on at " + argument;
}

// ---------------------------------------- a real gyro

void GyroPublisherNode::publish_serial() {
  service::SensorClock clock(service::await_clocks());
  const std::int64_t began_ns = service::monotonic_ns();
  bool awaits_frame = true;
  while (!stopping_) {
    const auto result = serial_->wait(kStopCheck);
    const std::int64_t arrived_ns = service::monotonic_ns();
    if (service::follow_wall_clock(clock, host_, gyro_id_)) serial_->restart_time();
    const core::SensorTime now = clock.at(arrived_ns);
    const service::ClockDiscipline discipline = service::clock_discipline();
    if (result == drivers::SerialStatus::kGone) {
      host_.raise(
          {.code = "device_gone",
           .severity = Severity::kError,
           .text = options_.serial.device + ": hung up or unplugged; trying to open it again",
           .gyro_id = gyro_id_,
           .sensor_time_ns = now.count()});
      std::this_thread::sleep_for(kReopenEvery);
      try {
        serial_->reopen();
      } catch (const drivers::DriverError&) {  // reported above; tried again
      }
      continue;
    }
    for (const auto& reading : serial_->read(now)) {
      rates_.publish(reading.rate, discipline);
      auto temperature = dds::to_message(reading.temperature, gyro_id_);
      temperature_writer_.write(temperature);
    }
    report_link(serial_->statistics());
    report_frame_rate(now);
    awaits_frame = awaits_frame && reported_link_.frames == 0;
    if (awaits_frame && arrived_ns - began_ns > kPatienceNs) {
      awaits_frame = false;
      report_no_frame(now);
    }
  }
}

void GyroPublisherNode::report_no_frame(core::SensorTime now) {
  host_.raise({.code = "no_frame",
               .severity = Severity::kWarning,
               .text = options_.serial.device +
                       (reported_link_.bytes_skipped > 0
                            ? ": of what has come so far nothing is a frame of KVH's format A; "
                              "expected that format, and --baud as the gyro was set up"
                            : ": nothing has come so far; expected frames of KVH's format A: is "
                              "the gyro on, and at this line?"),
               .gyro_id = gyro_id_,
               .sensor_time_ns = now.count()});
}

void GyroPublisherNode::report_frame_rate(core::SensorTime now) {
  const std::optional<double> other_hz = serial_->other_rate_hz();
  if (other_hz.has_value() == has_other_rate_) return;
  has_other_rate_ = other_hz.has_value();
  const std::string said = fmt::format("{:g} a second", options_.serial.frame_rate_hz);
  host_.raise(
      {.code = "frame_rate",
       .severity = has_other_rate_ ? Severity::kError : Severity::kInformation,
       .text =
           options_.serial.device +
           (has_other_rate_
                ? fmt::format(": sends {:.5g} frames a second, --frame-rate says {}: no axis is "
                              "valid; expected the rate that the gyro was set up to send (=dr)",
                              *other_hz, said)
                : ": sends " + said + " again, as --frame-rate says"),
       .gyro_id = gyro_id_,
       .sensor_time_ns = now.count()});
}

void GyroPublisherNode::report_link(const drivers::KvhLinkStatistics& now) {
  using Statistics = drivers::KvhLinkStatistics;
  constexpr std::array<service::CountedEvent<Statistics>, 4> kCountedEvents{
      {{&Statistics::crc_errors, "crc_error", "a frame with a wrong CRC was dropped"},
       {&Statistics::bytes_skipped, "bytes_skipped", "bytes outside any frame were skipped"},
       {&Statistics::frames_repeated, "repeated_frame", "a frame came twice, and counts once"},
       {&Statistics::frames_missing, "frames_missing",
        "sequence numbers of the gyro are missing"}}};
  service::raise_grown(host_, kCountedEvents,
                       {.text = options_.serial.device + ": ", .gyro_id = gyro_id_}, reported_link_,
                       now);
  reported_link_ = now;
}

// ---------------------------------------- a ROS 2 topic

// Samples go on as they are received, on the middleware's thread.
void GyroPublisherNode::publish_ros2() {
  const std::int64_t began_ns = service::monotonic_ns();
  while (!stopping_) {
    std::this_thread::sleep_for(kStopCheck);
    ros2_->report(1e-9 * static_cast<double>(service::monotonic_ns() - began_ns));
    ros2_participant_->report();
  }
}

// The counts stand in the gyro's part: publishers of several gyros share the service's name.
service::Status GyroPublisherNode::status() const {
  const std::uint64_t published = rates_.published();
  service::Status status;
  status.state = published > 0 ? service::State::kRunning : service::State::kWaiting;
  status.summary = core::counted(published, "sample") + " published";
  if (ros2_ && published == 0 && ros2_->watch().unstamped() > 0) {
    status.state = service::State::kDegraded;
    status.summary += ": all messages of " + ros2_->topic() + " lack a header.stamp";
  }
  status.flow = {.topic = dds::kAngularRate.name,
                 .end = dds::Direction::kWriter,
                 .samples = published,
                 .paced = !serial_ && !ros2_ && !options_.free_running};
  service::StatusPart& of_gyro = status.parts.emplace_back();
  of_gyro.name = std::to_string(gyro_id_);
  of_gyro.summary = status.summary;
  of_gyro.is_whole_process = true;
  of_gyro.metrics = {{"samples_published", "1", static_cast<double>(published)},
                     {"samples_refused", "1", static_cast<double>(rates_.refused())},
                     {"finished", "1", rates_.finished() ? 1.0 : 0.0}};
  if (!ros2_) return status;
  const replay::RosTopicWatch& watch = ros2_->watch();
  of_gyro.metrics.push_back({"ros2_messages", "1", static_cast<double>(watch.received())});
  of_gyro.metrics.push_back({"ros2_messages_missing", "1", static_cast<double>(watch.missing())});
  of_gyro.metrics.push_back({"ros2_stamps_missing", "1", static_cast<double>(watch.unstamped())});
  if (ros2_participant_->is_hosts()) {
    status.flow->topic = ros2_->topic();
    status.flow->end = dds::Direction::kReader;
  }
  return status;
}

}  // namespace zerodrift::services
