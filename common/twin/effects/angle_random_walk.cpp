// SPDX-License-Identifier: Apache-2.0
// White rate noise; its integral is a random walk in angle. Standard deviation of a sample
// N/sqrt(dt), Allan variance N²/tau. Default: 0.005 deg/√h, tactical grade.
#include "common/twin/effect_parts.h"
#include "common/twin/effects/white_noise.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_angle_random_walk(const EffectContext& context) {
  return without_memory(
      [noise = context.noise,
       deviation_radps = white_deviation_radps(context.parameters, context.interval_s)](
          const EffectInputs& inputs) { return deviation_radps * noise.gaussian(inputs.sample); });
}

}  // namespace

EffectDefinition angle_random_walk() {
  return {.equation = "N w(t), w white with unit spectral density",
          .source = "IEEE Std 952-1997, Annex C",
          .family = Family::kStochastic,
          .contribution = Contribution::kNoise,
          .parameters = {{"coefficient_deg_per_sqrt_h", "N", 5e-3, 0.0}},
          .needs = {Need::kRawRate},
          .confused_with = {"quantization"},
          .spectrum = white_spectrum(),
          .make = make_angle_random_walk};
}

}  // namespace zerodrift::twin::effects
