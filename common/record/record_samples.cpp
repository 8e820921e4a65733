// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_samples.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::record {

core::AngularRateSample to_angular_rate(const RecordRow& row) noexcept {
  core::AngularRateSample sample;
  sample.sequence = row.index;
  sample.time = row.time;
  sample.interval_s = row.interval_s;
  sample.rate_radps = row.rate_radps;
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    sample.valid[i] = std::isfinite(row.rate_radps[i]);
  sample.clock = core::ClockSource::kReplay;
  return sample;
}

void to_temperature(const RecordRow& row, const RecordInfo& info, std::size_t probe,
                    core::TemperatureSample& sample) {
  sample.probe = info.probes[probe];
  sample.sequence = row.index;
  sample.time = row.time;
  sample.temperature_degc = row.temperature_degc[probe];
  sample.measured = std::isfinite(sample.temperature_degc);
  sample.clock = core::ClockSource::kReplay;
}

std::optional<core::RateReferenceSample> to_rate_reference(const RecordRow& row,
                                                           const RecordInfo& info,
                                                           double variance_radps2) noexcept {
  if (std::none_of(info.has_reference.begin(), info.has_reference.end(),
                   [](bool has) { return has; })) {
    return std::nullopt;
  }
  core::RateReferenceSample sample;
  sample.time = row.time;
  sample.rate_radps = row.reference_radps;
  sample.variance.fill(variance_radps2);
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    sample.valid[i] = std::isfinite(row.reference_radps[i]);
  sample.kind = core::ReferenceKind::kRecord;
  return sample;
}

}  // namespace zerodrift::record
