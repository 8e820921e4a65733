// SPDX-License-Identifier: Apache-2.0
// Bias shift under vibration:
//     k g²,  g the rms of the vibration
// Default: 0.01 deg/h/g².
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_vibration_rectification(const EffectContext& context) {
  const double radps_per_g2 = context.radps("coefficient_deg_h_per_g2");
  return without_memory([=](const EffectInputs& inputs) {
    return radps_per_g2 * inputs.vibration_g * inputs.vibration_g;
  });
}

}  // namespace

EffectDefinition vibration_rectification() {
  return {.equation = "k g^2",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {{"coefficient_deg_h_per_g2", "k", 0.01}},
          .needs = {Need::kVibration},
          .confused_with = {"acceleration_sensitivity"},
          .make = make_vibration_rectification};
}

}  // namespace zerodrift::twin::effects
