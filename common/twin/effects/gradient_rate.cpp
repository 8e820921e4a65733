// SPDX-License-Identifier: Apache-2.0
// A gradient across the coil that is building up, and a temperature rate that changes:
//     g LP_tau(d(Ta - Tb)/dt) + c d/dt LP_tau(dT/dt),  T the mean of Ta and Tb
// The smoothing makes the second derivative usable on measured temperatures. Default: 0.5 deg/h per
// °C/min between the coil's layers, half of the Shupe effect's own default.
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

class GradientRate final : public Effect {
 public:
  explicit GradientRate(const EffectContext& context)
      : from_(context.inputs.at(0)),
        to_(context.inputs.at(1)),
        interval_s_(context.interval_s),
        gradient_rate_(context.parameter("smoothing_s"), context.interval_s),
        mean_rate_(context.parameter("smoothing_s"), context.interval_s),
        radps_per_degc_per_s_(context.radps("gradient_deg_h_min_per_degc") * 60.0),
        radps_per_degc_per_s2_(context.radps("curvature_deg_h_min2_per_degc") * 3600.0) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double from = temperature_rate_degc_per_s(inputs, from_);
    const double to = temperature_rate_degc_per_s(inputs, to_);
    const double rate = mean_rate_.step(0.5 * (from + to));
    const double change = started_ ? (rate - previous_rate_) / interval_s_ : 0.0;
    if (std::isfinite(rate)) {
      previous_rate_ = rate;
      started_ = true;
    }
    return radps_per_degc_per_s_ * gradient_rate_.step(from - to) + radps_per_degc_per_s2_ * change;
  }

  void carry(core::StateArchive& archive) override {
    archive(gradient_rate_, mean_rate_, previous_rate_, started_);
  }

 private:
  TemperaturePoint from_;
  TemperaturePoint to_;
  double interval_s_;
  LowPass gradient_rate_;
  LowPass mean_rate_;
  double radps_per_degc_per_s_;
  double radps_per_degc_per_s2_;
  double previous_rate_ = 0.0;  // °C/s, smoothed
  bool started_ = false;
};

}  // namespace

EffectDefinition gradient_rate() {
  return {.equation = "g LP_tau(d(Ta - Tb)/dt) + c d/dt LP_tau(dT/dt), T = (Ta + Tb)/2",
          .source = "Mohr, J. Lightwave Technology 14 (1996) 27, expanded in time",
          .parameters = {{"gradient_deg_h_min_per_degc", "g, deg/h per °C/min", 0.5},
                         {"curvature_deg_h_min2_per_degc", "c, deg/h per °C/min²", 0.0},
                         shape("smoothing_s", "tau", 60.0, {0.0, 1e5}, {30.0, 60.0, 120.0, 300.0})},
          .inputs = {TemperaturePoint::kCoilOuter, TemperaturePoint::kCoilInner},
          .needs = {Need::kTemperatureDifference},
          .confused_with = {"shupe"},
          .make = make<GradientRate>};
}

}  // namespace zerodrift::twin::effects
