// SPDX-License-Identifier: Apache-2.0
// Bias that remembers where the temperature came from, as a group of stop operators of the
// temperature (Prandtl-Ishlinskii):
//     a1 E1/r1 + ... + a5 E5/r5,  E_i(k) = clamp(E_i(k-1) + T(k) - T(k-1), -r_i, r_i),  T behind
//     lag_s
// with thresholds r_i = r 2^(i-1) and E_i = 0 at the first sample. The loop doesn't depend on the
// rate of the temperature. Each a_i is what its operator gives once the temperature has moved 2 r_i
// one way. One operator alone is a poor loop; together with bias_temperature the group follows
// most. Default: a loop of 2 * 0.05 deg/h by the operator of 2 °C.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

constexpr std::size_t kOperators = 5;

class Hysteresis final : public Effect {
 public:
  explicit Hysteresis(const EffectContext& context)
      : input_(context.inputs.at(0)), lag_(context.parameter("lag_s"), context.interval_s) {
    double threshold_degc = context.parameter("smallest_threshold_degc");
    for (std::size_t i = 0; i < kOperators; ++i, threshold_degc *= 2.0) {
      const double amplitude = context.parameter("a" + std::to_string(i + 1) + "_deg_h");
      operators_[i] = {threshold_degc, core::radps_from_deg_h(amplitude) / threshold_degc, 0.0};
    }
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double temperature = lag_.step(temperature_degc(inputs, input_));
    if (std::isfinite(temperature)) {
      move(started_ ? temperature - previous_degc_ : 0.0);
      previous_degc_ = temperature;
      started_ = true;
    }
    double sum = 0.0;
    for (const Stop& stop : operators_) sum += stop.radps_per_degc * stop.stress_degc;
    return sum;
  }

  void carry(core::StateArchive& archive) override {
    archive(lag_, previous_degc_, started_);
    for (Stop& stop : operators_) archive(stop.stress_degc);
  }

 private:
  struct Stop {
    double threshold_degc = 0.0;
    double radps_per_degc = 0.0;
    double stress_degc = 0.0;  // within -threshold and threshold
  };

  void move(double by_degc) noexcept {
    for (Stop& stop : operators_) {
      stop.stress_degc =
          std::clamp(stop.stress_degc + by_degc, -stop.threshold_degc, stop.threshold_degc);
    }
  }

  TemperaturePoint input_;
  LowPass lag_;
  std::array<Stop, kOperators> operators_{};
  double previous_degc_ = 0.0;
  bool started_ = false;
};

}  // namespace

EffectDefinition hysteresis() {
  return {
      .equation =
          "sum of a_i E_i/r_i, E_i stop operators of T with thresholds r, 2 r, 4 r, 8 r, 16 r",
      .source = "Brokate & Sprekels, Hysteresis and Phase Transitions (1996), Prandtl-Ishlinskii",
      .parameters = {{"a3_deg_h", "of the operator with threshold 4 r", 0.05},
                     {"a1_deg_h", "of the operator with threshold r", 0.0},
                     {"a2_deg_h", "of the operator with threshold 2 r", 0.0},
                     {"a4_deg_h", "of the operator with threshold 8 r", 0.0},
                     {"a5_deg_h", "of the operator with threshold 16 r", 0.0},
                     shape("smallest_threshold_degc", "r", 0.5, {1e-3, 100.0}, {0.25, 0.5, 1.0}),
                     lag_parameter()},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kTemperature, Need::kTemperatureCycles},
      .confused_with = {"shupe", "coil_lag", "warm_up"},
      .make = make<Hysteresis>};
}

}  // namespace zerodrift::twin::effects
