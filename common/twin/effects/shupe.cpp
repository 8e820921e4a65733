// SPDX-License-Identifier: Apache-2.0
// Shupe effect: a coil whose temperature changes shows a rate proportional to the change,
//     s dT/dt
// Default: 1 deg/h per °C/min, a quadrupolar-wound coil of a few hundred metres.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_shupe(const EffectContext& context) {
  const TemperaturePoint input = context.inputs.at(0);
  const double radps_per_degc_per_s = context.radps("coefficient_deg_h_min_per_degc") * 60.0;
  return without_memory([=](const EffectInputs& inputs) {
    return radps_per_degc_per_s * temperature_rate_degc_per_s(inputs, input);
  });
}

}  // namespace

EffectDefinition shupe() {
  return {.equation = "s dT/dt",
          .source = "Shupe, Applied Optics 19 (1980) 654",
          .parameters = {{"coefficient_deg_h_min_per_degc", "s, deg/h per °C/min", 1.0}},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"coil_lag", "gradient"},
          .make = make_shupe};
}

}  // namespace zerodrift::twin::effects
