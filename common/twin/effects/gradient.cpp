// SPDX-License-Identifier: Apache-2.0
// Temperature gradient across the coil:
//     g LP_lag(Ta - Tb)
// Default: 0.2 deg/h/°C between the outer and the inner layers.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_gradient(const EffectContext& context) {
  const TemperaturePoint from = context.inputs.at(0);
  const TemperaturePoint to = context.inputs.at(1);
  const double radps_per_degc = context.radps("coefficient_deg_h_per_degc");
  return with_memory(LowPass(context.parameter("lag_s"), context.interval_s),
                     [=](LowPass& lag, const EffectInputs& inputs) {
                       return radps_per_degc * lag.step(temperature_degc(inputs, from) -
                                                        temperature_degc(inputs, to));
                     });
}

}  // namespace

EffectDefinition gradient() {
  return {.equation = "g LP_lag(Ta - Tb)",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {{"coefficient_deg_h_per_degc", "g", 0.2}, lag_parameter()},
          .inputs = {TemperaturePoint::kCoilOuter, TemperaturePoint::kCoilInner},
          .needs = {Need::kTemperatureDifference},
          .confused_with = {"coil_lag"},
          .make = make_gradient};
}

}  // namespace zerodrift::twin::effects
