// SPDX-License-Identifier: Apache-2.0
// Shupe coefficient that itself depends on temperature (the coating's stiffness does):
//     s (LP_lag(T) - T_ref) dT/dt
// Default: 0.01 deg/h per °C/min and °C, 1 % of the Shupe effect's own default a degree.
#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

class ShupeTemperature final : public Effect {
 public:
  explicit ShupeTemperature(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        reference_degc_(context.parameter("reference_degc")),
        radps_per_degc2_per_s_(
            core::radps_from_deg_h(context.parameter("coefficient_deg_h_min_per_degc2")) * 60.0) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double above_degc = lag_.step(temperature_degc(inputs, input_)) - reference_degc_;
    return radps_per_degc2_per_s_ * above_degc * temperature_rate_degc_per_s(inputs, input_);
  }

  void carry(core::StateArchive& archive) override { archive(lag_); }

 private:
  TemperaturePoint input_;
  LowPass lag_;
  double reference_degc_;
  double radps_per_degc2_per_s_;
};

}  // namespace

EffectDefinition shupe_temperature() {
  return {.kind = "shupe_temperature",
          .equation = "s (LP_lag(T) - T_ref) dT/dt",
          .source = "Shupe, Applied Optics 19 (1980) 654, with a coefficient linear in T",
          .contribution = Contribution::kDrift,
          .parameters = {reference_parameter(),
                         {"coefficient_deg_h_min_per_degc2", "s, deg/h per °C/min and °C", 0.01},
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"bias_temperature"},
          .make = [](const EffectContext& c) { return std::make_unique<ShupeTemperature>(c); }};
}

}  // namespace zerodrift::twin::effects
