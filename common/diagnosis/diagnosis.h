// SPDX-License-Identifier: Apache-2.0
// Twin against measurement: locate, name, add, prove.
//
//   simulate the model over the record's own inputs -> measured minus twin -> noise -> known
//   effects refitted -> missing effects named, or honestly not -> repaired model -> proof on data
//   that took no part
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/diagnosis_options.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

struct Diagnosis {
  Verdict verdict = Verdict::kConsistent;  // the gravest of the axes
  core::PerAxis<std::optional<AxisDiagnosis>> axes{};
  twin::Model repaired;  // the model as given where nothing was accepted
  std::vector<std::string> warnings{};
};

// Diagnoses every axis that the record has. Deterministic; a few seconds for 20 000 intervals.
// Throws std::invalid_argument where the model or the options are not sound.
[[nodiscard]] Diagnosis diagnose(const twin::Model& model, const MeasuredSeries& series,
                                 const std::vector<MeasuredSeries>& validation,
                                 const DiagnosisOptions& options);

}  // namespace zerodrift::diagnosis
