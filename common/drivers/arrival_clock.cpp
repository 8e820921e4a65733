// SPDX-License-Identifier: Apache-2.0
#include "common/drivers/arrival_clock.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace zerodrift::drivers {
namespace {

using core::SensorTime;
using namespace std::chrono_literals;

constexpr double kCrystalTolerance = 2e-4;
constexpr double kLateInLaps = 0.75;
constexpr SensorTime kShortestLag = 50ms;  // longer than a USB adapter holds bytes back
constexpr SensorTime kLongestLag = 100ms;

constexpr SensorTime kWindow = 500ms;
constexpr double kOffNs = 40e6;

}  // namespace

ArrivalClock::ArrivalClock(double frame_rate_hz, unsigned lap) noexcept
    : period_ns_(1e9 / frame_rate_hz),
      lap_(lap),
      longest_lag_(std::clamp(periods(kLateInLaps * lap_), kShortestLag, kLongestLag)) {}

SensorTime ArrivalClock::periods(double count) const noexcept {
  return SensorTime{std::llround(count * period_ns_)};
}

void ArrivalClock::begin_read(SensorTime host_time, std::size_t frames, bool was_full) noexcept {
  host_time_ = host_time;
  behind_ = frames;
  is_backlog_ = was_full || was_full_;
  was_full_ = was_full;
}

ArrivalClock::Stamp ArrivalClock::next(std::uint64_t step) noexcept {
  --behind_;
  Stamp stamp{.arrival = host_time_ - periods(static_cast<double>(behind_))};
  bool starts_afresh = !last_;
  if (last_arrival_) {
    const SensorTime on_time = *last_arrival_ + periods(static_cast<double>(step));
    if (is_backlog_) stamp.arrival = std::min(host_time_, on_time);
    const SensorTime late = stamp.arrival - on_time;
    if (late > longest_lag_) {
      const double laps = std::round(static_cast<double>(late.count()) / (lap_ * period_ns_));
      stamp.lost = static_cast<std::uint64_t>(laps * lap_);
      starts_afresh = true;
    }
  }
  last_arrival_ = stamp.time = stamp.arrival;
  if (last_) {
    const SensorTime predicted =
        *last_ + periods(static_cast<double>(step) * (1.0 + kCrystalTolerance));
    if (!starts_afresh && stamp.arrival - predicted <= kLongestLag)
      stamp.time = std::min(stamp.arrival, predicted);
    stamp.time = std::max(stamp.time, *last_ + SensorTime{1});
  }
  last_ = stamp.time;
  return stamp;
}

void ArrivalClock::restart() noexcept {
  last_arrival_.reset();
  last_.reset();
}

void FrameRateWatch::note(SensorTime arrival, bool follows) noexcept {
  if (!follows) restart();
  if (frames_ == 0) began_ = window_began_ = arrival;
  const Earliest frame{.arrival = arrival,
                       .frame = frames_,
                       .late_ns = static_cast<double>((arrival - began_).count()) -
                                  static_cast<double>(frames_) * period_ns_};
  ++frames_;
  if (!earliest_ || frame.late_ns < earliest_->late_ns) earliest_ = frame;
  if (arrival - window_began_ < kWindow) return;
  windows_.push_overwriting(*earliest_);
  earliest_.reset();
  window_began_ = arrival;
  judge();
}

void FrameRateWatch::judge() noexcept {
  if (other_rate_hz_) {
    const bool is_over = windows_.size() > found_lag_ && std::abs(off_ns(found_lag_, 0)) <= kOffNs;
    if (!is_over) return;
    other_rate_hz_.reset();
    restart();
    return;
  }
  for (std::size_t lag = 1; 2 * lag < windows_.size(); lag *= 2) {
    const double off = off_ns(lag, 0);
    const double before = off_ns(lag, lag);
    if (std::min(std::abs(off), std::abs(before)) <= kOffNs || (off > 0.0) != (before > 0.0))
      continue;
    const Earliest& newest = windows_.back();
    const Earliest& oldest = windows_[windows_.size() - 1 - 2 * lag];
    const auto elapsed_ns = static_cast<double>((newest.arrival - oldest.arrival).count());
    other_rate_hz_ = 1e9 * static_cast<double>(newest.frame - oldest.frame) / elapsed_ns;
    found_lag_ = lag;
    return;
  }
}

void FrameRateWatch::restart() noexcept {
  frames_ = 0;
  earliest_.reset();
  windows_.clear();
}

}  // namespace zerodrift::drivers
