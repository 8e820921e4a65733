// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/posterior.h"

#include <cmath>

#include "common/diagnosis/evidence.h"

namespace zerodrift::diagnosis {

std::vector<double> probabilities(std::span<const double> nats, double best,
                                  const SearchOptions& options) {
  const double freedom = options.mismatch_freedom;
  std::vector<double> logarithms;
  for (const double evidence : nats)
    logarithms.push_back(-0.5 * (freedom + 1.0) * std::log1p(2.0 * (best - evidence) / freedom));
  const double total = log_sum(logarithms);
  std::vector<double> result;
  for (const double logarithm : logarithms) {
    result.push_back(std::isfinite(logarithm)
                         ? (1.0 - options.unlisted_share) * std::exp(logarithm - total)
                         : 0.0);
  }
  return result;
}

}  // namespace zerodrift::diagnosis
