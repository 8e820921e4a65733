// SPDX-License-Identifier: Apache-2.0
// Two levels A apart that alternate with a period, as what a heater or a cooler on a timer does to
// its neighbours: above for the share `duty` of each period, about a mean of 0 and averaged over
// the integration interval:
//     A (share of [t - dt, t] in which frac(f t + phi) < duty, less duty)
// Default: 0.05 deg/h, a third of every quarter of an hour.
#include <algorithm>
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

// In periods, since the phase was 0.
double time_above(double turns, double duty) {
  const double whole = std::floor(turns);
  return whole * duty + std::min(turns - whole, duty);
}

std::unique_ptr<Effect> make_duty_cycle(const EffectContext& context) {
  const double radps = context.radps("amplitude_deg_h");
  const double frequency_hz = context.parameter("frequency_hz");
  const double duty = context.parameter("duty");
  const double phase_turns = context.parameter("phase_turns");
  const double turns_an_interval = frequency_hz * context.interval_s;
  return without_memory([=](const EffectInputs& inputs) {
    const double turns = frequency_hz * inputs.time_s + phase_turns;
    const double share =
        (time_above(turns, duty) - time_above(turns - turns_an_interval, duty)) / turns_an_interval;
    return radps * (share - duty);
  });
}

}  // namespace

EffectDefinition duty_cycle() {
  return {.equation = "A (share of the interval with frac(f t + phi) < duty, less duty)",
          .source = "two-position control: Tsypkin, Relay Control Systems (1984)",
          .parameters = {{"amplitude_deg_h", "A, between the levels", 0.05},
                         shape("frequency_hz", "f", 1.0 / 900.0, {1e-9, 1e5},
                               {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3},
                               SearchRule::kCycleFrequency),
                         shape("duty", "share of a period above", 1.0 / 3.0, {0.02, 0.98},
                               {0.15, 0.3, 0.5}, SearchRule::kCycleDuty),
                         shape("phase_turns", "phi, of periods", 0.0, {-1e3, 1e3},
                               {0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875},
                               SearchRule::kCyclePhase)},
          .needs = {Need::kLongRecord},
          .confused_with = {"line", "telegraph"},
          .search = {.has_free_phase = true},
          .make = make_duty_cycle};
}

}  // namespace zerodrift::twin::effects
