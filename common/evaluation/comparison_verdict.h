// SPDX-License-Identifier: Apache-2.0
// What a comparison says in a sentence: which scheme to use, and where the stack is not the best.
#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/evaluation/comparison_run.h"

namespace zerodrift::evaluation {

// A figure of one scheme; NaN: not known.
struct Figure {
  std::string scheme;
  double value = std::numeric_limits<double>::quiet_NaN();  // in rad/s
  bool is_bound = false;                                    // at most `value`
};

// Where a scheme is better than the stack.
struct Behind {
  std::string axis;
  std::string judged;
  std::string figure;
  Figure best;
  double ours = 0.0;
};

struct Standing {
  struct Count {
    std::size_t judged = 0;  // the stack's figure and another's are known
    std::size_t best = 0;    // the stack has the smallest, or one that prints alike
  };
  std::map<std::string, Count> figures;
  std::vector<Behind> behind;
};

// What a user decides by: labels come late in motion, and one ahead nearly everything does well. Of
// the schemes that the service runs, since no other can be configured.
struct Recommendation {
  std::string scheme;
  double over_holding = std::numeric_limits<double>::quiet_NaN();  // geometric mean of RMSE over
                                                                   // persistence's, labels late
  double ours = std::numeric_limits<double>::quiet_NaN();          // the stack's; NaN: not compared
  std::size_t judged = 0;                                          // axes and ages
  std::string better;  // of those that the service doesn't run, the best; empty: none is better
  double better_over_holding = std::numeric_limits<double>::quiet_NaN();
};

[[nodiscard]] Standing standing_of(const ComparisonResult& result);
// Nothing where persistence, a delay or every scheme that the service runs is missing, or the
// record is too short for every delay.
[[nodiscard]] std::optional<Recommendation> recommendation_of(const ComparisonResult& result);
// What to use by these figures, in a sentence, or why that can't be said.
[[nodiscard]] std::string recommendation(const ComparisonResult& result);
[[nodiscard]] std::string verdict(const ComparisonResult& result, const Standing& standing);

}  // namespace zerodrift::evaluation
