// SPDX-License-Identifier: Apache-2.0
// White rate noise; its integral is a random walk in angle. Standard deviation of a sample
// N/sqrt(dt), Allan variance N²/tau. Default: 0.005 deg/√h, tactical grade.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin::effects {
namespace {

double deviation_radps(const Parameters& parameters, double interval_s) {
  return parameters.at("coefficient_deg_per_sqrt_h") * core::kRadPerDeg /
         std::sqrt(core::kSecondsPerHour * interval_s);
}

// 2 N².
double density(const Parameters& parameters, double /*frequency_hz*/, double interval_s) {
  return white_density(std::pow(deviation_radps(parameters, interval_s), 2.0), interval_s);
}

class AngleRandomWalk final : public Effect {
 public:
  explicit AngleRandomWalk(const EffectContext& context)
      : noise_(context.noise),
        deviation_radps_(deviation_radps(context.parameters, context.interval_s)) {}

  double step(const EffectInputs& inputs) noexcept override {
    return deviation_radps_ * noise_.gaussian(inputs.sample);
  }

 private:
  NoiseStream noise_;
  double deviation_radps_;
};

}  // namespace

EffectDefinition angle_random_walk() {
  return {.kind = "angle_random_walk",
          .equation = "N w(t), w white with unit spectral density",
          .source = "IEEE Std 952-1997, Annex C",
          .family = Family::kStochastic,
          .contribution = Contribution::kNoise,
          .parameters = {{"coefficient_deg_per_sqrt_h", "N", 5e-3, 0.0}},
          .inputs = {},
          .needs = {Need::kRawRate},
          .confused_with = {"quantization"},
          .spectrum = {"coefficient_deg_per_sqrt_h", density, NoiseLaw::kWhite,
                       core::kRadPerDeg / 60.0},
          .make = [](const EffectContext& c) { return std::make_unique<AngleRandomWalk>(c); }};
}

}  // namespace zerodrift::twin::effects
