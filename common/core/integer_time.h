// SPDX-License-Identifier: Apache-2.0
// Integer arithmetic on sensor time that stays defined for every stamp, also for hostile ones.
#pragma once

#include <cstdint>
#include <limits>

#include "common/core/time.h"

namespace zerodrift::core {

// Stamps within ±2^61 ns (73 years around the epoch) have differences, and sums of two, that cannot
// overflow. Readings outside are refused.
inline constexpr SensorTime kLatestUsableTime{std::int64_t{1} << 61};

constexpr bool is_usable(SensorTime time) {
  return time >= -kLatestUsableTime && time <= kLatestUsableTime;
}

// later - earlier, clamped to the range of SensorTime.
constexpr SensorTime saturating_difference(SensorTime later, SensorTime earlier) {
  using Limits = std::numeric_limits<std::int64_t>;
  const std::int64_t a = later.count();
  const std::int64_t b = earlier.count();
  if (b < 0 && a > Limits::max() + b) return SensorTime::max();
  if (b > 0 && a < Limits::min() + b) return SensorTime::min();
  return SensorTime{a - b};
}

// A stamp further than this from what its stream said before is wild: it is not believed until
// another confirms it.
inline constexpr SensorTime kLargestStep{60'000'000'000};

// A clock that went back by more than this, and stays there, was set back: time begins anew.
inline constexpr SensorTime kLargestStepBack{500'000'000};

constexpr bool is_far_ahead(SensorTime time, SensorTime of) {
  return saturating_difference(time, of) > kLargestStep;
}

// Index of the interval [i width, (i + 1) width) that holds `time`; width > 0.
constexpr std::int64_t interval_index(SensorTime time, SensorTime width) {
  const std::int64_t quotient = time / width;
  return time % width < SensorTime{0} ? quotient - 1 : quotient;
}

}  // namespace zerodrift::core
