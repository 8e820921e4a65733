// SPDX-License-Identifier: Apache-2.0
// Allan statistics of every rate axis of a record, read once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/allan/record_analysis.h"
#include "common/core/axis.h"
#include "common/measurement/plausibility.h"
#include "common/record/record_reader.h"

namespace zerodrift::services {

struct AllanRequest {
  record::RecordInput record;
  std::vector<allan::Statistic> statistics{allan::Statistic::kOadev};
  allan::TauGrid grid = allan::TauGrid::kOctave;
  double confidence = 0.95;
  std::size_t memory_mb = 1024;  // for the samples of all axes; beyond, the cascade
};

enum class StreamKind : std::uint8_t { kRaw, kCompensated };
[[nodiscard]] std::string_view name(StreamKind kind);

struct AllanStream {
  core::Axis axis = core::Axis::kX;
  StreamKind kind = StreamKind::kRaw;
  allan::SeriesReport report;
};

struct AllanResult {
  AllanRequest request;
  std::vector<measurement::Doubt> doubts;
  std::vector<std::string> warnings;  // a line each
  std::uint64_t samples = 0;          // rows in which a rate was measured
  double period_s = 0.0;              // mean, gaps left out
  double duration_s = 0.0;            // with gaps
  core::PerAxis<bool> less_reference{};
  std::vector<AllanStream> streams;  // by axis; compensated after raw
};

// Drift = rate - reference where the record has a reference. A record that `zerodrift compensate`
// wrote gives two streams an axis: compensated, and raw, which is it plus the drift taken off.
// Shows its progress on a terminal. Throws files::FileError, std::invalid_argument with one
// line: what is wrong with the request, or what the record lacks.
[[nodiscard]] AllanResult run_allan(const AllanRequest& request);

}  // namespace zerodrift::services
