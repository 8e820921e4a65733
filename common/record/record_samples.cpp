// SPDX-License-Identifier: Apache-2.0
#include "common/record/record_samples.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::record {

bool brings_rate(const RecordRow& row) noexcept {
  return row.recorded == nullptr ? row.has_rate : row.recorded->rate.has_value();
}

bool brings_temperature(const RecordRow& row, std::size_t probe) noexcept {
  return row.recorded == nullptr || row.recorded->temperatures[probe].has_value();
}

core::AngularRateSample to_angular_rate(const RecordRow& row) noexcept {
  if (row.recorded != nullptr && row.recorded->rate) return *row.recorded->rate;
  core::AngularRateSample sample;
  sample.sequence = row.rate;
  sample.time = row.time;
  sample.interval_s = row.rate_interval_s;
  sample.rate_radps = row.rate_radps;
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    sample.valid[i] = core::is_rate(row.rate_radps[i]);
  sample.clock = core::ClockSource::kReplay;
  return sample;
}

void to_temperature(const RecordRow& row, const RecordInfo& info, std::size_t probe,
                    core::TemperatureSample& sample) {
  if (row.recorded != nullptr && row.recorded->temperatures[probe]) {
    sample = *row.recorded->temperatures[probe];
    return;
  }
  sample.probe = info.probes[probe];
  sample.sequence = row.index;
  sample.time = row.time;
  sample.temperature_degc = row.temperature_degc[probe];
  sample.measured = std::isfinite(sample.temperature_degc);
  sample.clock = core::ClockSource::kReplay;
}

std::optional<core::EnvironmentSample> to_environment(const RecordRow& row,
                                                      const RecordInfo& info) noexcept {
  if (row.recorded != nullptr) return row.recorded->environment;
  if (info.environment == 0) return std::nullopt;
  core::EnvironmentSample sample{.sequence = row.index,
                                 .time = row.time,
                                 .values = row.inputs,
                                 .clock = core::ClockSource::kReplay};
  core::keep_measured(sample, info.environment, info.environment);
  return sample;
}

std::optional<core::RateReferenceSample> to_rate_reference(const RecordRow& row,
                                                           const RecordInfo& info,
                                                           double variance_radps2) noexcept {
  if (row.recorded != nullptr) return row.recorded->reference;
  if (std::none_of(info.has_reference.begin(), info.has_reference.end(),
                   [](bool has) { return has; })) {
    return std::nullopt;
  }
  core::RateReferenceSample sample;
  sample.time = row.time;
  sample.rate_radps = row.reference_radps;
  sample.variance.fill(variance_radps2);
  for (std::size_t i = 0; i < core::kAxisCount; ++i)
    sample.valid[i] = info.has_reference[i] && core::is_rate(row.reference_radps[i]);
  sample.kind = core::ReferenceKind::kRecord;
  return sample;
}

}  // namespace zerodrift::record
