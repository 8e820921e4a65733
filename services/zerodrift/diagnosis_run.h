// SPDX-License-Identifier: Apache-2.0
// A twin against its records: loads both, diagnoses, and tells what came of it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/diagnosis.h"
#include "common/measurement/measured_record.h"
#include "common/twin/model.h"

namespace zerodrift::services {

struct DiagnosisRequest {
  std::string model;
  record::RecordInput record;
  // Records that take no part in choosing and fitting; read as `record` is.
  std::vector<std::string> validation{};
  std::vector<core::Axis> axes{};  // empty: those that the record has
  std::string date;                // for the origin of what is added
};

// A record in figures.
struct RecordSummary {
  std::string file;
  std::uint64_t rows = 0;
  double duration_s = 0.0;
  double sample_period_s = 0.0;
  double interval_s = 0.0;  // of the grid it was looked at on
  bool has_reference = false;
  std::vector<std::string> probes{};
};

enum class ModelChange { kUnchanged, kRepaired };

struct DiagnosisResult {
  std::string model;
  std::string gyro;  // what the model says it is of
  RecordSummary record{};
  std::vector<RecordSummary> validation{};
  std::vector<measurement::Doubt> doubts{};  // of all records
  std::vector<std::string> warnings{};       // one line each: files first, then the diagnosis' own
  diagnosis::Diagnosis diagnosis{};
  ModelChange change = ModelChange::kUnchanged;
};

// Whether the effects of the two differ in anything.
[[nodiscard]] ModelChange change_between(const twin::Model& model, const twin::Model& repaired);

// Shows its progress on a terminal. Throws config::ConfigError, files::FileError,
// std::invalid_argument with one line: what is wrong with the request, or what a record lacks.
[[nodiscard]] DiagnosisResult run_diagnosis(const DiagnosisRequest& request);
// The same with a record that was measured already; request.record.file is its name.
[[nodiscard]] DiagnosisResult run_diagnosis(const DiagnosisRequest& request,
                                            const measurement::MeasuredRecord& record);
// Of a model that is made from what the record has; request.model is not looked at.
[[nodiscard]] DiagnosisResult run_calibration(
    DiagnosisRequest request,
    const std::function<twin::Model(const measurement::MeasuredRecord&)>& list);

}  // namespace zerodrift::services
