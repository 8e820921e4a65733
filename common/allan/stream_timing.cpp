// SPDX-License-Identifier: Apache-2.0
#include "common/allan/stream_timing.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::allan {
namespace {

constexpr double kSameWithin = 0.5;      // of an interval
constexpr double kNewRateBeyond = 0.05;  // of the interval
constexpr double kOneRateWithin = 0.025;
constexpr std::uint64_t kUnknownGap = 1;

// Defined for any two times: the difference of two far ends does not fit a signed one.
double elapsed_s(core::SensorTime from, core::SensorTime to) {
  return static_cast<double>(static_cast<std::uint64_t>(to.count()) -
                             static_cast<std::uint64_t>(from.count())) *
         1e-9;
}

bool is_possible(double interval_s) {
  return interval_s >= StreamTiming::kShortestIntervalS &&
         interval_s <= StreamTiming::kLongestIntervalS;
}

bool differ(double a, double b, double by) {
  return std::abs(a - b) > by * b;
}

bool is_about(double value, double expected) {
  return std::abs(value - expected) < kSameWithin * expected;
}

}  // namespace

Placement StreamTiming::place(core::SensorTime time, double interval_s) noexcept {
  if (!(std::isfinite(interval_s) && interval_s > 0.0)) return {Arrival::kRefused, 0};
  if (interval_s_ == 0.0) {
    if (!is_possible(interval_s)) return {Arrival::kRefused, 0};
    interval_s_ = interval_s;
    newest_ = time;
    return {Arrival::kFirst, 0};
  }
  if (time <= newest_) return behind(time);
  behind_run_ = 0;
  if (note_interval(interval_s) == Rate::kNew) {
    forget_steps();
    newest_ = time;
    return {Arrival::kNewRate, 0};
  }
  const double since_newest_s = elapsed_s(newest_, time);
  if (!is_about(interval_s, interval_s_) && !is_about(interval_s, since_newest_s))
    return {Arrival::kOtherInterval, 0};
  const double steps = since_newest_s / interval_s_;
  const bool gap = steps >= 1.0 + kSameWithin;
  if (!gap) {
    stepped_ += time - newest_;
    ++steps_;
  }
  newest_ = time;
  return {Arrival::kNext, gap ? static_cast<std::uint64_t>(std::llround(steps)) - 1 : 0};
}

Placement StreamTiming::behind(core::SensorTime time) noexcept {
  const bool goes_on = behind_run_ > 0 && time > behind_;
  behind_run_ = goes_on ? behind_run_ + 1 : 1;
  behind_ = time;
  if (behind_run_ < kToBelieve)
    return {time == newest_ ? Arrival::kDuplicate : Arrival::kBehind, 0};
  behind_run_ = 0;
  forget_intervals();
  newest_ = time;
  return {Arrival::kTimeRestarted, kUnknownGap};
}

StreamTiming::Rate StreamTiming::note_interval(double interval_s) noexcept {
  shortest_s_ = intervals_ == 0 ? interval_s : std::min(shortest_s_, interval_s);
  longest_s_ = intervals_ == 0 ? interval_s : std::max(longest_s_, interval_s);
  interval_sum_s_ += interval_s;
  if (++intervals_ < kToBelieve) return Rate::kSame;
  const double mean_s = interval_sum_s_ / kToBelieve;
  const bool even = is_about(shortest_s_, mean_s) && is_about(longest_s_, mean_s);
  const double before_s = candidate_s_;
  forget_intervals();
  if (!even || !is_possible(mean_s) || !differ(mean_s, interval_s_, kNewRateBeyond))
    return Rate::kSame;
  candidate_s_ = mean_s;
  if (differ(before_s, mean_s, kOneRateWithin)) return Rate::kSame;
  candidate_s_ = 0.0;
  interval_s_ = mean_s;
  return Rate::kNew;
}

double StreamTiming::mean_interval_s() const noexcept {
  return steps_ == 0 ? interval_s_
                     : static_cast<double>(stepped_.count()) / static_cast<double>(steps_) /
                           static_cast<double>(core::kNsPerS);
}

void StreamTiming::forget_steps() noexcept {
  stepped_ = core::SensorTime{0};
  steps_ = 0;
}

void StreamTiming::forget_intervals() noexcept {
  intervals_ = 0;
  interval_sum_s_ = shortest_s_ = longest_s_ = candidate_s_ = 0.0;
}

}  // namespace zerodrift::allan
