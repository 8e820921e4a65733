// SPDX-License-Identifier: Apache-2.0
// Random walk of the rate, from 0 at the first sample. Allan variance K² tau/3.
// Default: 0.05 deg/h^1.5.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin::effects {
namespace {

double step_radps(const Parameters& parameters, double interval_s) {
  return core::radps_from_deg_h(parameters.at("coefficient_deg_per_h_1_5")) *
         std::sqrt(interval_s / core::kSecondsPerHour);
}

// Of the sum of white steps: 2 K²/(2 pi f)² far below 1/dt.
Density density(const Parameters& parameters, double interval_s) {
  return [step = step_radps(parameters, interval_s), interval_s](double frequency_hz) {
    const double increment = 2.0 * half_angle(frequency_hz, interval_s);
    return white_density(std::pow(step / increment, 2.0), interval_s);
  };
}

class RateRandomWalk final : public Effect {
 public:
  explicit RateRandomWalk(const EffectContext& context)
      : noise_(context.noise), step_radps_(step_radps(context.parameters, context.interval_s)) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double rate_radps = rate_radps_;
    rate_radps_ += step_radps_ * noise_.gaussian(inputs.sample);
    return rate_radps;
  }

 private:
  NoiseStream noise_;
  double step_radps_;
  double rate_radps_ = 0.0;
};

}  // namespace

EffectDefinition rate_random_walk() {
  return {.equation = "db/dt = K w(t), w white with unit spectral density",
          .source = "IEEE Std 952-1997, Annex C",
          .family = Family::kStochastic,
          .parameters = {{"coefficient_deg_per_h_1_5", "K", 0.05, 0.0}},
          .needs = {Need::kLongRecord},
          .confused_with = {"rate_ramp"},
          .spectrum = {"coefficient_deg_per_h_1_5", density, NoiseLaw::kRandomWalk,
                       core::kRadPerSecPerDegPerHour / 60.0},
          .make = make<RateRandomWalk>};
}

}  // namespace zerodrift::twin::effects
