// SPDX-License-Identifier: Apache-2.0
#include "common/regression/schemes/initial_set.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/core/require.h"
#include "common/regression/schemes/option_error.h"

namespace zerodrift::regression {

bool is_learnable(const DriftLabel& label) noexcept {
  return std::isfinite(label.time_s) && is_positive(label.duration_s) &&
         std::isfinite(label.drift) && is_positive(label.variance) && !label.features.empty() &&
         label.features.size() <= kMaxDimension &&
         std::all_of(label.features.begin(), label.features.end(),
                     [](double feature) { return std::isfinite(feature); });
}

std::optional<std::string> InitialSetOptions::validate() const {
  if (labels < 2) return wrong_option("initial.labels", std::to_string(labels), "at least 2");
  if (std::isnan(until_s)) return wrong_option("initial.until_s", "not a number", "a time");
  return std::nullopt;
}

bool InitialSet::add(const DriftLabel& label) {
  assert(is_learnable(label) && "a label must be finite, with positive duration and variance");
  core::require(drifts_.empty() || label.features.size() == dimension_,
                "the number of features does not change from label to label");
  dimension_ = label.features.size();
  features_.insert(features_.end(), label.features.begin(), label.features.end());
  drifts_.push_back(label.drift);
  variances_.push_back(label.variance);
  return drifts_.size() >= options_.labels || label.time_s >= options_.until_s;
}

void InitialSet::release() noexcept {
  features_ = {};
  drifts_ = {};
  variances_ = {};
}

double InitialSet::mean() const noexcept {
  double sum = 0.0;
  for (const double drift : drifts_) sum += drift;
  return drifts_.empty() ? 0.0 : sum / static_cast<double>(drifts_.size());
}

double InitialSet::scale() const noexcept {
  // The mean of equal numbers may differ from them by rounding; that is no spread.
  const auto [lowest, highest] = std::minmax_element(drifts_.begin(), drifts_.end());
  if (drifts_.empty() || *lowest == *highest) return 1.0;
  const double centre = mean();
  double sum = 0.0;
  for (const double drift : drifts_) sum += (drift - centre) * (drift - centre);
  const double scale = std::sqrt(sum / static_cast<double>(drifts_.size()));
  return scale > 0.0 ? scale : 1.0;
}

}  // namespace zerodrift::regression
