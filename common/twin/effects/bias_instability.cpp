// SPDX-License-Identifier: Apache-2.0
// Flicker (1/f) noise of the bias, flat Allan variance (2 ln2/pi) B². See flicker_noise.h for how
// it is made and how closely. Default: 0.05 deg/h, tactical grade.
#include "common/core/units.h"
#include "common/twin/effect_parts.h"
#include "common/twin/flicker_noise.h"

namespace zerodrift::twin::effects {
namespace {

FlickerNoiseOptions options_of(const Parameters& parameters) {
  return {.bias_instability = core::radps_from_deg_h(parameters.at("coefficient_deg_h")),
          .shortest_correlation_s = parameters.at("shortest_correlation_s"),
          .longest_correlation_s = parameters.at("longest_correlation_s")};
}

// B²/(pi f) between the ends of the range.
Density density(const Parameters& parameters, double interval_s) {
  return FlickerDensity(options_of(parameters), interval_s);
}

class BiasInstability final : public Effect {
 public:
  explicit BiasInstability(const EffectContext& context)
      : flicker_(options_of(context.parameters), context.interval_s, context.noise) {}

  double step(const EffectInputs& inputs) noexcept override { return flicker_.step(inputs.sample); }

 private:
  FlickerNoise flicker_;
};

}  // namespace

EffectDefinition bias_instability() {
  const FlickerNoiseOptions range;
  return {
      .equation = "flicker noise of one-sided spectrum B^2/(pi f)",
      .source = "IEEE Std 952-1997, Annex C",
      .family = Family::kStochastic,
      .parameters = {{"coefficient_deg_h", "B", 0.05, 0.0},
                     convention("shortest_correlation_s",
                                "where the 1/f spectrum ends at high frequency",
                                range.shortest_correlation_s, {1e-3, 1e3}),
                     convention("longest_correlation_s", "where it ends at low frequency",
                                range.longest_correlation_s, {1e3, 1e9})},
      .needs = {Need::kLongRecord},
      .confused_with = {"markov", "rate_random_walk"},
      .spectrum = {"coefficient_deg_h", density, NoiseLaw::kFlicker, core::kRadPerSecPerDegPerHour},
      .make = make<BiasInstability>};
}

}  // namespace zerodrift::twin::effects
