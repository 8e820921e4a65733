// SPDX-License-Identifier: Apache-2.0
// What a history of units says, for people and for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/diagnosis/unit_history.h"
#include "common/report/table.h"

namespace zerodrift::services {

// What is said of a fleet.
struct FleetHistory {
  diagnosis::UnitHistory history;
  std::vector<diagnosis::PartlySized> partly_sized;
  double false_discovery_rate = 0.0;
};

// A paragraph each: what changed and what is unlike the others, what not all records sized, or that
// nothing was found, or that there were too few records to ask.
[[nodiscard]] std::vector<std::string> history_sentences(const FleetHistory& fleet);
[[nodiscard]] report::Table history_table(const diagnosis::UnitHistory& history);
// Without the provenance.
[[nodiscard]] nlohmann::ordered_json history_json(const FleetHistory& fleet);

}  // namespace zerodrift::services
