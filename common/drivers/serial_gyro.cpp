// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/serial_gyro.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "common/core/units.h"

namespace zerodrift::drivers {
namespace {

constexpr double kCrystalTolerance = 2e-4;
constexpr core::SensorTime kLongestBacklog = std::chrono::seconds{1};
constexpr core::SensorTime kLongestLoss = std::chrono::milliseconds{100};

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

ArrivalClock::ArrivalClock(double frame_rate_hz) noexcept : period_ns_(1e9 / frame_rate_hz) {}

core::SensorTime ArrivalClock::stamp(core::SensorTime host_time, std::uint64_t step) noexcept {
  core::SensorTime time = host_time;
  if (last_) {
    const double ahead_ns = static_cast<double>(step) * period_ns_ * (1.0 + kCrystalTolerance);
    const core::SensorTime predicted = *last_ + core::SensorTime{std::llround(ahead_ns)};
    if (host_time - predicted <= (step == 1 ? kLongestBacklog : kLongestLoss))
      time = std::min(host_time, predicted);
    time = std::max(time, *last_ + core::SensorTime{1});
  }
  last_ = time;
  return time;
}

SerialGyro::SerialGyro(SerialGyroOptions options)
    : options_(checked(std::move(options))),
      port_(options_.device, options_.baud_rate),
      clock_(options_.frame_rate_hz) {
  for (SerialGyroReading& reading : readings_) {
    reading.rate.interval_s = 1.0 / options_.frame_rate_hz;
    reading.rate.clock = core::ClockSource::kHost;
    reading.temperature.probe = options_.probe;
    reading.temperature.clock = core::ClockSource::kHost;
  }
}

void SerialGyro::reopen() {
  port_ = SerialPort{options_.device, options_.baud_rate};
}

std::span<const SerialGyroReading> SerialGyro::read(core::SensorTime host_time) noexcept {
  std::size_t count = 0;
  const std::size_t byte_count = port_.read(bytes_).bytes;
  for (const std::uint8_t byte : std::span{bytes_}.first(byte_count)) {
    if (const auto frame = parser_.push(byte)) convert(*frame, host_time, readings_[count++]);
  }
  return std::span{readings_}.first(count);
}

void SerialGyro::convert(const KvhFrame& frame, core::SensorTime host_time,
                         SerialGyroReading& reading) noexcept {
  const std::uint64_t sequence = parser_.unwrapped_sequence();
  const double scale = rate_scale(options_.rotation, options_.frame_rate_hz);
  reading.rate.sequence = sequence;
  reading.rate.time = clock_.stamp(host_time, sequence - last_sequence_);
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    reading.rate.rate_radps[i] = static_cast<double>(frame.rotation[i]) * scale;
    reading.rate.valid[i] = frame.rotation_valid[i] && std::isfinite(frame.rotation[i]);
  }
  reading.temperature.sequence = sequence;
  reading.temperature.time = reading.rate.time;
  reading.temperature.temperature_degc = to_degc(frame.temperature, options_.temperature);
  last_sequence_ = sequence;
}

}  // namespace zerodrift::drivers
