// SPDX-License-Identifier: Apache-2.0
// From the evidence of rival explanations to probabilities that can be counted on.
//
//   p_k = (1 - u) w_k / sum w,  w_k = (1 + r_k / nu)^(-(nu + 1) / 2),  r_k = 2 (best - evidence_k)
//
// Forms are never exact: what an explanation leaves of what the best one explains, r (a difference
// of chi-squares), is a remainder of its form, Student distributed with nu degrees of freedom and
// not normal. And in a share u of all cases what is there is none of those that were looked at, so
// no probability is above 1 - u. nu and u are those of cases whose truth was known
// (tests/blind/results.md, "Stated probabilities").
#pragma once

#include <span>
#include <vector>

#include "common/diagnosis/search_problem.h"

namespace zerodrift::diagnosis {

// Of explanations with these evidences and priors, nats; -infinity: out of the question, which
// gets 0. best: of the best explanation, which needn't be one of them. Sums to
// 1 - options.unlisted_share; all 0 where all are out of the question. O(n).
[[nodiscard]] std::vector<double> probabilities(std::span<const double> nats, double best,
                                                const SearchOptions& options);

}  // namespace zerodrift::diagnosis
