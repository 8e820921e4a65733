// SPDX-License-Identifier: Apache-2.0
// Allan statistics of a record as tables, as a page and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/report/html_document.h"
#include "services/zerodrift/allan_run.h"

namespace zerodrift::services {

// Stream by stream: each statistic asked for, then the coefficients.
[[nodiscard]] std::vector<report::Table> allan_tables(const AllanResult& result);
// What the record says of the gyro, in a sentence an axis; that it is too short, where it is.
[[nodiscard]] std::string allan_advice(const AllanResult& result);
// How the tables are to be read; the last one is the verdict. A paragraph each.
[[nodiscard]] std::vector<std::string> allan_notes(const AllanResult& result);
[[nodiscard]] report::Document allan_page(const AllanResult& result);
// SI throughout, units in the names. Equal input gives an equal object.
[[nodiscard]] nlohmann::ordered_json allan_json(const AllanResult& result);

}  // namespace zerodrift::services
