// SPDX-License-Identifier: Apache-2.0
// Labels for tests of the comparison, and a scheme that notes all it is told.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "common/comparison/test_then_train.h"

namespace zerodrift::comparison {

// 5 s long, ending at 5 s, 10 s, ... less those that `missing` names by their number from 0. The
// first feature and the drift are the label's number.
inline std::vector<LabelledPoint> numbered_points(std::size_t count,
                                                  const std::vector<std::size_t>& missing = {}) {
  std::vector<LabelledPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::find(missing.begin(), missing.end(), i) != missing.end()) continue;
    LabelledPoint point;
    point.begin = core::from_seconds(5.0 * static_cast<double>(i));
    point.end = core::from_seconds(5.0 * static_cast<double>(i + 1));
    point.drift_radps = static_cast<double>(i);
    point.variance = 1.0;
    point.features[0] = static_cast<double>(i);
    points.push_back(point);
  }
  return points;
}

// Predicts what it is told to and keeps, for each prediction, the labels learned before it.
class SpyScheme final : public regression::DriftScheme {
 public:
  explicit SpyScheme(double predicted = 0.0, double variance = -1.0)
      : SpyScheme(regression::DriftPrediction{.drift = predicted, .variance = variance}) {}
  explicit SpyScheme(const regression::DriftPrediction& predicted) : predicted_(predicted) {}

  void learn(const regression::DriftLabel& label) override {
    learned_.push_back(label.time_s);
    drifts_learned_.push_back(label.drift);
    features_learned_.emplace_back(label.features.begin(), label.features.end());
  }
  [[nodiscard]] regression::DriftPrediction predict(
      double time_s, std::span<const double> features) const override {
    asked_.push_back({time_s, features[0], learned_});
    return predicted_;
  }

  struct Asked {
    double time_s;
    double feature;
    std::vector<double> learned_s;  // ends of all labels learned until then
  };
  [[nodiscard]] const std::vector<Asked>& asked() const { return asked_; }
  [[nodiscard]] const std::vector<double>& learned() const { return learned_; }
  [[nodiscard]] const std::vector<double>& drifts_learned() const { return drifts_learned_; }
  [[nodiscard]] const std::vector<std::vector<double>>& features_learned() const {
    return features_learned_;
  }

 private:
  regression::DriftPrediction predicted_;
  std::vector<double> learned_;
  std::vector<double> drifts_learned_;
  std::vector<std::vector<double>> features_learned_;
  mutable std::vector<Asked> asked_;
};

}  // namespace zerodrift::comparison
