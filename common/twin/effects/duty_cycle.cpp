// SPDX-License-Identifier: Apache-2.0
// Two levels A apart that alternate with a period, as what a heater or a cooler on a timer does to
// its neighbours: above for the share `duty` of each period, about a mean of 0 and averaged over
// the integration interval:
//     A (share of [t - dt, t] in which frac(f t + phi) < duty, less duty)
// Default: 0.05 deg/h, a third of every quarter of an hour.
#include <algorithm>
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class DutyCycle final : public Effect {
 public:
  explicit DutyCycle(const EffectContext& context)
      : radps_(core::radps_from_deg_h(context.parameter("amplitude_deg_h"))),
        frequency_hz_(context.parameter("frequency_hz")),
        duty_(context.parameter("duty")),
        phase_turns_(context.parameter("phase_turns")),
        turns_an_interval_(frequency_hz_ * context.interval_s) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double turns = frequency_hz_ * inputs.time_s + phase_turns_;
    const double share =
        (time_above(turns) - time_above(turns - turns_an_interval_)) / turns_an_interval_;
    return radps_ * (share - duty_);
  }

 private:
  // In periods, since the phase was 0.
  [[nodiscard]] double time_above(double turns) const noexcept {
    const double whole = std::floor(turns);
    return whole * duty_ + std::min(turns - whole, duty_);
  }

  double radps_;
  double frequency_hz_;
  double duty_;
  double phase_turns_;
  double turns_an_interval_;
};

}  // namespace

EffectDefinition duty_cycle() {
  return {.kind = "duty_cycle",
          .equation = "A (share of the interval with frac(f t + phi) < duty, less duty)",
          .source = "two-position control: Tsypkin, Relay Control Systems (1984)",
          .contribution = Contribution::kDrift,
          .parameters = {{"amplitude_deg_h", "A, between the levels", 0.05},
                         {"frequency_hz",
                          "f",
                          1.0 / 900.0,
                          1e-9,
                          1e5,
                          ParameterRole::kShape,
                          {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3},
                          SearchRule::kCycleFrequency},
                         {"duty",
                          "share of a period above",
                          1.0 / 3.0,
                          0.02,
                          0.98,
                          ParameterRole::kShape,
                          {0.15, 0.3, 0.5},
                          SearchRule::kCycleDuty},
                         {"phase_turns",
                          "phi, of periods",
                          0.0,
                          -1e3,
                          1e3,
                          ParameterRole::kShape,
                          {0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875},
                          SearchRule::kCyclePhase}},
          .inputs = {},
          .needs = {Need::kLongRecord},
          .confused_with = {"line", "telegraph"},
          .search = {.has_free_phase = true},
          .make = [](const EffectContext& c) { return std::make_unique<DutyCycle>(c); }};
}

}  // namespace zerodrift::twin::effects
