// SPDX-License-Identifier: Apache-2.0
// Integer arithmetic on sensor time that stays defined for every stamp, also for hostile ones.
#pragma once

#include <cstdint>
#include <limits>

#include "common/core/time.h"

namespace zerodrift::thermal {

// Stamps within ±2^61 ns (73 years around the epoch) have differences, and sums of two, that cannot
// overflow. Readings outside are refused.
inline constexpr core::SensorTime kLatestUsableTime{std::int64_t{1} << 61};

constexpr bool is_usable(core::SensorTime time) {
  return time >= -kLatestUsableTime && time <= kLatestUsableTime;
}

// later - earlier, clamped to the range of SensorTime.
constexpr core::SensorTime saturating_difference(core::SensorTime later, core::SensorTime earlier) {
  using Limits = std::numeric_limits<std::int64_t>;
  const std::int64_t a = later.count();
  const std::int64_t b = earlier.count();
  if (b < 0 && a > Limits::max() + b) return core::SensorTime::max();
  if (b > 0 && a < Limits::min() + b) return core::SensorTime::min();
  return core::SensorTime{a - b};
}

// Index of the interval [i width, (i + 1) width) that holds `time`; width > 0.
constexpr std::int64_t interval_index(core::SensorTime time, core::SensorTime width) {
  const std::int64_t quotient = time / width;
  return time % width < core::SensorTime{0} ? quotient - 1 : quotient;
}

}  // namespace zerodrift::thermal
