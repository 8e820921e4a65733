// SPDX-License-Identifier: Apache-2.0
// A record as the diagnosis takes it, cleared of what can't have been measured: each such reading
// counts as not measured, and a line says which column, what was found and what would be right.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/measured_series.h"
#include "common/measurement/plausibility.h"
#include "common/record/record_layout.h"
#include "common/record/record_reader.h"

namespace zerodrift::measurement {

struct MeasuredRecordRequest {
  record::RecordInput record;
  std::vector<core::Axis> axes{};  // empty: those that the record has
};

struct MeasuredRecord {
  std::string file;
  diagnosis::MeasuredSeries series{};
  // From sample to sample, true rate taken off, rad/s; NaN where nothing is known.
  core::PerAxis<double> sample_noise_radps{};
  core::PerAxis<std::string> rate_column{};
  std::vector<Doubt> doubts{};          // of the record as it is
  std::vector<std::string> warnings{};  // one line each, beginning with the file's name

  [[nodiscard]] double duration_s() const {
    return series.interval_s * static_cast<double>(series.size);
  }
  [[nodiscard]] bool has(core::Axis axis) const { return series.has(axis); }
};

// What the rows of a record, or of what was received live, are to be taken for.
struct MeasuredColumns {
  std::string file;                            // or a name; each line on what was found begins so
  std::vector<record::BoundColumn> columns{};  // values alone; rates of the wanted axes
  std::vector<std::string> probes{};
  bool has_reference = false;
  double sample_period_s = 1.0;
  ColumnSource source = ColumnSource::kTable;
};

// The same rows make the same record, whoever brings them. The probes of the series are in the
// order of the twin's places, others after them by name. Memory O(grid points).
class MeasuredRecordBuilder {
 public:
  // Throws std::invalid_argument where the sample period is too long for a diagnosis.
  explicit MeasuredRecordBuilder(MeasuredColumns columns);
  ~MeasuredRecordBuilder();
  MeasuredRecordBuilder(MeasuredRecordBuilder&&) noexcept;
  MeasuredRecordBuilder& operator=(MeasuredRecordBuilder&&) noexcept;

  // In time order. interval_s: since the row before.
  void add(const record::RecordRow& row);
  // Throws std::invalid_argument as read_measured_record().
  [[nodiscard]] MeasuredRecord finish();

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

// `progress` is given the share that was read, 0 to 1. Reads the file once, O(rows). Throws
// files::FileError; std::invalid_argument with one line where the record lacks a wanted axis or
// has no rate that moves.
[[nodiscard]] MeasuredRecord read_measured_record(const MeasuredRecordRequest& request,
                                                  const std::function<void(double)>& progress);

}  // namespace zerodrift::measurement
