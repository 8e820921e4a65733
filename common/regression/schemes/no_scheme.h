// SPDX-License-Identifier: Apache-2.0
// No compensation: what every scheme has to be better than.
#pragma once

#include <cstddef>

#include "common/regression/drift_scheme.h"

namespace zerodrift::regression {

// Predicts 0. Variance: mean square of the labels less their own variance, never below 0. O(1).
class NoScheme final : public DriftScheme {
 public:
  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

 private:
  std::size_t count_ = 0;
  double mean_square_ = 0.0;  // of label drifts, less the labels' variances
};

}  // namespace zerodrift::regression
