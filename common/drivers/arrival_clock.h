// SPDX-License-Identifier: Apache-2.0
// Time for the frames of a gyro that sends none, and whether it sends as many as it was said to.
// One thread; O(1) a frame, no allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/core/ring_buffer.h"
#include "common/core/time.h"

namespace zerodrift::drivers {

// Host time of arrival, with the jitter of the host taken off. A frame can only be late, so that
// the estimate follows the earliest arrivals:
//   t_k = min(arrival, t_(k-1) + step (1 + 2e-4) / rate),   always after t_(k-1)
// where 2e-4 is more than a gyro's crystal can be slow. A frame arrives with what is read at once,
// one period a frame before the last of these. Where a read found the buffer full, which is what a
// host that slept finds, each frame counts as on time after the one before: what had no room came
// last.
//
// A frame that comes later than its number says by three quarters of a lap of numbers (at least
// 50 ms, at most 100 ms) follows a silence, or a loss of whole laps: it starts afresh at its
// arrival, and as many laps as fit count as lost. Host time may never be set back, but for
// restart().
class ArrivalClock {
 public:
  // Numbers of frames go from 0 to lap - 1.
  ArrivalClock(double frame_rate_hz, unsigned lap) noexcept;

  // `frames` were read at `host_time`; there may be more, where the read was full.
  void begin_read(core::SensorTime host_time, std::size_t frames, bool was_full) noexcept;

  struct Stamp {
    core::SensorTime time{0};
    core::SensorTime arrival{0};
    std::uint64_t lost = 0;  // whole laps of frames before this one, beyond its step
  };
  // The next of these frames, by its number `step` after the last one: 1 to lap.
  Stamp next(std::uint64_t step) noexcept;

  // Host time was set anew, forward or back: the next frame is stamped with its arrival.
  void restart() noexcept;

 private:
  [[nodiscard]] core::SensorTime periods(double count) const noexcept;

  double period_ns_;
  double lap_;
  core::SensorTime longest_lag_;
  core::SensorTime host_time_{0};
  std::size_t behind_ = 0;  // frames of this read that are still to come
  bool was_full_ = false;
  bool is_backlog_ = false;
  std::optional<core::SensorTime> last_arrival_;
  std::optional<core::SensorTime> last_;
};

// Compares what arrives with the rate that the gyro is said to send at, by the earliest arrival of
// each half second: whatever the host does, frames can only be late. Off by more than 40 ms over
// some time, and over as much time before that to the same side, is another rate. Such a time is
// 0.5 s to 32 s: 10 % are found within two seconds, 0.15 % in little more than a minute.
class FrameRateWatch {
 public:
  explicit FrameRateWatch(double frame_rate_hz) noexcept : period_ns_(1e9 / frame_rate_hz) {}

  // A frame arrived; `follows` the one before without a loss between them.
  void note(core::SensorTime arrival, bool follows) noexcept;
  // Host time was set anew. What was found stays until there is another finding.
  void restart() noexcept;

  // What it sends instead, frames a second; nothing as long as nothing speaks against what was
  // said.
  [[nodiscard]] std::optional<double> other_rate_hz() const noexcept { return other_rate_hz_; }

 private:
  struct Earliest {
    core::SensorTime arrival{0};
    std::uint64_t frame = 0;
    double late_ns = 0.0;
  };
  static constexpr std::size_t kLongestLag = 64;
  void judge() noexcept;
  // Over `lag` windows that ended `ago` windows ago. There are as many.
  [[nodiscard]] double off_ns(std::size_t lag, std::size_t ago) const noexcept {
    const std::size_t newest = windows_.size() - 1 - ago;
    return windows_[newest].late_ns - windows_[newest - lag].late_ns;
  }

  double period_ns_;
  std::uint64_t frames_ = 0;
  core::SensorTime began_{0};
  core::SensorTime window_began_{0};
  std::optional<Earliest> earliest_;
  core::RingBuffer<Earliest> windows_{2 * kLongestLag + 1};
  std::size_t found_lag_ = 1;
  std::optional<double> other_rate_hz_;
};

}  // namespace zerodrift::drivers
