// SPDX-License-Identifier: Apache-2.0
// Bias as a polynomial of temperature, without its constant (that is `bias`):
//     c1 D + c2 D² + c3 D³ + c4 D⁴,  D = LP_lag(T) - T_ref
// Default: 0.01 deg/h/°C, a usual data-sheet figure of tactical-grade FOGs.
#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

class BiasTemperature final : public Effect {
 public:
  explicit BiasTemperature(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        reference_degc_(context.parameter("reference_degc")),
        c1_(core::radps_from_deg_h(context.parameter("c1_deg_h_per_degc"))),
        c2_(core::radps_from_deg_h(context.parameter("c2_deg_h_per_degc2"))),
        c3_(core::radps_from_deg_h(context.parameter("c3_deg_h_per_degc3"))),
        c4_(core::radps_from_deg_h(context.parameter("c4_deg_h_per_degc4"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double d = lag_.step(temperature_degc(inputs, input_)) - reference_degc_;
    return d * (c1_ + d * (c2_ + d * (c3_ + d * c4_)));
  }

  void carry(core::StateArchive& archive) override { archive(lag_); }

 private:
  TemperaturePoint input_;
  LowPass lag_;
  double reference_degc_;
  double c1_, c2_, c3_, c4_;  // rad/s per °C, °C², °C³, °C⁴
};

}  // namespace

EffectDefinition bias_temperature() {
  return {.kind = "bias_temperature",
          .equation = "c1 D + c2 D^2 + c3 D^3 + c4 D^4, D = LP_lag(T) - T_ref",
          .source = "IEEE Std 952-1997, model equation",
          .contribution = Contribution::kDrift,
          .parameters = {reference_parameter(),
                         {"c1_deg_h_per_degc", "linear coefficient", 0.01},
                         {"c2_deg_h_per_degc2", "quadratic coefficient", 0.0},
                         {"c3_deg_h_per_degc3", "cubic coefficient", 0.0},
                         {"c4_deg_h_per_degc4", "quartic coefficient", 0.0},
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"shupe_temperature", "rate_ramp"},
          .search = {.lends_conventions = true},
          .make = [](const EffectContext& c) { return std::make_unique<BiasTemperature>(c); }};
}

}  // namespace zerodrift::twin::effects
