// SPDX-License-Identifier: Apache-2.0
// A comparison as tables, as a page and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/evaluation/comparison_run.h"
#include "common/report/html_document.h"

namespace zerodrift::evaluation {

// Axis by axis, then where another scheme is better than the stack in standard deviation, RMSE or
// bias instability.
[[nodiscard]] std::vector<report::Table> comparison_tables(const ComparisonResult& result);
// How the tables are to be read; the last one is the verdict. A paragraph each.
[[nodiscard]] std::vector<std::string> comparison_notes(const ComparisonResult& result);
[[nodiscard]] report::Document comparison_page(const ComparisonResult& result);
// Keys depend on the request alone. What depends on the machine is in objects named "times".
[[nodiscard]] nlohmann::ordered_json comparison_json(const ComparisonResult& result);

}  // namespace zerodrift::evaluation
