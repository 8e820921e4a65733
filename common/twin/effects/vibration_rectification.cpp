// SPDX-License-Identifier: Apache-2.0
// Bias shift under vibration:
//     k g²,  g the rms of the vibration
// Default: 0.01 deg/h/g².
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class VibrationRectification final : public Effect {
 public:
  explicit VibrationRectification(const EffectContext& context)
      : radps_per_g2_(core::radps_from_deg_h(context.parameter("coefficient_deg_h_per_g2"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    return radps_per_g2_ * inputs.vibration_g * inputs.vibration_g;
  }

 private:
  double radps_per_g2_;
};

}  // namespace

EffectDefinition vibration_rectification() {
  return {
      .kind = "vibration_rectification",
      .equation = "k g^2",
      .source = "IEEE Std 952-1997, model equation",
      .contribution = Contribution::kDrift,
      .parameters = {{"coefficient_deg_h_per_g2", "k", 0.01}},
      .inputs = {},
      .needs = {Need::kVibration},
      .confused_with = {"acceleration_sensitivity"},
      .make = [](const EffectContext& c) { return std::make_unique<VibrationRectification>(c); }};
}

}  // namespace zerodrift::twin::effects
