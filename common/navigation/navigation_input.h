// SPDX-License-Identifier: Apache-2.0
// A compensated sample as a navigation filter takes it.
#pragma once

#include <algorithm>

#include "common/core/compensated_sample.h"
#include "common/navigation/gyro_navigation.h"

namespace zerodrift::navigation {

// A filter that reads the topic knows the sensor's variance as rate covariance - drift variance,
// each as published: offline runs compute the same, to the bit.
[[nodiscard]] inline double noise_variance(double rate_variance, double drift_variance) noexcept {
  const bool known = rate_variance >= 0.0 && drift_variance >= 0.0;
  return known ? std::max(0.0, rate_variance - drift_variance) : -1.0;
}

[[nodiscard]] inline NavigationSample to_navigation(
    const core::CompensatedSample& sample) noexcept {
  NavigationSample out;
  out.sequence = sample.raw.sequence;
  out.time = sample.raw.time;
  out.interval_s = sample.raw.interval_s;
  out.rate_radps = sample.rate_radps;
  out.applied_drift_radps = sample.applied_drift_radps;
  out.valid = sample.raw.valid;
  out.clipped = sample.raw.clipped;
  out.drift_variance = sample.drift_variance;
  out.model_epoch = sample.model_epoch;
  out.late = sample.late;
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    out.rung[i] = static_cast<std::uint8_t>(sample.rung[i]);
    const bool known = sample.sensor_variance[i] >= 0.0 && sample.drift_variance[i] >= 0.0;
    const double rate = sample.sensor_variance[i] + sample.drift_variance[i];
    out.noise_variance[i] = known ? noise_variance(rate, sample.drift_variance[i]) : -1.0;
  }
  return out;
}

}  // namespace zerodrift::navigation
