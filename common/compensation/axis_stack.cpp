// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/axis_stack.h"

#include <algorithm>

namespace zerodrift::compensation {
namespace {

// (2e-5 deg/h)²: keeps a noise-free record from dividing by zero.
constexpr double kSmallestVariance = 1e-20;
constexpr double kShortestLabelS = 1e-3;

}  // namespace

AxisStack::AxisStack(std::size_t dimension, std::size_t capacity) {
  const SvrModel empty(dimension, capacity);
  for (const double horizon_s : experts::kHorizonsS)
    past_.emplace_back(horizon_s, kModelsKept, empty);
}

void AxisStack::learn(const AxisLabel& label) noexcept {
  const double time_s = core::seconds(label.time);
  const experts::StackLabel own{.time_s = time_s,
                                .duration_s = std::max(label.duration_s, kShortestLabelS),
                                .drift = label.drift_radps,
                                .variance = std::max(label.variance, kSmallestVariance),
                                .thermal = label.thermal};
  in_time_.learn(own);
  if (!label.features) return;
  experts::Foretold foretold;
  for (std::size_t h = 0; h < past_.size(); ++h) {
    if (const SvrModel* past = past_[h].due(time_s)) {
      foretold[h] =
          as_expert(compensation::forecast(past->drift, past->trust, *label.features, label.time));
    }
  }
  stack_.learn(own, foretold);
}

void AxisStack::keep(const DriftModel& drift, const TrustTable& trust) noexcept {
  const double time_s = core::seconds(drift.time);
  for (auto& past : past_) {
    if (!past.wants(time_s)) continue;
    SvrModel& kept = past.keep(time_s);
    kept.drift = drift;
    kept.trust = trust;
  }
}

void AxisStack::restart() noexcept {
  stack_.restart();
  in_time_.restart();
  for (auto& past : past_) past.clear();
}

void AxisStack::reset() noexcept {
  stack_.reset();
  in_time_.reset();
  for (auto& past : past_) past.clear();
}

void AxisStack::carry(core::StateArchive& archive) {
  archive(stack_, in_time_);
  for (auto& past : past_) archive(past);
}

}  // namespace zerodrift::compensation
