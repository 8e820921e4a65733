// SPDX-License-Identifier: Apache-2.0
// Thermal rate effect of the coil's depth: the temperature rate felt inside the coil follows the
// measured one with a lag,
//     s LP_tau(dT/dt),  tau of 2 to 40 minutes
// Default: 0.5 deg/h per °C/min behind 10 minutes.
#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

class CoilLag final : public Effect {
 public:
  explicit CoilLag(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("tau_s"), context.interval_s),
        radps_per_degc_per_s_(
            core::radps_from_deg_h(context.parameter("coefficient_deg_h_min_per_degc")) * 60.0) {}

  double step(const EffectInputs& inputs) noexcept override {
    return radps_per_degc_per_s_ * lag_.step(temperature_rate_degc_per_s(inputs, input_));
  }

  void carry(core::StateArchive& archive) override { archive(lag_); }

 private:
  TemperaturePoint input_;
  LowPass lag_;
  double radps_per_degc_per_s_;
};

}  // namespace

EffectDefinition coil_lag() {
  return {.kind = "coil_lag",
          .equation = "s LP_tau(dT/dt)",
          .source = "Mohr, J. Lightwave Technology 14 (1996) 27 (heat conduction into the coil)",
          .contribution = Contribution::kDrift,
          .parameters = {{"coefficient_deg_h_min_per_degc", "s, deg/h per °C/min", 0.5},
                         {"tau_s",
                          "lag of the rate",
                          600.0,
                          0.0,
                          1e5,
                          ParameterRole::kShape,
                          {120.0, 240.0, 480.0, 900.0, 1500.0, 2400.0}}},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"shupe", "gradient"},
          .search = {.limit = "shupe"},
          .make = [](const EffectContext& c) { return std::make_unique<CoilLag>(c); }};
}

}  // namespace zerodrift::twin::effects
