// SPDX-License-Identifier: Apache-2.0
// Shupe coefficient that itself depends on temperature (the coating's stiffness does):
//     s (LP_lag(T) - T_ref) dT/dt
// Default: 0.01 deg/h per °C/min and °C, 1 % of the Shupe effect's own default a degree.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_shupe_temperature(const EffectContext& context) {
  const TemperaturePoint input = context.inputs.at(0);
  const double radps_per_degc2_per_s = context.radps("coefficient_deg_h_min_per_degc2") * 60.0;
  return with_memory(LaggedTemperature(context), [=](LaggedTemperature& above,
                                                     const EffectInputs& inputs) {
    return radps_per_degc2_per_s * above.step(inputs) * temperature_rate_degc_per_s(inputs, input);
  });
}

}  // namespace

EffectDefinition shupe_temperature() {
  return {.equation = "s (LP_lag(T) - T_ref) dT/dt",
          .source = "Shupe, Applied Optics 19 (1980) 654, with a coefficient linear in T",
          .parameters = {reference_parameter(),
                         {"coefficient_deg_h_min_per_degc2", "s, deg/h per °C/min and °C", 0.01},
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"bias_temperature"},
          .make = make_shupe_temperature};
}

}  // namespace zerodrift::twin::effects
