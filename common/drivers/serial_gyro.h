// SPDX-License-Identifier: Apache-2.0
// A KVH gyro on a serial port as angular rate and temperature samples.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/core/samples.h"
#include "common/drivers/arrival_clock.h"
#include "common/drivers/kvh_frame.h"
#include "common/drivers/serial_port.h"

namespace zerodrift::drivers {

// What the gyro was set up to send (KVH commands =rotfmt and =rotunits).
enum class RotationFormat : std::uint8_t { kDeltaAngleRad, kDeltaAngleDeg, kRateRadps, kRateDegps };

// KVH command =tempunits.
enum class TemperatureFormat : std::uint8_t { kDegC, kHundredthDegC, kDegF, kHundredthDegF };

struct SerialGyroOptions {
  std::string device;  // "/dev/ttyUSB0"
  unsigned baud_rate = 921600;
  double frame_rate_hz = 1000.0;  // as the gyro was set up (=dr)
  RotationFormat rotation = RotationFormat::kDeltaAngleRad;
  TemperatureFormat temperature = TemperatureFormat::kDegC;
  std::string probe = "case";  // name of the thermometer within the gyro

  // The key that is wrong and what would be right.
  [[nodiscard]] std::optional<std::string> validate() const;
};

struct SerialGyroReading {
  core::AngularRateSample rate;         // sequence counts missing frames too; clock kHost
  core::TemperatureSample temperature;  // the same sequence, time and clock
};

class SerialGyro {
 public:
  // Throws std::invalid_argument for wrong options, DriverError for a device that can't be used.
  explicit SerialGyro(SerialGyroOptions options);

  // Waits until bytes are there. Take the host's time right after it, for read().
  [[nodiscard]] SerialStatus wait(std::chrono::milliseconds timeout) noexcept {
    return port_.wait(timeout);
  }

  // Host time was set anew: sensor time goes on from there.
  void restart_time() noexcept {
    clock_.restart();
    watch_.restart();
  }
  // Opens the device again after it was gone; sequence and time go on. The old one is closed first:
  // as long as it is held, the device comes back under another name. Throws DriverError.
  void reopen() { port_.reopen(); }

  // The frames that what is there completes, none to many; valid until the next call. No
  // allocation. A device that is gone gives none; wait() says that it is gone.
  [[nodiscard]] std::span<const SerialGyroReading> read(core::SensorTime host_time) noexcept;

  [[nodiscard]] KvhLinkStatistics statistics() const noexcept;
  // What the gyro sends instead of frame_rate_hz, frames a second. As long as it does, what it
  // measures has no unit, no interval and no time: no axis is valid.
  [[nodiscard]] std::optional<double> other_rate_hz() const noexcept {
    return watch_.other_rate_hz();
  }

 private:
  static constexpr std::size_t kBytesAtOnce = 4096;  // as a tty holds
  static constexpr std::size_t kFullRead = 3 * kBytesAtOnce / 4;
  struct Received {
    KvhFrame frame{};
    std::uint64_t step = 0;  // from the number of the frame before
  };

  void convert(const Received& received, SerialGyroReading& reading) noexcept;

  SerialGyroOptions options_;
  SerialPort port_;
  KvhFrameParser parser_;
  ArrivalClock clock_;
  FrameRateWatch watch_;
  std::uint64_t sequence_ = 0;
  std::uint64_t laps_lost_ = 0;  // frames that their numbers don't tell of
  std::array<std::uint8_t, kBytesAtOnce> bytes_{};
  std::array<Received, kBytesAtOnce / kKvhFrameSize + 1> received_{};
  std::array<SerialGyroReading, kBytesAtOnce / kKvhFrameSize + 1> readings_;
};

}  // namespace zerodrift::drivers
