// SPDX-License-Identifier: Apache-2.0
// Bias as a polynomial of temperature, without its constant (that is `bias`):
//     c1 D + c2 D² + c3 D³ + c4 D⁴,  D = LP_lag(T) - T_ref
// Default: 0.01 deg/h/°C, a usual data-sheet figure of tactical-grade FOGs.
#include "common/twin/effect_parts.h"
#include "common/twin/effects/bias_polynomial.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_bias_temperature(const EffectContext& context) {
  return with_memory(
      LaggedTemperature(context),
      [bias = BiasPolynomial(context)](LaggedTemperature& above, const EffectInputs& inputs) {
        return bias.radps(above.step(inputs));
      });
}

}  // namespace

EffectDefinition bias_temperature() {
  return {.equation = "c1 D + c2 D^2 + c3 D^3 + c4 D^4, D = LP_lag(T) - T_ref",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {reference_parameter(),
                         {"c1_deg_h_per_degc", "linear coefficient", 0.01},
                         {"c2_deg_h_per_degc2", "quadratic coefficient", 0.0},
                         {"c3_deg_h_per_degc3", "cubic coefficient", 0.0},
                         {"c4_deg_h_per_degc4", "quartic coefficient", 0.0},
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"shupe_temperature", "rate_ramp"},
          .search = {.lends = Lending::kConventions, .has_powers = true},
          .make = make_bias_temperature};
}

}  // namespace zerodrift::twin::effects
