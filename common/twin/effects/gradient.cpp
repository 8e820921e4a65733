// SPDX-License-Identifier: Apache-2.0
// Temperature gradient across the coil:
//     g LP_lag(Ta - Tb)
// Default: 0.2 deg/h/°C between the outer and the inner layers.
#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

class Gradient final : public Effect {
 public:
  explicit Gradient(const EffectContext& context)
      : from_(context.inputs.at(0)),
        to_(context.inputs.at(1)),
        lag_(context.parameter("lag_s"), context.interval_s),
        radps_per_degc_(core::radps_from_deg_h(context.parameter("coefficient_deg_h_per_degc"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    return radps_per_degc_ *
           lag_.step(temperature_degc(inputs, from_) - temperature_degc(inputs, to_));
  }

  void carry(core::StateArchive& archive) override { archive(lag_); }

 private:
  TemperaturePoint from_;
  TemperaturePoint to_;
  LowPass lag_;
  double radps_per_degc_;
};

}  // namespace

EffectDefinition gradient() {
  return {.kind = "gradient",
          .equation = "g LP_lag(Ta - Tb)",
          .source = "IEEE Std 952-1997, model equation",
          .contribution = Contribution::kDrift,
          .parameters = {{"coefficient_deg_h_per_degc", "g", 0.2}, lag_parameter()},
          .inputs = {TemperaturePoint::kCoilOuter, TemperaturePoint::kCoilInner},
          .needs = {Need::kTemperatureDifference},
          .confused_with = {"coil_lag"},
          .make = [](const EffectContext& c) { return std::make_unique<Gradient>(c); }};
}

}  // namespace zerodrift::twin::effects
