// SPDX-License-Identifier: Apache-2.0
// A comparison as tables, as a page and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "common/report/html_document.h"
#include "services/zerodrift/comparison_run.h"

namespace zerodrift::services {

[[nodiscard]] std::vector<report::Table> comparison_tables(const AxisComparison& axis,
                                                           const ComparisonResult& result);
[[nodiscard]] report::Document comparison_page(const ComparisonResult& result);
[[nodiscard]] nlohmann::ordered_json comparison_json(const ComparisonResult& result);

}  // namespace zerodrift::services
