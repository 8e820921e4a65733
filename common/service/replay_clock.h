// SPDX-License-Identifier: Apache-2.0
// Wall-clock pacing of a replay.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/core/time.h"

namespace zerodrift::service {

// "1", "60", "60x", "0.5" or "max" (nothing). Throws std::invalid_argument that begins with what
// was given.
inline std::optional<double> parse_speed(const std::string& text,
                                         const std::string& given = "--speed") {
  if (text == "max") return std::nullopt;
  std::size_t used = 0;
  double speed = 0.0;
  try {
    speed = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  const bool is_whole = used == text.size() || text.substr(used) == "x";
  if (used == 0 || !is_whole || !(speed > 0.0) || speed > 1e6) {
    throw std::invalid_argument(
        given + ": found '" + text +
        "', expected times real time above 0, at most 1e6 (60 or 60x), or max");
  }
  return speed;
}

// Sleeps until a sample is due at `speed` times real time. A replay that falls behind its consumers
// by more than a tenth of a second goes on from there instead of rushing to catch up. One thread
// waits; any may change the pace, with effect within a tenth of a second.
class ReplayClock {
 public:
  explicit ReplayClock(std::optional<double> speed) : speed_(speed) {}

  // Nothing: as fast as possible.
  void set_speed(std::optional<double> speed) {
    const std::lock_guard lock(mutex_);
    speed_ = speed;
    first_.reset();
  }
  void pause() {
    const std::lock_guard lock(mutex_);
    paused_ = true;
  }
  void resume() {
    const std::lock_guard lock(mutex_);
    paused_ = false;
    first_.reset();
  }

  // Returns early once `stopping` is set.
  void wait_until(core::SensorTime time, const std::atomic<bool>& stopping = kNobodyStops) {
    for (auto until = wake_up_at(time); until && !stopping; until = wake_up_at(time))
      std::this_thread::sleep_until(*until);
  }

 private:
  using Clock = std::chrono::steady_clock;
  inline static const std::atomic<bool> kNobodyStops{false};
  static constexpr std::chrono::milliseconds kLargestLag{100};
  static constexpr std::chrono::milliseconds kStopCheck{100};
  static constexpr std::chrono::microseconds kShortestSleep{
      200};  // shorter ones cost more than they pace

  // When to look again; nothing: the sample is due.
  std::optional<Clock::time_point> wake_up_at(core::SensorTime time) {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (paused_) return now + kStopCheck;
    if (!speed_) return std::nullopt;
    if (!first_) {
      first_ = time;
      start_ = now;
    }
    const auto offset = std::chrono::duration<double>(core::seconds(time - *first_) / *speed_);
    const auto due = start_ + std::chrono::duration_cast<Clock::duration>(offset);
    if (now > due + kLargestLag) start_ += now - due;
    if (due - now <= kShortestSleep) return std::nullopt;
    return std::min<Clock::time_point>(due, now + kStopCheck);
  }

  std::mutex mutex_;
  std::optional<double> speed_;
  bool paused_ = false;
  std::optional<core::SensorTime> first_;
  Clock::time_point start_;
};

}  // namespace zerodrift::service
