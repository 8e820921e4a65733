// SPDX-License-Identifier: Apache-2.0
// Transient after power-on as the light source and electronics settle:
//     A exp(-(t/tau)^p),  t since power-on
// Default: 0.2 deg/h dying away in 10 minutes.
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_warm_up(const EffectContext& context) {
  const double amplitude_radps = context.radps("amplitude_deg_h");
  const double tau_s = context.parameter("tau_s");
  const double exponent = context.parameter("exponent");
  return without_memory([=](const EffectInputs& inputs) {
    const double age = inputs.since_power_on_s / tau_s;
    const double decay = exponent == 1.0 ? age : std::pow(age, exponent);
    return amplitude_radps * std::exp(-decay);
  });
}

}  // namespace

EffectDefinition warm_up() {
  return {.equation = "A exp(-(t/tau)^p), t since power-on",
          .source = "IEEE Std 952-1997 (warm-up time); stretched exponential",
          .parameters = {{"amplitude_deg_h", "A", 0.2},
                         shape("tau_s", "decay time", 600.0, {1e-3, 1e6},
                               {60.0, 180.0, 420.0, 900.0, 1800.0, 3600.0}),
                         shape("exponent", "p, 1 = plain exponential", 1.0, {0.05, 5.0},
                               {0.6, 1.0, 1.5})},
          .needs = {Need::kPowerOn},
          .confused_with = {"rate_ramp"},
          .make = make_warm_up};
}

}  // namespace zerodrift::twin::effects
