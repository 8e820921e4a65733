// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/serial_gyro.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/core/units.h"

namespace zerodrift::drivers {
namespace {

SerialGyroOptions checked(SerialGyroOptions options) {
  if (const auto wrong = options.validate()) throw std::invalid_argument(*wrong);
  return options;
}

double rate_scale(RotationFormat format, double frame_rate_hz) {
  switch (format) {
    case RotationFormat::kDeltaAngleRad: return frame_rate_hz;
    case RotationFormat::kDeltaAngleDeg: return frame_rate_hz * core::kRadPerDeg;
    case RotationFormat::kRateRadps: return 1.0;
    case RotationFormat::kRateDegps: return core::kRadPerDeg;
  }
  return 1.0;
}

double to_degc(std::int16_t value, TemperatureFormat format) {
  const double number = value;
  switch (format) {
    case TemperatureFormat::kDegC: return number;
    case TemperatureFormat::kHundredthDegC: return number / 100.0;
    case TemperatureFormat::kDegF: return (number - 32.0) / 1.8;
    case TemperatureFormat::kHundredthDegF: return (number / 100.0 - 32.0) / 1.8;
  }
  return number;
}

}  // namespace

std::optional<std::string> SerialGyroOptions::validate() const {
  if (device.empty()) return "device: is empty; expected a serial device such as /dev/ttyUSB0";
  if (!(frame_rate_hz >= 1.0 && frame_rate_hz <= 5000.0)) {
    return "frame_rate_hz: " + std::to_string(frame_rate_hz) +
           "; expected 1 to 5000, as the gyro was set up";
  }
  if (probe.empty())
    return "probe: is empty; expected a name for the gyro's thermometer, such as case";
  return std::nullopt;
}

SerialGyro::SerialGyro(SerialGyroOptions options)
    : options_(checked(std::move(options))),
      port_(options_.device, options_.baud_rate),
      clock_(options_.frame_rate_hz, kKvhSequenceModulus),
      watch_(options_.frame_rate_hz) {
  for (SerialGyroReading& reading : readings_) {
    reading.rate.interval_s = 1.0 / options_.frame_rate_hz;
    reading.rate.clock = core::ClockSource::kHost;
    reading.temperature.probe = options_.probe;
    reading.temperature.clock = core::ClockSource::kHost;
  }
}

std::span<const SerialGyroReading> SerialGyro::read(core::SensorTime host_time) noexcept {
  std::size_t count = 0;
  const std::size_t byte_count = port_.read(bytes_).bytes;
  for (const std::uint8_t byte : std::span{bytes_}.first(byte_count)) {
    const std::uint64_t before = parser_.unwrapped_sequence();
    if (const auto frame = parser_.push(byte))
      received_[count++] = {.frame = *frame, .step = parser_.unwrapped_sequence() - before};
  }
  clock_.begin_read(host_time, count, byte_count >= kFullRead);
  for (std::size_t i = 0; i < count; ++i) convert(received_[i], readings_[i]);
  return std::span{readings_}.first(count);
}

void SerialGyro::convert(const Received& received, SerialGyroReading& reading) noexcept {
  const KvhFrame& frame = received.frame;
  const auto [time, arrival, lost] = clock_.next(received.step);
  laps_lost_ += lost;
  sequence_ += received.step + lost;
  watch_.note(arrival, received.step == 1 && lost == 0);
  const double scale = rate_scale(options_.rotation, options_.frame_rate_hz);
  const bool has_unit = !watch_.other_rate_hz();
  reading.rate.sequence = sequence_;
  reading.rate.time = time;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    reading.rate.rate_radps[i] = static_cast<double>(frame.rotation[i]) * scale;
    reading.rate.valid[i] =
        has_unit && frame.rotation_valid[i] && core::is_rate(reading.rate.rate_radps[i]);
  }
  reading.temperature.sequence = sequence_;
  reading.temperature.time = time;
  reading.temperature.temperature_degc = to_degc(frame.temperature, options_.temperature);
}

KvhLinkStatistics SerialGyro::statistics() const noexcept {
  KvhLinkStatistics statistics = parser_.statistics();
  statistics.frames_missing += laps_lost_;
  return statistics;
}

}  // namespace zerodrift::drivers
