// SPDX-License-Identifier: Apache-2.0
// A gyro stamped late by delta: at the time it names, it shows the rate of delta earlier,
//     W(t - delta) - W(t),  to first order -delta dW/dt,  W the mean over the integration interval
// Exact for a rate that is constant over each interval; before the first sample W is as at it. A
// negative delta (stamped early) continues W by its last difference, which errs by |delta| (|delta|
// + dt)/2 times its second derivative. Default: 5 ms, one sample at 200 Hz.
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

class ClockOffset final : public Effect {
 public:
  explicit ClockOffset(const EffectContext& context) : axis_(core::index(context.axis)) {
    const double samples = context.parameter("delay_s") / context.interval_s;
    const double whole = std::max(0.0, std::floor(samples));
    share_of_earlier_ = samples - whole;
    history_.resize(static_cast<std::size_t>(whole) + 2);
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double rate = inputs.true_rate_radps[axis_];
    if (!std::isfinite(rate)) return rate;
    if (!started_) std::fill(history_.begin(), history_.end(), rate);
    started_ = true;
    history_[newest_] = rate;
    const std::size_t oldest = next(newest_);
    const double later = history_[next(oldest)];
    newest_ = oldest;
    return later + share_of_earlier_ * (history_[oldest] - later) - rate;
  }

 private:
  [[nodiscard]] std::size_t next(std::size_t i) const noexcept {
    return i + 1 == history_.size() ? 0 : i + 1;
  }

  std::size_t axis_;
  double share_of_earlier_ = 0.0;  // of an interval; negative where delta is
  std::vector<double> history_;    // the whole samples of delta and two more, as a ring
  std::size_t newest_ = 0;
  bool started_ = false;
};

}  // namespace

EffectDefinition clock_offset() {
  return {.equation = "W(t - delta) - W(t)",
          .source = "definition of a time-stamp error",
          .family = Family::kRecordFault,
          .contribution = Contribution::kOutput,
          .parameters = {shape("delay_s", "delta", 5e-3, {-1.0, 10.0},
                               {-0.1, -0.03, -0.01, 0.01, 0.03, 0.1})},
          .needs = {Need::kReferenceRate, Need::kTimeStamps},
          .search = {.follows_inputs = true},
          .make = make<ClockOffset>};
}

}  // namespace zerodrift::twin::effects
