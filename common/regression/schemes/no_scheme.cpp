// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/no_scheme.h"

#include <algorithm>
#include <cassert>

#include "common/regression/schemes/initial_set.h"

namespace zerodrift::regression {

void NoScheme::learn(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  ++count_;
  const double square = label.drift * label.drift - label.variance;
  mean_square_ += (square - mean_square_) / static_cast<double>(count_);
}

DriftPrediction NoScheme::predict(double /*time_s*/, std::span<const double> /*features*/) const {
  if (count_ == 0) return {};
  return {.drift = 0.0, .variance = std::max(mean_square_, 0.0)};
}

}  // namespace zerodrift::regression
