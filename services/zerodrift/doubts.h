// SPDX-License-Identifier: Apache-2.0
// What can hardly be right about a record, before any result of it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/measurement/plausibility.h"

namespace zerodrift::services {

// On standard output, a line each.
void print_doubts(const std::vector<measurement::Doubt>& doubts);
// [{"kind": "unit", "record": ..., "column": ..., "text": ...}, ...]
[[nodiscard]] nlohmann::ordered_json doubts_json(const std::vector<measurement::Doubt>& doubts);
// "; doubtful: ..." for a refusal that a doubt may be the cause of; nothing where there is none.
[[nodiscard]] std::string possible_cause(const std::vector<measurement::Doubt>& doubts);

}  // namespace zerodrift::services
