// SPDX-License-Identifier: Apache-2.0
// A record as the diagnosis takes it, cleared of what can't have been measured: each such reading
// counts as not measured, and a line says which column, what was found and what would be right.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"

namespace zerodrift::services {

struct MeasuredRecordRequest {
  std::string record;
  std::string columns;
  std::vector<core::Axis> axes{};  // empty: those that the record has
};

struct MeasuredRecord {
  std::string file;
  diagnosis::MeasuredSeries series{};
  // From sample to sample, rad/s; NaN where nothing is known.
  core::PerAxis<double> sample_noise_radps{};
  core::PerAxis<std::string> rate_column{};
  std::vector<std::string> warnings{};  // one line each, beginning with the file's name

  [[nodiscard]] double duration_s() const {
    return series.interval_s * static_cast<double>(series.size);
  }
  [[nodiscard]] bool has(core::Axis axis) const {
    return !series.rate_radps[core::index(axis)].empty();
  }
};

// `progress` is told the share that was read, 0 to 1. Reads the file once, O(rows). Throws
// record::RecordError; std::invalid_argument with one line where the record is too short, lacks a
// wanted axis or has no rate that moves.
[[nodiscard]] MeasuredRecord read_measured_record(const MeasuredRecordRequest& request,
                                                  const std::function<void(double)>& progress);

}  // namespace zerodrift::services
