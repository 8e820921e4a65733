// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/persistence.h"

#include <cassert>

#include "common/regression/schemes/initial_set.h"
#include "common/regression/schemes/option_error.h"

namespace zerodrift::regression {

std::optional<std::string> PersistenceOptions::validate() const {
  if (!is_positive(window_s)) {
    return wrong_option("window_s", std::to_string(window_s), "a number above 0");
  }
  return std::nullopt;
}

Persistence::Persistence(const PersistenceOptions& options)
    : options_(checked_options("persistence", options)) {}

void Persistence::learn(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  held_.push_overwriting({label.time_s, label.drift});
  while (label.time_s - held_.front().time_s >= options_.window_s) held_.pop();
  // Summed anew each time: a running sum would keep the rounding of all that ever passed.
  double sum = 0.0;
  for (std::size_t i = 0; i < held_.size(); ++i) sum += held_[i].drift;
  mean_ = sum / static_cast<double>(held_.size());
}

DriftPrediction Persistence::predict(double /*time_s*/,
                                     std::span<const double> /*features*/) const {
  return {.drift = mean_, .variance = -1.0};
}

}  // namespace zerodrift::regression
