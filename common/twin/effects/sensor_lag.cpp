// SPDX-License-Identifier: Apache-2.0
// The bias follows the temperature, but the thermometer that the bias is known against lags behind:
// what b(T) then misses is, to first order,
//     delta b'(T) dT/dt,  b'(T) = c1 + 2 c2 D + 3 c3 D² + 4 c4 D³,  D = LP_lag(T) - T_ref
// with the rate behind the same lag, and what a Shupe effect s dT/dt of the same thermometer misses
//     delta s (dT/dt - LP_lag(dT/dt)) / lag
// (of a lag of 0 nothing: a thermometer's noise has no second derivative). c1 to c4 and T_ref are
// those of the axis' bias_temperature, s is that of its shupe, if both read the same temperature;
// they have their names and are copied, not fitted. Default: 10 s, a thermometer potted beside the
// coil.
#include "common/twin/effect_parts.h"
#include "common/twin/effects/bias_polynomial.h"

namespace zerodrift::twin::effects {
namespace {

// A thermometer lags; it leads where its lag was stated larger than it is.
constexpr double kStatedTooLargeS = -60.0;
constexpr double kSlowestS = 900.0;

struct Lags {
  LaggedTemperature above;
  LowPass rate;

  void carry(core::StateArchive& archive) { archive(above, rate); }
};

std::unique_ptr<Effect> make_sensor_lag(const EffectContext& context) {
  const TemperaturePoint input = context.inputs.at(0);
  const double delay_s = context.parameter("delay_s");
  const BiasPolynomial bias(context);
  const double lag_s = context.parameter("lag_s");
  const double shupe_radps_per_degc_per_s =
      lag_s > 0.0 ? context.radps("coefficient_deg_h_min_per_degc") * 60.0 / lag_s : 0.0;
  return with_memory(Lags{LaggedTemperature(context), LowPass(lag_s, context.interval_s)},
                     [=](Lags& lags, const EffectInputs& inputs) {
                       const double slope = bias.radps_per_degc(lags.above.step(inputs));
                       const double rate = temperature_rate_degc_per_s(inputs, input);
                       const double late = lags.rate.step(rate);
                       return delay_s * (slope * late + shupe_radps_per_degc_per_s * (rate - late));
                     });
}

}  // namespace

EffectDefinition sensor_lag() {
  return {.equation =
              "delta ((c1 + 2 c2 D + 3 c3 D^2 + 4 c4 D^3) LP_lag(dT/dt) + s (dT/dt - "
              "LP_lag(dT/dt)) / lag), D = LP_lag(T) - T_ref",
          .source = "bias_temperature and shupe to first order in the thermometer's delay",
          .parameters = {{"delay_s", "delta, thermometer behind the bias", 10.0, -1e5, 1e5},
                         reference_parameter(),
                         convention("c1_deg_h_per_degc", "as in bias_temperature", 0.01),
                         convention("c2_deg_h_per_degc2", "as in bias_temperature", 0.0),
                         convention("c3_deg_h_per_degc3", "as in bias_temperature", 0.0),
                         convention("c4_deg_h_per_degc4", "as in bias_temperature", 0.0),
                         convention("coefficient_deg_h_min_per_degc", "as in shupe", 0.0),
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"shupe"},
          .search = {.without_lender =
                         "the model has no bias_temperature that a thermometer could lag behind",
                     .least_amplitude = kStatedTooLargeS,
                     .greatest_amplitude = kSlowestS},
          .make = make_sensor_lag};
}

}  // namespace zerodrift::twin::effects
