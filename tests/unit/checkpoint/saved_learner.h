// SPDX-License-Identifier: Apache-2.0
// A small learner with everything in it that a checkpoint holds.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <utility>

#include "common/compensation/learner.h"

namespace zerodrift::checkpoint::testing {

inline compensation::CompensationOptions small_options() {
  compensation::CompensationOptions options;
  // Laws of the format change every byte; the stack's state has ten times as many.
  options.scheme = compensation::Scheme::kOnlineSvr;
  options.features = {{.kind = thermal::FeatureKind::kTemperature, .probe = "coil"}};
  options.model.capacity = 10;
  options.learning.initial_labels = 4;
  return options;
}

// A learner with its queues, worked by one thread.
class Bench {
 public:
  explicit Bench(const compensation::CompensationOptions& options)
      : exchange_(options), learner_(options, exchange_) {}

  void work(compensation::TrainingJob job) {
    job.number = ++jobs_;
    exchange_.submit(job);
    learner_.run_one();
    exchange_.activate_next();
  }
  // Labels number first, first + 1, ... of a drift that swings; every seventh has no features.
  void learn(int first, int count) {
    for (int n = first; n < first + count; ++n) {
      compensation::Label label;
      label.end = core::from_seconds(5.0 * n);
      for (std::size_t i = 0; i < core::kAxisCount; ++i) {
        label.valid[i] = true;
        label.features_ready[i] = n % 7 != 6;
        label.features[i][0] = std::sin(0.1 * n);
        label.drift_radps[i] = 1e-5 * std::sin(0.2 * n + static_cast<double>(i));
        label.variance_radps2[i] = 1e-14;
      }
      work({.kind = compensation::TrainingJob::Kind::kLabel, .label = label});
    }
  }
  void restore(std::shared_ptr<compensation::RestoredLearner> restored) {
    work({.kind = compensation::TrainingJob::Kind::kRestore,
          .label = {},
          .restored = std::move(restored)});
  }
  [[nodiscard]] compensation::LearnerState state() { return learner_.export_state(); }
  [[nodiscard]] const compensation::ModelSnapshot& active() const {
    if (exchange_.active() == nullptr) throw std::logic_error("no active snapshot");
    return *exchange_.active();
  }

 private:
  compensation::ModelExchange exchange_;
  compensation::Learner learner_;
  std::uint64_t jobs_ = 0;
};

inline compensation::LearnerState saved_after(int labels) {
  Bench bench(small_options());
  bench.learn(0, labels);
  return bench.state();
}

}  // namespace zerodrift::checkpoint::testing
