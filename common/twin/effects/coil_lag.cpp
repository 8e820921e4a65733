// SPDX-License-Identifier: Apache-2.0
// Thermal rate effect of the coil's depth: the temperature rate felt inside the coil follows the
// measured one with a lag,
//     s LP_tau(dT/dt),  tau of 2 to 40 minutes: a slower one is a slope of the bias in disguise
// Default: 0.5 deg/h per °C/min behind 10 minutes.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_coil_lag(const EffectContext& context) {
  return of_temperature_rate(context, LowPass(context.parameter("tau_s"), context.interval_s));
}

}  // namespace

EffectDefinition coil_lag() {
  return {
      .equation = "s LP_tau(dT/dt)",
      .source = "Mohr, J. Lightwave Technology 14 (1996) 27 (heat conduction into the coil)",
      .parameters = {{"coefficient_deg_h_min_per_degc", "s, deg/h per °C/min", 0.5},
                     shape("tau_s", "lag of the rate", 600.0, {0.0, 1e5},
                           {120.0, 240.0, 480.0, 900.0, 1500.0, 2400.0}, SearchRule::kWithinGrid)},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kTemperature},
      .confused_with = {"shupe", "gradient"},
      .search = {.limit = "shupe"},
      .make = make_coil_lag};
}

}  // namespace zerodrift::twin::effects
