// SPDX-License-Identifier: Apache-2.0
// Sensor time: integer nanoseconds since an epoch the source chooses. It drives every algorithm;
// arrival time never does, and nothing below common/service reads a clock.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace zerodrift::core {

using SensorTime = std::chrono::nanoseconds;

inline constexpr std::int64_t kNsPerS = 1'000'000'000;
inline constexpr SensorTime kNever = SensorTime::min();

constexpr double seconds(SensorTime time) {
  return static_cast<double>(time.count()) * 1e-9;
}

// Nearest nanosecond. Exact to 1 ns for |time_s| < 4e6 s; every reader of a record uses this one
// function, so that live and offline see identical integers.
inline SensorTime from_seconds(double time_s) {
  return SensorTime{std::llround(time_s * 1e9)};
}

}  // namespace zerodrift::core
