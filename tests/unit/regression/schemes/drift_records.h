// SPDX-License-Identifier: Apache-2.0
// A simulated heat/cool record with coloured noise, and how schemes are run over it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "common/regression/drift_scheme.h"

namespace zerodrift::regression::testing {

// Standard normal numbers by Box and Muller: the standard library's distributions are not the same
// everywhere.
class Gaussian {
 public:
  explicit Gaussian(std::uint64_t seed) : engine_(seed) {}
  double next() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

// Temperature and rate.
using Features = std::array<double, 2>;

struct Record {
  std::vector<Features> features;
  std::vector<double> labels;
  std::vector<double> truth;
  double label_variance = 1.0;

  [[nodiscard]] std::size_t size() const { return labels.size(); }
  // Labels of one second, one a second.
  [[nodiscard]] DriftLabel label(std::size_t i) const {
    return {.time_s = static_cast<double>(i + 1),
            .duration_s = 1.0,
            .features = features[i],
            .drift = labels[i],
            .variance = label_variance};
  }
};

// Features of the order of 1, drift within about 1.5.
inline Features features_at(std::size_t i) {
  const double phase = 2.0 * std::numbers::pi * static_cast<double>(i) / 3000.0;
  return {std::sin(phase) + 0.15 * std::sin(0.37 * phase + 1.0), std::cos(phase)};
}

inline double smooth_drift(const Features& x) {
  const double t = x[0], rate = x[1];
  return 0.6 * t + 0.3 * std::sin(2.5 * t) + 0.25 * rate + 0.15 * t * rate + 0.1 * rate * rate;
}

inline constexpr double kLabelDeviation = 0.03;

// Heat/cool cycles of 3000 labels; white noise of kLabelDeviation in the labels, a random walk of
// `walk` a label in the drift itself.
inline Record heat_cool_record(std::size_t count, double walk, std::uint64_t seed) {
  Gaussian gaussian(seed);
  Record record;
  record.label_variance = kLabelDeviation * kLabelDeviation;
  double walked = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    walked += walk * gaussian.next();
    record.features.push_back(features_at(i));
    record.truth.push_back(smooth_drift(record.features.back()) + walked);
    record.labels.push_back(record.truth.back() + kLabelDeviation * gaussian.next());
  }
  return record;
}

// What a scheme predicted for each label, from the labels at least `delay` before it: 1 is
// test-then-train.
inline std::vector<DriftPrediction> predict_all(DriftScheme& scheme, const Record& record,
                                                std::size_t delay) {
  std::vector<DriftPrediction> predictions;
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (i >= delay) scheme.learn(record.label(i - delay));
    predictions.push_back(scheme.predict(static_cast<double>(i + 1), record.features[i]));
  }
  return predictions;
}

// Against the noise-free truth, of the labels from `first` on.
inline double rms_error(const Record& record, const std::vector<DriftPrediction>& predictions,
                        std::size_t first) {
  double sum = 0.0;
  for (std::size_t i = first; i < record.size(); ++i) {
    sum += (predictions[i].drift - record.truth[i]) * (predictions[i].drift - record.truth[i]);
  }
  return std::sqrt(sum / static_cast<double>(record.size() - first));
}

}  // namespace zerodrift::regression::testing
