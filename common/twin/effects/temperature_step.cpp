// SPDX-License-Identifier: Apache-2.0
// Bias that jumps where a temperature passes a threshold (a mode hop, a contact that opens), with
// hysteresis:
//     A while switched on; on above T_c + h/2, off below T_c - h/2, in between as before,  T behind
//     lag_s
// At the first sample it is on above T_c. Default: 0.1 deg/h at 25 °C, 0.5 °C wide.
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

class TemperatureStep final : public Effect {
 public:
  explicit TemperatureStep(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        radps_(context.radps("amplitude_deg_h")),
        threshold_degc_(context.parameter("threshold_degc")),
        half_width_degc_(context.parameter("width_degc") / 2.0) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double above_degc = lag_.step(temperature_degc(inputs, input_)) - threshold_degc_;
    if (std::isfinite(above_degc)) follow(above_degc);
    return side_ == Side::kAbove ? radps_ : 0.0;
  }

  void carry(core::StateArchive& archive) override { archive(lag_, side_); }

 private:
  enum class Side { kUnknown, kBelow, kAbove };

  void follow(double above_degc) noexcept {
    const double half_width_degc = side_ == Side::kUnknown ? 0.0 : half_width_degc_;
    if (above_degc > half_width_degc) {
      side_ = Side::kAbove;
    } else if (above_degc < -half_width_degc || side_ == Side::kUnknown) {
      side_ = Side::kBelow;
    }
  }

  TemperaturePoint input_;
  LowPass lag_;
  double radps_;
  double threshold_degc_;
  double half_width_degc_;
  Side side_ = Side::kUnknown;
};

// A jump is narrow: many thresholds are tried for it, hence few lags.
ParameterDefinition short_lag() {
  ParameterDefinition lag = lag_parameter();
  lag.grid = {0.0, 60.0, 180.0};
  return lag;
}

}  // namespace

EffectDefinition temperature_step() {
  return {.equation = "A while on; on above T_c + h/2, off below T_c - h/2, T behind lag",
          .source = "Brokate & Sprekels, Hysteresis and Phase Transitions (1996), relay",
          .parameters = {{"amplitude_deg_h", "A", 0.1},
                         shape("threshold_degc", "T_c", 25.0, {-273.15, 1e3},
                               {-15.0, -5.0, 5.0, 15.0, 25.0, 35.0, 45.0, 55.0},
                               SearchRule::kThreshold),
                         shape("width_degc", "h", 0.5, {0.0, 100.0}, {0.0, 1.0, 3.0}),
                         short_lag()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"telegraph"},
          .make = make<TemperatureStep>};
}

}  // namespace zerodrift::twin::effects
