// SPDX-License-Identifier: Apache-2.0
// Interference of a stray reflection, whose phase runs with temperature:
//     s sin(2 pi D/P) + c cos(2 pi D/P),  D = LP_lag(T) - T_ref
// A chirp in time on a ramp. Default: 0.02 deg/h every 5 °C.
#include <cmath>
#include <numbers>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_etalon_fringe(const EffectContext& context) {
  const double rad_per_degc = 2.0 * std::numbers::pi / context.parameter("period_degc");
  const double sine_radps = context.radps("sine_deg_h");
  const double cosine_radps = context.radps("cosine_deg_h");
  return with_memory(LaggedTemperature(context),
                     [=](LaggedTemperature& above, const EffectInputs& inputs) {
                       const double phase = rad_per_degc * above.step(inputs);
                       return sine_radps * std::sin(phase) + cosine_radps * std::cos(phase);
                     });
}

}  // namespace

EffectDefinition etalon_fringe() {
  return {.equation = "s sin(2 pi D/P) + c cos(2 pi D/P), D = LP_lag(T) - T_ref",
          .source = "Lefevre, The Fiber-Optic Gyroscope (1993), stray reflections",
          .parameters = {{"sine_deg_h", "s", 0.02},
                         {"cosine_deg_h", "c", 0.0},
                         shape("period_degc", "P", 5.0, {1e-2, 1e3},
                               {1.0, 1.7, 3.0, 5.0, 9.0, 15.0, 25.0}, SearchRule::kPeriod),
                         reference_parameter(),
                         lag_parameter()},
          .inputs = {TemperaturePoint::kCoil},
          .needs = {Need::kTemperature},
          .confused_with = {"markov", "line"},
          .make = make_etalon_fringe};
}

}  // namespace zerodrift::twin::effects
