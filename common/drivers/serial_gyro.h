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

// Time for frames that carry none: host time of arrival, with the jitter of the host taken off.
// Frames that arrive together are spread over the time since the last arrival by their sequence
// numbers. The estimate follows the earliest arrivals, since a frame can only be late:
// Host time may never be set back, but for restart().
//   t_k = min(host time, t_(k-1) + step (1 + 2e-4) / rate),   always after t_(k-1)
// where 2e-4 is more than a gyro's crystal can be slow. It starts afresh at the host time where
// that is more than 1 s ahead, or 0.1 s where frames are missing, for then 128 more may be missing
// unseen.
class ArrivalClock {
 public:
  explicit ArrivalClock(double frame_rate_hz) noexcept;

  // Time of a frame `step` after the last one. host_time is when it was read.
  core::SensorTime stamp(core::SensorTime host_time, std::uint64_t step) noexcept;
  // Host time was set anew, forward or back: the next frame is stamped with it.
  void restart() noexcept { last_.reset(); }

 private:
  double period_ns_;
  std::optional<core::SensorTime> last_;
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
  void restart_time() noexcept { clock_.restart(); }
  // Opens the device again after it was gone; sequence and time go on. Throws DriverError.
  void reopen();

  // The frames that what is there completes, none to many; valid until the next call. No
  // allocation. A device that is gone gives none; wait() says that it is gone.
  [[nodiscard]] std::span<const SerialGyroReading> read(core::SensorTime host_time) noexcept;

  [[nodiscard]] const KvhLinkStatistics& statistics() const noexcept {
    return parser_.statistics();
  }

 private:
  static constexpr std::size_t kBytesAtOnce = 4096;

  void convert(const KvhFrame& frame, core::SensorTime host_time,
               SerialGyroReading& reading) noexcept;

  SerialGyroOptions options_;
  SerialPort port_;
  KvhFrameParser parser_;
  ArrivalClock clock_;
  std::uint64_t last_sequence_ = 0;
  std::array<std::uint8_t, kBytesAtOnce> bytes_{};
  std::array<SerialGyroReading, kBytesAtOnce / kKvhFrameSize + 1> readings_;
};

}  // namespace zerodrift::drivers
