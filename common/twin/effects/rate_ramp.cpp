// SPDX-License-Identifier: Apache-2.0
// Slow ageing-like trend over the record, that a power-on doesn't restart:
//     R t + L ln(1 + t/tau)
// Allan variance of the linear part R² tau²/2. Default: 0.01 deg/h per hour, no logarithm.
#include <algorithm>
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_rate_ramp(const EffectContext& context) {
  const double radps2 = context.radps("ramp_deg_per_h2") / core::kSecondsPerHour;
  const double logarithm_radps = context.radps("logarithm_deg_h");
  const double tau_s = context.parameter("logarithm_tau_s");
  return without_memory([=](const EffectInputs& inputs) {
    const double t = std::max(inputs.time_s, 0.0);
    const double logarithm = logarithm_radps != 0.0 ? logarithm_radps * std::log1p(t / tau_s) : 0.0;
    return radps2 * t + logarithm;
  });
}

}  // namespace

EffectDefinition rate_ramp() {
  return {.equation = "R t + L ln(1 + t/tau), t since the start of the record",
          .source = "IEEE Std 952-1997, Annex C",
          .parameters = {{"ramp_deg_per_h2", "R, deg/h per hour", 0.01},
                         {"logarithm_deg_h", "L", 0.0},
                         shape("logarithm_tau_s", "tau", 3600.0, {1e-3, 1e9},
                               {60.0, 300.0, 1200.0, 3600.0, 14400.0})},
          .needs = {Need::kLongRecord},
          .confused_with = {"rate_random_walk"},
          .make = make_rate_ramp};
}

}  // namespace zerodrift::twin::effects
