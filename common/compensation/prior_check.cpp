// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/prior_check.h"

#include <algorithm>
#include <cmath>

namespace zerodrift::compensation {
namespace {

constexpr double kMovedBySigmas = 4.0;  // of the difference of two labels: dy / dp is known to 1/4
constexpr double kCertainBy = 4.0;      // standard errors: 16 moves each way, where nothing moves

}  // namespace

bool PriorCheck::Cost::is_certain() const noexcept {
  return squares > 0.0 && sum >= kCertainBy * std::sqrt(squares);
}

void PriorCheck::add(core::Axis axis, double drift_radps, double prior_radps,
                     double variance) noexcept {
  Axis& judged = axes_[core::index(axis)];
  if (!judged.prior_before) {
    judged.prior_before = prior_radps;
    judged.drift_before = drift_radps;
  }
  const double moved = prior_radps - *judged.prior_before;
  if (!(moved * moved > kMovedBySigmas * kMovedBySigmas * 2.0 * variance)) return;
  const double cost = 0.5 - std::clamp((drift_radps - judged.drift_before) / moved, 0.0, 1.0);
  judged.prior_before = prior_radps;
  judged.drift_before = drift_radps;
  Cost& costs = moved > 0.0 ? judged.rising : judged.falling;
  costs.sum += cost;
  costs.squares += cost * cost;
  judged.costs = judged.costs || (judged.rising.is_certain() && judged.falling.is_certain());
}

void PriorCheck::restart() noexcept {
  for (Axis& axis : axes_) axis.prior_before.reset();
}

std::uint64_t PriorCheck::found() const noexcept {
  return static_cast<std::uint64_t>(
      std::count_if(axes_.begin(), axes_.end(), [](const Axis& axis) { return axis.costs; }));
}

}  // namespace zerodrift::compensation
