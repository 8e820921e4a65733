// SPDX-License-Identifier: Apache-2.0
// Scale factor that changes with temperature (of the source's wavelength and of the coil):
//     k W (LP_lag(T) - T_ref)
// Default: 5 ppm/°C, what a wavelength-stabilised source leaves.
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

class ScaleFactorTemperature final : public Effect {
 public:
  explicit ScaleFactorTemperature(const EffectContext& context)
      : axis_(core::index(context.axis)),
        input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        per_degc_(context.parameter("error_ppm_per_degc") * 1e-6),
        reference_degc_(context.parameter("reference_degc")) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double above_degc = lag_.step(temperature_degc(inputs, input_)) - reference_degc_;
    return per_degc_ * above_degc * inputs.true_rate_radps[axis_];
  }

 private:
  std::size_t axis_;
  TemperaturePoint input_;
  LowPass lag_;
  double per_degc_;
  double reference_degc_;
};

}  // namespace

EffectDefinition scale_factor_temperature() {
  return {
      .kind = "scale_factor_temperature",
      .equation = "k W (LP_lag(T) - T_ref)",
      .source = "IEEE Std 952-1997, model equation",
      .contribution = Contribution::kDrift,
      .parameters = {{"error_ppm_per_degc", "k", 5.0, -1e6, 1e6},
                     reference_parameter(),
                     lag_parameter()},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kReferenceRate, Need::kTemperature},
      .confused_with = {"bias_temperature"},
      .make = [](const EffectContext& c) { return std::make_unique<ScaleFactorTemperature>(c); }};
}

}  // namespace zerodrift::twin::effects
