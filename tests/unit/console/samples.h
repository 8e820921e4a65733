// SPDX-License-Identifier: Apache-2.0
// Samples whose figures in deg/h are small whole numbers.
#pragma once

#include <cstdint>

#include "common/core/units.h"
#include "common/dds/topics.h"

namespace zerodrift::services {

inline msg::CompensatedRate sample_at(std::int64_t sensor_time_ns, double raw_deg_h,
                                      double drift_deg_h, std::uint64_t sequence = 1) {
  msg::CompensatedRate sample;
  sample.gyro_id(1);
  sample.validity(7);
  sample.sequence_number(sequence);
  sample.sensor_time_ns(sensor_time_ns);
  sample.interval_s(0.01);
  for (std::size_t i = 0; i < 3; ++i) {
    sample.rate_radps()[i] = core::radps_from_deg_h(raw_deg_h - drift_deg_h);
    sample.applied_drift_radps()[i] = core::radps_from_deg_h(drift_deg_h);
    const double sigma = core::radps_from_deg_h(0.5);
    sample.drift_variance_radps2()[i] = sigma * sigma;
    sample.mode()[i] = 1;
  }
  return sample;
}

}  // namespace zerodrift::services
