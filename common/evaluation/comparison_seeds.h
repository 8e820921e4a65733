// SPDX-License-Identifier: Apache-2.0
// The schemes on several records that the twin makes of one model and profile: geometric means over
// axes and seeds, with intervals, so that no seed's luck decides.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/comparison/geometric_mean.h"
#include "common/evaluation/comparison_run.h"
#include "common/report/html_document.h"
#include "common/report/json_file.h"
#include "common/report/table.h"

namespace zerodrift::evaluation {

struct SeedsRequest {
  ComparisonRequest comparison;  // of each record; its own record isn't looked at
  std::string model;
  std::string profile;
  std::uint64_t first_seed = 1;
  std::uint64_t seeds = 5;
  double rate_hz = 0.0;  // 0: the model's nominal one
};

struct SeedsRow {
  std::string scheme;
  comparison::GeometricMean rms_radps;
  comparison::GeometricMean over_holding;  // of the same axis and seed
};

struct SeedsProtocol {
  std::string name;  // "one ahead", "delayed 60 s", "frozen"
  std::vector<SeedsRow> rows;
};

struct SeedsResult {
  SeedsRequest request;
  std::vector<std::string> warnings;
  std::vector<SeedsProtocol> protocols;
};

// Each record is a file among the temporary ones while it is judged. Throws as run_comparison(),
// and where no seed gives anything to judge.
[[nodiscard]] SeedsResult run_seeds(const SeedsRequest& request, const Progress& progress);

[[nodiscard]] std::vector<report::Table> seeds_tables(const SeedsResult& result);
// Which scheme is best of each protocol.
[[nodiscard]] std::string seeds_verdict(const SeedsResult& result);
[[nodiscard]] report::Document seeds_page(const SeedsResult& result);
[[nodiscard]] nlohmann::ordered_json seeds_json(const SeedsResult& result);

}  // namespace zerodrift::evaluation
