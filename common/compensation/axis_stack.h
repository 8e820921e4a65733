// SPDX-License-Identifier: Apache-2.0
// The experts of one axis beside its online SVR, which is one of them: what the SVR foretold of a
// label at each horizon is given to the stack before either learns the label. And a second, smaller
// stack that learns every label without its temperature, for a gyro that has no thermometer, or
// none any more.
#pragma once

#include <cstddef>
#include <vector>

#include "common/compensation/axis_model.h"
#include "common/core/state_archive.h"
#include "common/experts/expert_stack.h"
#include "common/experts/past_forecasts.h"

namespace zerodrift::compensation {

// One thread; no allocation after construction.
class AxisStack {
 public:
  AxisStack(std::size_t dimension, std::size_t capacity);

  // A label that is later than the one before, not yet known to the SVR. O(banks), and O(samples)
  // of the SVR for each horizon.
  void learn(const AxisLabel& label) noexcept;
  // The SVR after that label, trained. O(samples) where it is kept.
  void keep(const DriftModel& drift, const TrustTable& trust) noexcept;
  [[nodiscard]] const experts::StackForecast& forecast() const noexcept {
    return stack_.forecast();
  }
  // By time alone.
  [[nodiscard]] const experts::StackForecast& forecast_in_time() const noexcept {
    return in_time_.forecast();
  }

  // The clock was set back; what was learned of temperature and trust stays.
  void restart() noexcept;
  void reset() noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive);

 private:
  static constexpr std::size_t kModelsKept = 4;  // over a horizon

  experts::ExpertStack stack_;                            // of labels with features
  experts::ExpertStack in_time_{experts::GoesBy::kTime};  // of all labels
  std::vector<experts::PastForecasts<SvrModel>> past_;    // by horizon
};

}  // namespace zerodrift::compensation
