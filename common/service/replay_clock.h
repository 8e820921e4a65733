// SPDX-License-Identifier: Apache-2.0
// Wall-clock pacing of a replay.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/core/time.h"

namespace zerodrift::service {

// "1", "60", "0.5" or "max" (nothing). Throws std::invalid_argument.
inline std::optional<double> parse_speed(const std::string& text) {
  if (text == "max") return std::nullopt;
  std::size_t used = 0;
  double speed = 0.0;
  try {
    speed = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size() || !(speed > 0.0) || speed > 1e6) {
    throw std::invalid_argument("--speed: found '" + text +
                                "', expected a number above 0, at most 1e6, or max");
  }
  return speed;
}

// Sleeps until a sample is due at `speed` times real time. A replay that falls behind its consumers
// by more than a tenth of a second goes on from there instead of rushing to catch up.
class ReplayClock {
 public:
  explicit ReplayClock(std::optional<double> speed) : speed_(speed) {}

  // Returns early once `stopping` is set.
  void wait_until(core::SensorTime time, const std::atomic<bool>& stopping = kNobodyStops) {
    if (!speed_) return;
    using Clock = std::chrono::steady_clock;
    if (!first_) {
      first_ = time;
      start_ = Clock::now();
      return;
    }
    const auto offset = std::chrono::duration<double>(core::seconds(time - *first_) / *speed_);
    const auto due = start_ + std::chrono::duration_cast<Clock::duration>(offset);
    const auto now = Clock::now();
    if (now > due + kLargestLag) start_ += now - due;
    if (due - now <= kShortestSleep) return;
    while (!stopping && Clock::now() < due) {
      std::this_thread::sleep_until(std::min<Clock::time_point>(due, Clock::now() + kStopCheck));
    }
  }

 private:
  inline static const std::atomic<bool> kNobodyStops{false};
  static constexpr std::chrono::milliseconds kLargestLag{100};
  static constexpr std::chrono::milliseconds kStopCheck{100};
  static constexpr std::chrono::microseconds kShortestSleep{
      200};  // shorter ones cost more than they pace

  std::optional<double> speed_;
  std::optional<core::SensorTime> first_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace zerodrift::service
