// SPDX-License-Identifier: Apache-2.0
// The tables of a diagnosis, each without rows where there is nothing to say.
#pragma once

#include <optional>

#include "common/report/table.h"
#include "services/zerodrift/diagnosis_words.h"

namespace zerodrift::services {

// kNamed: a first column names the axis, for several in one table.
enum class TableAxes { kNamed, kOne };

[[nodiscard]] report::Table gap_table(const DiagnosedAxes& group, TableAxes axes);
[[nodiscard]] report::Table effect_table(const DiagnosedAxes& group, TableAxes axes);
[[nodiscard]] report::Table parameter_table(const DiagnosedAxes& group, TableAxes axes);
[[nodiscard]] report::Table recalibration_table(const DiagnosedAxes& group, TableAxes axes);
[[nodiscard]] report::Table where_table(const DiagnosedAxes& group);
[[nodiscard]] std::optional<report::Table> evidence_table(const Diagnosed& axis);
[[nodiscard]] report::Table not_testable_table(const DiagnosedAxes& group);
[[nodiscard]] report::Table visible_table(const DiagnosedAxes& group);
[[nodiscard]] report::Table summary_table(const DiagnosedAxes& group);

}  // namespace zerodrift::services
