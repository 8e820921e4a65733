// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "common/core/samples.h"
#include "common/dds/topics.h"

namespace zerodrift::bench {

// A sample of a gyro at rest, for benches. Its clock is hardware, so that nobody waits for
// anything.
inline msg::AngularRate synthetic_sample(std::uint32_t gyro_id, std::uint64_t sequence,
                                         std::int64_t time_ns, double interval_s) {
  constexpr std::uint32_t kEveryAxis = 0b111;
  constexpr double kRateRadps = 7.3e-5;  // about the Earth's
  msg::AngularRate sample;
  sample.gyro_id(gyro_id);
  sample.validity(kEveryAxis);
  sample.sequence_number(sequence);
  sample.sensor_time_ns(time_ns);
  sample.rate_radps({kRateRadps, kRateRadps, kRateRadps});
  sample.delta_angle_rad(
      {kRateRadps * interval_s, kRateRadps * interval_s, kRateRadps * interval_s});
  sample.interval_s(interval_s);
  sample.clock_source(static_cast<std::uint32_t>(core::ClockSource::kHardware));
  sample.publish_time_ns(time_ns);
  return sample;
}

}  // namespace zerodrift::bench
