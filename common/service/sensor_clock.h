// SPDX-License-Identifier: Apache-2.0
// Sensor time of sensors that have no clock of their own: the host's monotonic clock, put to Unix
// time once, so that processes of one host that start at different times agree. Where the wall
// clock is stepped, each of them follows it: by then a process that starts would begin there.
//
// A step is believed when a second look finds the same: a clock that stands still, or runs at
// another pace, is not followed. Sensor time goes on at the monotonic clock's pace.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "common/core/time.h"

namespace zerodrift::service {

class Host;

// Both clocks at one moment.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t unix_ns = 0;
};

// Nothing where the process was held up between the two clocks: look again later.
[[nodiscard]] std::optional<ClockReading> read_clocks() noexcept;
// As read_clocks(), until it gives something.
[[nodiscard]] ClockReading await_clocks() noexcept;

class SensorClock {
 public:
  // Smaller steps are left alone: half of a leap second.
  static constexpr std::chrono::milliseconds kSmallestStep{500};
  // Between the two looks that a step takes.
  static constexpr std::chrono::milliseconds kConfirmAfter{100};
  // By which the two may differ.
  static constexpr std::chrono::milliseconds kConfirmWithin{20};
  // How long the wall clock may be elsewhere, and be nowhere to stay, until it is reported.
  static constexpr std::chrono::seconds kUnsteadyAfter{5};

  enum class Verdict : std::uint8_t {
    kSteady,
    kDoubted,   // it may have been stepped
    kStepped,   // sensor time follows it from now on
    kUnsteady,  // reported once: it is not followed
  };
  struct Look {
    Verdict verdict = Verdict::kSteady;
    std::chrono::nanoseconds step{0};  // how far the wall clock is ahead of sensor time, was before
  };

  explicit SensorClock(const ClockReading& now) noexcept
      : offset_ns_(now.unix_ns - now.monotonic_ns) {}

  [[nodiscard]] core::SensorTime at(std::int64_t monotonic_ns) const noexcept {
    return core::SensorTime{monotonic_ns + offset_ns_};
  }
  Look look(const ClockReading& now) noexcept;

 private:
  struct Doubt {
    std::int64_t offset_ns = 0;
    std::int64_t since_ns = 0;  // monotonic
  };
  std::int64_t offset_ns_;
  std::optional<Doubt> doubt_{};
  std::int64_t elsewhere_since_ns_ = 0;  // monotonic; only with doubt_
  bool reported_unsteady_ = false;
};

// Looks at both clocks, and reports a step or an unsteady wall clock. True: sensor time was set
// anew.
bool follow_wall_clock(SensorClock& clock, Host& host, std::uint32_t gyro_id);

// What the kernel knows of its clock's discipline, by whoever disciplines it (chronyd, ntpd,
// phc2sys): angular_rate's clock_locked and clock_offset_ns.
struct ClockDiscipline {
  enum class Lock : std::uint32_t { kUnknown = 0, kLocked = 1, kFree = 2 };
  Lock lock = Lock::kUnknown;
  std::int64_t offset_ns = 0;  // what is still to be added to the host's clock; 0 where unknown
};

// adjtimex(2), without changing anything: `state` is what it returned, `status` and `offset` the
// fields of its structure.
[[nodiscard]] ClockDiscipline discipline_of(int state, int status, std::int64_t offset) noexcept;
// Some 0.2 us.
[[nodiscard]] ClockDiscipline clock_discipline() noexcept;

}  // namespace zerodrift::service
