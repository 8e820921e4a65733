// SPDX-License-Identifier: Apache-2.0
// Independent reference: the epsilon-SVR dual solved as one batch QP in double, by sequential
// minimal optimisation with second-order working sets (Fan, Chen & Lin 2005), written directly in
// theta:
//   min 1/2 theta' K theta + epsilon sum |theta_i| - y' theta,   sum theta = 0,
//   |theta_i| <= weight_i C.
// Plain kernels (k, not k - 1) from std::exp; nothing is shared with the code under test but the
// option structs.
#pragma once

#include <vector>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {

struct OracleModel {
  std::vector<Sample> samples;
  std::vector<double> theta;
  Kernel kernel;
  // The bias is unique only if a coefficient lies inside its bounds; any value of the interval is
  // optimal.
  double lowest_bias, highest_bias;
  bool converged;

  // f(x) without the bias.
  [[nodiscard]] double expansion(const std::vector<double>& x) const;
};

// One weight for each sample; none: all are 1.
[[nodiscard]] OracleModel solve_batch(const OnlineSvrOptions& options,
                                      const std::vector<Sample>& samples, double tolerance,
                                      const std::vector<double>& weights = {});

}  // namespace zerodrift::regression::testing
