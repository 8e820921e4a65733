// SPDX-License-Identifier: Apache-2.0
// Where a sample belongs in an evenly sampled stream: next, after a gap, or nowhere. Statistics
// that count samples (rolling_allan.h) need every sample on its place or a gap instead.
//
// Rules. Sensor time alone decides; a sample a step and a half or more after the newest comes after
// a gap. A time that does not increase is no place: the sample is left out, and what it should have
// filled stays a gap. 32 such samples in a row whose times increase among themselves are a source
// that began anew: the stream goes on after a gap of unknown length. A sample whose interval is
// neither the stream's nor the time since the newest is a mean over another time, hence of another
// noise, and is left out. Two blocks of 32 intervals, each even and of one mean within 2.5 %, that
// differs from the stream's by more than 5 %, are a new rate, and everything counted in samples
// begins anew with it.
#pragma once

#include <cstdint>

#include "common/core/time.h"

namespace zerodrift::allan {

enum class Arrival : std::uint8_t {
  kNext,           // to be added after the missing ones; `missing` > 0 is a gap
  kFirst,          // of a stream: interval_s() is known from here on
  kNewRate,        // first of a stream of another interval_s(): all statistics begin anew
  kTimeRestarted,  // sensor time began anew; to be added after a gap of unknown length
  kDuplicate,      // the newest time again; left out
  kBehind,         // before the newest; left out
  kOtherInterval,  // a mean over another time than the stream's; left out
  kRefused,        // its interval is no positive number, or a first one beyond the bounds; left out
};

struct Placement {
  Arrival arrival = Arrival::kRefused;
  std::uint64_t missing = 0;  // samples missing before this one
};

class StreamTiming {
 public:
  static constexpr double kShortestIntervalS = 1e-4;
  static constexpr double kLongestIntervalS = 1800.0;  // as records may have
  static constexpr int kToBelieve = 32;  // samples in a row; two such blocks for a new rate

  // O(1), no allocation.
  Placement place(core::SensorTime time, double interval_s) noexcept;

  // By which samples are placed: the first one's, or that of the new rate; 0 before the first.
  [[nodiscard]] double interval_s() const noexcept { return interval_s_; }
  // Mean of the steps at this rate that are no gaps: what jitter of single stamps, the first
  // interval's among them, leaves of the interval. The one above before the first step.
  [[nodiscard]] double mean_interval_s() const noexcept;
  [[nodiscard]] core::SensorTime newest() const noexcept { return newest_; }

 private:
  enum class Rate : std::uint8_t { kSame, kNew };
  Placement behind(core::SensorTime time) noexcept;
  Rate note_interval(double interval_s) noexcept;
  void forget_intervals() noexcept;
  void forget_steps() noexcept;

  double interval_s_ = 0.0;
  core::SensorTime stepped_{0};  // sum of the steps that are no gaps
  std::int64_t steps_ = 0;
  core::SensorTime newest_{0};
  core::SensorTime behind_{0};  // newest of the samples behind
  int behind_run_ = 0;
  int intervals_ = 0;  // of the block that is being filled
  double interval_sum_s_ = 0.0;
  double shortest_s_ = 0.0;
  double longest_s_ = 0.0;
  double candidate_s_ = 0.0;  // mean of the block before where it was another; 0: none
};

}  // namespace zerodrift::allan
