// SPDX-License-Identifier: Apache-2.0
// A scheme of a comparison with a stopwatch.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <utility>

#include "common/comparison/compared_scheme.h"

namespace zerodrift::evaluation {

class TimedScheme final : public regression::DriftScheme {
 public:
  explicit TimedScheme(std::unique_ptr<regression::DriftScheme> scheme)
      : scheme_(std::move(scheme)) {}

  void observe(double time_s, std::span<const double> features) override {
    const auto begun = Clock::now();
    scheme_->observe(time_s, features);
    elapsed_ += Clock::now() - begun;
  }
  void learn(const regression::DriftLabel& label) override {
    const auto begun = Clock::now();
    scheme_->learn(label);
    elapsed_ += Clock::now() - begun;
  }
  [[nodiscard]] regression::DriftPrediction predict(
      double time_s, std::span<const double> features) const override {
    const auto begun = Clock::now();
    const auto made = scheme_->predict(time_s, features);
    elapsed_ += Clock::now() - begun;
    return made;
  }
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(elapsed_).count(); }

 private:
  using Clock = std::chrono::steady_clock;

  std::unique_ptr<regression::DriftScheme> scheme_;
  mutable Clock::duration elapsed_{};
};

}  // namespace zerodrift::evaluation
