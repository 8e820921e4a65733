// SPDX-License-Identifier: Apache-2.0
// Which effects are missing in a model: greedy search with swaps and removals over groups of
// candidate columns, judged by Bayes factors in which the noise is fitted anew under every
// hypothesis.
//
//   evidence of a group: its variants' (evidence.h) average by their priors; noise: the best of a
//     few spectra for all variants, its own restricted optimum for the leading ones
//   add the group of largest evidence while it exceeds log(groups / false_alarm); then try to
//     replace or drop each one chosen; at most max_effects
//   alternatives of one chosen: what the groups' evidences in its place say (posterior.h), those
//     that sum to the credible mass of all named groups
//   what a chosen effect's form could leave is no effect of its own: no more than a share of its
//     d², and of a form that remembers nothing the part of that which lies where both act
//   generic groups (splines, pairs of inputs) are never named. Where one of them explains clearly
//     more than the chosen ones, or stays significant beside them with more than a remainder of
//     form, the outcome is kUnknown
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/diagnosis/column_memory.h"
#include "common/diagnosis/group_findings.h"
#include "common/diagnosis/joint_fit.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

enum class SearchOutcome : std::uint8_t {
  kRefused,         // the series says nothing; `reason` says why
  kNothingMissing,  // nothing significant
  kNamed,
  kUnknown,  // a generic group explains what no named one does; `effects` may hold others
};

[[nodiscard]] std::string_view name(SearchOutcome outcome) noexcept;

struct RankedGroup {
  GroupId group{};
  double probability = 0.0;
};

struct FoundEffect : FittedEffect {
  double log_evidence = 0.0;                // against the model without it
  double separation = 0.0;                  // d
  double probability = 0.0;                 // that it is this one, given that something is there
  std::vector<RankedGroup> credible_set{};  // most probable first, this one among them
};

struct SearchReport {
  SearchOutcome outcome = SearchOutcome::kRefused;
  std::string reason;  // of a refusal, or of kUnknown: which rule
  std::vector<FoundEffect> effects{};
  std::optional<FoundEffect> unknown{};          // the generic group
  std::vector<CorrectionFinding> corrections{};  // one a known column, unless refused
  std::vector<GroupFinding> groups{};
  double threshold_nats = 0.0;
  std::vector<NoiseTerm> noise_terms{};
  std::vector<double> noise_squares{};  // of the final model
  NoiseFitStatus noise_status = NoiseFitStatus::kNoPower;
  // Of the residual of the final model, against the known noise where there is one, else against
  // the fitted noise.
  std::vector<OctavePower> octaves{};
  double missing_share = 0.0;
};

// Throws std::invalid_argument with the sentence of validate() or of a problem that contradicts
// itself (lengths, nothing to make columns with). Data that can't answer is a report, not an
// exception. About 1 s for 18000 points and 800 columns on one core; memory 4 bytes a point and
// column.
[[nodiscard]] SearchReport find_missing(const SearchProblem& problem,
                                        const SearchOptions& options = {},
                                        ColumnMemory* memory = nullptr);

}  // namespace zerodrift::diagnosis
