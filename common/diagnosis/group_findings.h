// SPDX-License-Identifier: Apache-2.0
// What a search says of every group, chosen or not: whether the record can test it, how it looks
// beside the known columns alone, and how small it might be and still show.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/diagnosis/search_board.h"
#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

struct GroupFinding {
  GroupId group{};
  CandidateKind kind = CandidateKind::kNamed;
  Testability testability = Testability::kTestable;
  std::string collinear_with{};  // the known column nearest to it
  std::vector<double> shape{};   // of the best variant
  double log_evidence = 0.0;     // beside the known columns alone
  double separation = 0.0;       // d of the best variant there
  double rms = 0.0;
  // RMS of the waveform that would show with d = power_separation, under the final noise: median
  // of the variants, mean direction of several columns.
  double smallest_rms = std::numeric_limits<double>::infinity();
  // The same as an amplitude of the median variant where it has one column.
  std::optional<double> smallest_amplitude{};
};

// A group of the problem, by its place, in the evaluation beside the known columns alone.
[[nodiscard]] GroupFinding group_finding(std::size_t group, const SearchProblem& problem,
                                         const SearchOptions& options, const Board& board,
                                         const Evaluation& first);

// Adds the smallest sizes beside `base` under a spectrum of noise; nothing to one that can't be
// tested. The finding's group stands at its place of the problem.
void add_power(GroupFinding& finding, const SearchProblem& problem, const SearchOptions& options,
               const Board& board, const Base& base, const Eigen::VectorXd& spectrum);

}  // namespace zerodrift::diagnosis
