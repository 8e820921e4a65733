// SPDX-License-Identifier: Apache-2.0
// A diagnosis as tables, as a page and as JSON. Equal results give equal bytes.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/report/html_document.h"
#include "services/zerodrift/diagnosis_run.h"

namespace zerodrift::services {

// The verdict on each axis, a sentence each: "Axis x: ...".
[[nodiscard]] std::vector<std::string> diagnosis_sentences(const DiagnosisResult& result);
// What fits a terminal: the gap, and where there are any, named effects, their parameters and what
// was recalibrated.
[[nodiscard]] std::vector<report::Table> diagnosis_tables(const DiagnosisResult& result);
// What stands below the tables, a paragraph each: what depends on what, what could not be tested,
// what the record could have shown, the next experiment.
[[nodiscard]] std::vector<std::string> diagnosis_notes(const DiagnosisResult& result);
[[nodiscard]] report::Document diagnosis_page(const DiagnosisResult& result);
// All keys are always there; what isn't known or finite is null.
[[nodiscard]] nlohmann::ordered_json diagnosis_json(const DiagnosisResult& result);

}  // namespace zerodrift::services
