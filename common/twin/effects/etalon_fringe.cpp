// SPDX-License-Identifier: Apache-2.0
// Interference of a stray reflection, whose phase runs with temperature:
//     s sin(2 pi D/P) + c cos(2 pi D/P),  D = LP_lag(T) - T_ref
// A chirp in time on a ramp. Default: 0.02 deg/h every 5 °C.
#include <cmath>
#include <numbers>

#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

class EtalonFringe final : public Effect {
 public:
  explicit EtalonFringe(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        reference_degc_(context.parameter("reference_degc")),
        rad_per_degc_(2.0 * std::numbers::pi / context.parameter("period_degc")),
        sine_radps_(core::radps_from_deg_h(context.parameter("sine_deg_h"))),
        cosine_radps_(core::radps_from_deg_h(context.parameter("cosine_deg_h"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double phase =
        rad_per_degc_ * (lag_.step(temperature_degc(inputs, input_)) - reference_degc_);
    return sine_radps_ * std::sin(phase) + cosine_radps_ * std::cos(phase);
  }

  void carry(core::StateArchive& archive) override { archive(lag_); }

 private:
  TemperaturePoint input_;
  LowPass lag_;
  double reference_degc_;
  double rad_per_degc_;
  double sine_radps_;
  double cosine_radps_;
};

}  // namespace

EffectDefinition etalon_fringe() {
  return {.kind = "etalon_fringe",
          .equation = "s sin(2 pi D/P) + c cos(2 pi D/P), D = LP_lag(T) - T_ref",
          .source = "Lefevre, The Fiber-Optic Gyroscope (1993), stray reflections",
          .contribution = Contribution::kDrift,
          .parameters = {{"sine_deg_h", "s", 0.02},
                         {"cosine_deg_h", "c", 0.0},
                         {"period_degc",
                          "P",
                          5.0,
                          1e-2,
                          1e3,
                          ParameterRole::kShape,
                          {1.0, 1.7, 3.0, 5.0, 9.0, 15.0, 25.0},
                          SearchRule::kPeriod},
                         reference_parameter(),
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"markov", "line"},
          .make = [](const EffectContext& c) { return std::make_unique<EtalonFringe>(c); }};
}

}  // namespace zerodrift::twin::effects
