// SPDX-License-Identifier: Apache-2.0
// Shupe effect: a coil whose temperature changes shows a rate proportional to the change,
//     s dT/dt
// Default: 1 deg/h per °C/min, a quadrupolar-wound coil of a few hundred metres.
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Shupe final : public Effect {
 public:
  explicit Shupe(const EffectContext& context)
      : input_(context.inputs.at(0)),
        radps_per_degc_per_s_(
            core::radps_from_deg_h(context.parameter("coefficient_deg_h_min_per_degc")) * 60.0) {}

  double step(const EffectInputs& inputs) noexcept override {
    return radps_per_degc_per_s_ * temperature_rate_degc_per_s(inputs, input_);
  }

 private:
  TemperaturePoint input_;
  double radps_per_degc_per_s_;
};

}  // namespace

EffectDefinition shupe() {
  return {.kind = "shupe",
          .equation = "s dT/dt",
          .source = "Shupe, Applied Optics 19 (1980) 654",
          .contribution = Contribution::kDrift,
          .parameters = {{"coefficient_deg_h_min_per_degc", "s, deg/h per °C/min", 1.0}},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"coil_lag", "gradient"},
          .make = [](const EffectContext& c) { return std::make_unique<Shupe>(c); }};
}

}  // namespace zerodrift::twin::effects
