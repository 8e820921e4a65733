// SPDX-License-Identifier: Apache-2.0
// The numbers of a recorded gyro's samples over all runs of its publisher. One that is started
// again counts from the beginning; what had been answered live would be taken for repeats.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/core/samples.h"

namespace zerodrift::record {

class RunNumbers {
 public:
  // The sample's number, in the order of their arrival: its own in the first run, and such as go on
  // from the newest in later ones. A late sample has an earlier number that is near; a clock may
  // be set back between two runs. Nothing: numbers go on where an earlier run ended, so two
  // publishers spoke at once. O(1).
  [[nodiscard]] std::optional<std::uint64_t> number(
      const core::AngularRateSample& sample) noexcept {
    const std::uint64_t own = sample.sequence;
    if (!newest_) {
      newest_ = own;
      latest_ = sample.time;
      return own;
    }
    const std::uint64_t back = *newest_ - std::min(own, *newest_);
    const bool is_far_back = back > kFarthest;
    const bool is_first_again = back > 0 && own <= kFirst && sample.time > latest_;
    const bool begins_anew = is_far_back || is_first_again;
    latest_ = std::max(latest_, sample.time);
    if (begins_anew) {
      left_at_ = newest_;
      ahead_ += *newest_ + 1 - own;  // modulo 2^64, as the sum below
      ++later_runs_;
      newest_ = own;
    } else if (own > *newest_) {
      const bool has_jumped = own - *newest_ > kFarthest;
      if (left_at_ && has_jumped && own > *left_at_ && own - *left_at_ <= kFarthest)
        return std::nullopt;
      newest_ = own;
    }
    return own + ahead_;
  }
  [[nodiscard]] std::uint64_t later_runs() const noexcept { return later_runs_; }

 private:
  static constexpr std::uint64_t kFarthest = 64;  // that samples come late, or are lost in a row
  static constexpr std::uint64_t kFirst = 1;      // publishers count from 0, or from 1

  std::optional<std::uint64_t> newest_{};  // own number
  core::SensorTime latest_{};
  std::optional<std::uint64_t> left_at_{};  // where the run before ended
  std::uint64_t ahead_ = 0;                 // of the present run's own numbers
  std::uint64_t later_runs_ = 0;
};

// How often a probe's readings go on from an earlier number than the newest, though not from the
// beginning: a publisher numbers its own upwards, so that two of them spoke in turn. What of a run
// that begins was lost may look the same, once a run.
class ReadingNumbers {
 public:
  void note(const core::TemperatureSample& reading) noexcept {
    const bool goes_on = newest_ && reading.time > latest_;
    if (goes_on && reading.sequence <= *newest_ && reading.sequence > kFirst) ++falls_;
    latest_ = newest_ ? std::max(latest_, reading.time) : reading.time;
    newest_ = reading.sequence;
  }
  [[nodiscard]] bool are_of_two_publishers() const noexcept { return falls_ >= kFalls; }

 private:
  static constexpr std::uint64_t kFirst = 1;  // publishers count from 0, or from 1
  static constexpr std::uint64_t kFalls = 3;

  std::optional<std::uint64_t> newest_{};
  core::SensorTime latest_{};
  std::uint64_t falls_ = 0;
};

}  // namespace zerodrift::record
