// SPDX-License-Identifier: Apache-2.0
// Two synthetic drifts whose truth is known, for measuring learners against each other.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "common/twin/random.h"

namespace zerodrift::bench {

// kRamp: from one soak temperature towards another, time constant a third of the record.
// kCycle: three heat/cool cycles.
enum class DriftRecord { kRamp, kCycle };

inline const char* name(DriftRecord record) {
  return record == DriftRecord::kRamp ? "ramp" : "cycle";
}

inline constexpr std::size_t kDriftFeatures = 2;
using DriftFeatures = std::array<double, kDriftFeatures>;

// All scaled to the order of 1.
struct DriftPoint {
  DriftFeatures x{};   // temperature, temperature rate
  double truth = 0.0;  // drift
  double label = 0.0;  // truth with noise
};

inline constexpr double kDriftNoise = 0.02;  // standard deviation of the labels' white noise

inline double drift_of(const DriftFeatures& x) {
  return 0.5 * x[0] + 0.3 * std::sin(2.5 * x[0]) + 0.25 * x[1];
}

// `point_count` points, evenly spread in time. The same for the same arguments.
inline std::vector<DriftPoint> synthetic_drift(DriftRecord record, std::size_t point_count) {
  const twin::NoiseStream noise(1, "synthetic_drift");
  std::vector<DriftPoint> points(point_count);
  for (std::size_t i = 0; i < point_count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(point_count);
    const double phase = 6.0 * std::numbers::pi * share;
    const double decay = std::exp(-3.0 * share);
    DriftPoint& point = points[i];
    point.x = record == DriftRecord::kRamp ? DriftFeatures{1.0 - 2.0 * decay, decay}
                                           : DriftFeatures{std::sin(phase), std::cos(phase)};
    point.truth = drift_of(point.x);
    point.label = point.truth + kDriftNoise * noise.gaussian(i);
  }
  return points;
}

}  // namespace zerodrift::bench
