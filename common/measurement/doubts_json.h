// SPDX-License-Identifier: Apache-2.0
// What can hardly be right about a record, as reports and refusals state it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/measurement/plausibility.h"

namespace zerodrift::measurement {

// [{"kind": "unit", "record": ..., "column": ..., "text": ...}, ...]
[[nodiscard]] nlohmann::ordered_json doubts_json(const std::vector<Doubt>& doubts);
// "; doubtful: ..." for a refusal that a doubt may be the cause of; nothing where there is none.
[[nodiscard]] std::string possible_cause(const std::vector<Doubt>& doubts);

}  // namespace zerodrift::measurement
