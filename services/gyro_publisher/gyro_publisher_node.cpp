// SPDX-License-Identifier: Apache-2.0
#include "services/gyro_publisher/gyro_publisher_node.h"

#include <map>

#include "common/dds/conversions.h"
#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "common/service/receipt.h"

namespace zerodrift::services {

using service::Severity;
using namespace std::chrono_literals;

namespace {

constexpr auto kPatience = 5000ms;  // until a line says who is waited for
constexpr auto kStopCheck = 100ms;
constexpr auto kReopenEvery = 1000ms;

}  // namespace

void add_options(CLI::App& app, GyroPublisherOptions& options) {
  const std::map<std::string, GyroSourceKind> sources{{"simulation", GyroSourceKind::kSimulation},
                                                      {"record", GyroSourceKind::kRecord},
                                                      {"serial", GyroSourceKind::kSerial}};
  const std::map<std::string, drivers::RotationFormat> formats{
      {"delta_angle_rad", drivers::RotationFormat::kDeltaAngleRad},
      {"delta_angle_deg", drivers::RotationFormat::kDeltaAngleDeg},
      {"rate_rad_s", drivers::RotationFormat::kRateRadps},
      {"rate_deg_s", drivers::RotationFormat::kRateDegps}};
  app.add_option("--source", options.source.kind, "simulation, record or serial")
      ->required()
      ->transform(CLI::CheckedTransformer(sources));
  app.add_option("--gyro-id", options.gyro_id, "key of this gyro on all topics, from 1")
      ->check(CLI::Range(1U, 4294967295U))
      ->capture_default_str();
  app.add_option("--model", options.source.model, "simulation: the twin's model file");
  app.add_option("--profile", options.source.profile, "simulation: what the experiment does");
  app.add_option("--seed", options.source.seed, "simulation: seed of all noise")
      ->capture_default_str();
  app.add_option("--rate", options.source.rate_hz,
                 "simulation: sample rate, Hz; the model's nominal rate without");
  app.add_option("--record", options.source.record, "record: a .csv, .csv.gz or .csv.xz file");
  app.add_option("--columns", options.source.columns, "record: names and units of a foreign CSV");
  app.add_option("--duration", options.source.duration_s,
                 "simulation, record: stop after so many seconds");
  app.add_option("--speed", options.speed, "simulation, record: times real time, or max")
      ->capture_default_str();
  app.add_option("--wait-for", options.wait_for,
                 "simulation, record: consumers to keep pace with; none with an empty value")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--device", options.serial.device, "serial: tty of the gyro");
  app.add_option("--baud", options.serial.baud_rate, "serial: line speed")->capture_default_str();
  app.add_option("--frame-rate", options.serial.frame_rate_hz, "serial: frames a second")
      ->capture_default_str();
  app.add_option("--rotation", options.serial.rotation, "serial: what the gyro sends")
      ->transform(CLI::CheckedTransformer(formats));
}

GyroPublisherNode::GyroPublisherNode(const GyroPublisherOptions& options)
    : options_(options),
      host_("gyro_publisher", options.network),
      pacer_(host_.participant(), options.gyro_id, options.wait_for),
      clock_(service::parse_speed(options.speed)),
      writer_(host_.participant(), host_.observer()),
      reference_writer_(host_.participant(), host_.observer()),
      temperature_writer_(host_.participant(), host_.observer()) {
  if (options_.source.kind == GyroSourceKind::kSerial) {
    serial_.emplace(options_.serial);
  } else {
    source_ = open_gyro_source(options_.source, [this](const std::string& line) {
      host_.raise({.code = "record_warning",
                   .severity = Severity::kWarning,
                   .text = line,
                   .gyro_id = options_.gyro_id,
                   .sensor_time_ns = 0});
    });
  }
}

int GyroPublisherNode::run() {
  std::thread publisher([this] {
    try {
      if (serial_) {
        publish_serial();
      } else {
        publish_source();
      }
    } catch (const std::exception& error) {
      failed_ = true;
      host_.raise({.code = "source_failed",
                   .severity = Severity::kError,
                   .text = error.what(),
                   .gyro_id = options_.gyro_id,
                   .sensor_time_ns = 0});
      // What was published before is still good.
      service::wait_for_receipt(writer_, kPatience, stopping_);
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

void GyroPublisherNode::publish_source() {
  if (!wait_for_consumers()) return;
  bool first = true;
  while (!stopping_) {
    const auto reading = source_();
    if (!reading) return finish();
    if (first) first_sequence_ = reading->rate.sequence;
    clock_.wait_until(reading->rate.time, stopping_);
    if (!wait_for_room(reading->rate.sequence)) return;
    if (reading->reference) {
      publish(*reading->reference);
      // A consumer must know that references come before it meets the first rate.
      if (first) service::wait_for_receipt(reference_writer_, kPatience, stopping_);
    }
    publish(reading->rate);
    first = false;
  }
}

void GyroPublisherNode::publish(const core::AngularRateSample& sample) {
  auto message = dds::to_message(sample, options_.gyro_id, service::monotonic_ns());
  newest_sequence_ = sample.sequence;
  if (writer_.write(message)) {
    ++published_;
  } else {
    ++refused_;
  }
}

void GyroPublisherNode::publish(const core::RateReferenceSample& reference) {
  auto message = dds::to_message(reference, options_.gyro_id);
  reference_writer_.write(message);
}

bool GyroPublisherNode::wait_for_consumers() {
  if (!pacer_.anybody_to_wait_for()) return true;
  bool told = false;
  for (auto waited = 0ms; !stopping_; waited += kStopCheck) {
    // A consumer announces itself before its reader may be known here: no sample goes out into the
    // void.
    if (pacer_.wait_for_consumers(kStopCheck) && writer_.matched() > 0) return true;
    if (pacer_.missing_consumers().empty()) std::this_thread::sleep_for(1ms);
    if (waited < kPatience || told) continue;
    told = true;
    host_.raise({.code = "waiting_for_consumers",
                 .severity = Severity::kInformation,
                 .text = "waiting for " + pacer_.missing_consumers() + " (--wait-for)",
                 .gyro_id = options_.gyro_id,
                 .sensor_time_ns = 0});
  }
  return false;
}

bool GyroPublisherNode::wait_for_room(std::uint64_t sequence) {
  while (!pacer_.wait_for_room(sequence, first_sequence_, kStopCheck)) {
    if (stopping_) return false;
  }
  return true;
}

// The end is reached when every consumer has taken everything.
void GyroPublisherNode::finish() {
  service::wait_for_receipt(writer_, kPatience, stopping_);
  while (!stopping_ && !pacer_.wait_for_all(newest_sequence_, first_sequence_, kStopCheck)) {
  }
  finished_ = true;
}

void GyroPublisherNode::publish_serial() {
  while (!stopping_) {
    const auto result = serial_->wait(kStopCheck);
    const core::SensorTime now{service::unix_time_ns()};
    if (result == drivers::SerialStatus::kGone) {
      host_.raise(
          {.code = "device_gone",
           .severity = Severity::kError,
           .text = options_.serial.device + ": hung up or unplugged; trying to open it again",
           .gyro_id = options_.gyro_id,
           .sensor_time_ns = now.count()});
      std::this_thread::sleep_for(kReopenEvery);
      try {
        serial_->reopen();
      } catch (const drivers::DriverError&) {
        continue;  // told above; tried again
      }
    }
    for (const auto& reading : serial_->read(now)) {
      publish(reading.rate);
      auto temperature = dds::to_message(reading.temperature, options_.gyro_id);
      temperature_writer_.write(temperature);
    }
    tell_of_link(serial_->statistics());
  }
}

void GyroPublisherNode::tell_of_link(const drivers::KvhLinkStatistics& now) {
  const auto tell = [&](const char* code, const char* what, std::uint64_t before,
                        std::uint64_t after) {
    host_.raise_counted({.code = code,
                         .severity = Severity::kWarning,
                         .text = options_.serial.device + ": " + what,
                         .gyro_id = options_.gyro_id,
                         .sensor_time_ns = 0},
                        after - before);
  };
  tell("crc_error", "a frame with a wrong CRC was dropped", told_link_.crc_errors, now.crc_errors);
  tell("bytes_skipped", "bytes outside any frame were skipped", told_link_.bytes_skipped,
       now.bytes_skipped);
  tell("frames_missing", "sequence numbers of the gyro are missing", told_link_.frames_missing,
       now.frames_missing);
  told_link_ = now;
}

service::Status GyroPublisherNode::status() const {
  service::Status status;
  status.state = published_ > 0 ? service::State::kRunning : service::State::kWaiting;
  status.metrics = {{"samples_published", "1", static_cast<double>(published_)},
                    {"samples_refused", "1", static_cast<double>(refused_)},
                    {"finished", "1", finished_ ? 1.0 : 0.0}};
  status.summary = std::to_string(published_) + " samples published";
  return status;
}

}  // namespace zerodrift::services
