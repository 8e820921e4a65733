// SPDX-License-Identifier: Apache-2.0
// An experiment for what a diagnosis left open: designed, compared with fixed ones, tried in
// simulation.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/diagnosis/design.h"
#include "common/diagnosis/design_trial.h"

namespace zerodrift::services {

struct DesignRequest {
  std::string model;
  std::string diagnosis;
  std::string limits;
  std::vector<std::string> against{};  // profiles to compare with
  std::uint64_t seed = 1;
  std::size_t replicates = 3;
};

// An experiment that was not designed for the question.
struct FixedExperiment {
  std::string what;  // of the menu, or a profile's file
  twin::Profile profile;
  diagnosis::Judgement judgement;
};

struct DesignResult {
  std::vector<diagnosis::Question> questions{};  // empty: nothing is open, and nothing below is set
  std::vector<std::string> notes{};              // a line each
  diagnosis::Design design{};
  FixedExperiment fixed{};  // the best of the menu and of those to compare with
  std::vector<diagnosis::Share> shares{};
  std::vector<diagnosis::Share> fixed_shares{};  // in the same order
};

// Shows its progress on a terminal. Throws config::ConfigError, std::invalid_argument with one
// line.
[[nodiscard]] DesignResult run_design(const DesignRequest& request);

// Without the provenance.
[[nodiscard]] nlohmann::ordered_json design_json(const DesignRequest& request,
                                                 const DesignResult& result);
// A paragraph each, for people.
[[nodiscard]] std::vector<std::string> design_sentences(const DesignResult& result);
void print_design_tables(const DesignResult& result);

}  // namespace zerodrift::services
