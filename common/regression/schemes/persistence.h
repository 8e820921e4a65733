// SPDX-License-Identifier: Apache-2.0
// Holds the last stationary minute's mean: what every model has to be better than at short
// horizons.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "common/core/ring_buffer.h"
#include "common/regression/drift_scheme.h"

namespace zerodrift::regression {

struct PersistenceOptions {
  double window_s = 60.0;  // > 0

  // The first wrong key and what would be right; empty if all is well.
  [[nodiscard]] std::optional<std::string> validate() const;

  friend bool operator==(const PersistenceOptions&, const PersistenceOptions&) = default;
};

// Predicts the plain mean of the labels whose end lies less than `window_s` before the newest
// label's; of more than kMostLabels only the newest. How far the drift moves on is not known from
// that, so the variance is unknown. O(labels in the window) to learn, O(1) to predict.
class Persistence final : public DriftScheme {
 public:
  static constexpr std::size_t kMostLabels = 4096;

  // Throws std::invalid_argument with options.validate()'s sentence.
  explicit Persistence(const PersistenceOptions& options = {});

  void learn(const DriftLabel& label) override;
  [[nodiscard]] DriftPrediction predict(double time_s,
                                        std::span<const double> features) const override;

 private:
  struct Held {
    double time_s = 0.0;
    double drift = 0.0;
  };

  PersistenceOptions options_;
  core::RingBuffer<Held> held_{kMostLabels};
  double mean_ = 0.0;
};

}  // namespace zerodrift::regression
