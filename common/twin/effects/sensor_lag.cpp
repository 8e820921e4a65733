// SPDX-License-Identifier: Apache-2.0
// The bias follows the temperature, but the thermometer that the bias is known against lags behind:
// what b(T) then misses is, to first order,
//     delta b'(T) dT/dt,  b'(T) = c1 + 2 c2 D + 3 c3 D² + 4 c4 D³,  D = LP_lag(T) - T_ref
// with the rate behind the same lag. c1 to c4 and T_ref are those of the axis' bias_temperature and
// have its names; they are copied, not fitted. Default: 10 s, a thermometer potted beside the coil.
#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/low_pass.h"

namespace zerodrift::twin::effects {
namespace {

constexpr double kAny = std::numeric_limits<double>::max();

class SensorLag final : public Effect {
 public:
  explicit SensorLag(const EffectContext& context)
      : input_(context.inputs.at(0)),
        lag_(context.parameter("lag_s"), context.interval_s),
        rate_lag_(context.parameter("lag_s"), context.interval_s),
        delay_s_(context.parameter("delay_s")),
        reference_degc_(context.parameter("reference_degc")),
        c1_(core::radps_from_deg_h(context.parameter("c1_deg_h_per_degc"))),
        c2_(core::radps_from_deg_h(context.parameter("c2_deg_h_per_degc2"))),
        c3_(core::radps_from_deg_h(context.parameter("c3_deg_h_per_degc3"))),
        c4_(core::radps_from_deg_h(context.parameter("c4_deg_h_per_degc4"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double d = lag_.step(temperature_degc(inputs, input_)) - reference_degc_;
    const double slope = c1_ + d * (2.0 * c2_ + d * (3.0 * c3_ + d * 4.0 * c4_));
    return delay_s_ * slope * rate_lag_.step(temperature_rate_degc_per_s(inputs, input_));
  }

  void carry(core::StateArchive& archive) override { archive(lag_, rate_lag_); }

 private:
  TemperaturePoint input_;
  LowPass lag_;
  LowPass rate_lag_;
  double delay_s_;
  double reference_degc_;
  double c1_, c2_, c3_, c4_;  // rad/s per °C, °C², °C³, °C⁴
};

}  // namespace

EffectDefinition sensor_lag() {
  return {
      .kind = "sensor_lag",
      .equation = "delta (c1 + 2 c2 D + 3 c3 D^2 + 4 c4 D^3) LP_lag(dT/dt), D = LP_lag(T) - T_ref",
      .source = "bias_temperature to first order in the thermometer's delay",
      .contribution = Contribution::kDrift,
      .parameters = {{"delay_s", "delta, thermometer behind the bias", 10.0, -1e5, 1e5},
                     reference_parameter(),
                     {"c1_deg_h_per_degc", "as in bias_temperature", 0.01, -kAny, kAny,
                      ParameterRole::kConvention},
                     {"c2_deg_h_per_degc2", "as in bias_temperature", 0.0, -kAny, kAny,
                      ParameterRole::kConvention},
                     {"c3_deg_h_per_degc3", "as in bias_temperature", 0.0, -kAny, kAny,
                      ParameterRole::kConvention},
                     {"c4_deg_h_per_degc4", "as in bias_temperature", 0.0, -kAny, kAny,
                      ParameterRole::kConvention},
                     lag_parameter()},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kTemperature},
      .confused_with = {"shupe"},
      .search = {.without_lender =
                     "the model has no bias_temperature that a thermometer could lag behind"},
      .make = [](const EffectContext& c) { return std::make_unique<SensorLag>(c); }};
}

}  // namespace zerodrift::twin::effects
