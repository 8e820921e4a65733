// SPDX-License-Identifier: Apache-2.0
// Scale factor that changes with temperature (of the source's wavelength and of the coil):
//     k W (LP_lag(T) - T_ref)
// Default: 5 ppm/°C, what a wavelength-stabilised source leaves.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_scale_factor_temperature(const EffectContext& context) {
  const std::size_t axis = core::index(context.axis);
  const double per_degc = context.parameter("error_ppm_per_degc") * 1e-6;
  return with_memory(LaggedTemperature(context),
                     [=](LaggedTemperature& above, const EffectInputs& inputs) {
                       return per_degc * above.step(inputs) * inputs.true_rate_radps[axis];
                     });
}

}  // namespace

EffectDefinition scale_factor_temperature() {
  return {.equation = "k W (LP_lag(T) - T_ref)",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {{"error_ppm_per_degc", "k", 5.0, -1e6, 1e6},
                         reference_parameter(),
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kReferenceRate, Need::kTemperature},
          .confused_with = {"bias_temperature"},
          .make = make_scale_factor_temperature};
}

}  // namespace zerodrift::twin::effects
