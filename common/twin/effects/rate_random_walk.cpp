// SPDX-License-Identifier: Apache-2.0
// Random walk of the rate, from 0 at the first sample. Allan variance K² tau/3.
// Default: 0.05 deg/h^1.5.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class RateRandomWalk final : public Effect {
 public:
  explicit RateRandomWalk(const EffectContext& context)
      : noise_(context.noise),
        step_radps_(core::radps_from_deg_h(context.parameter("coefficient_deg_per_h_1_5")) *
                    std::sqrt(context.interval_s / core::kSecondsPerHour)) {}

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
  return {.kind = "rate_random_walk",
          .equation = "db/dt = K w(t), w white with unit spectral density",
          .source = "IEEE Std 952-1997, Annex C",
          .contribution = Contribution::kDrift,
          .parameters = {{"coefficient_deg_per_h_1_5", "K", 0.05, 0.0}},
          .inputs = {},
          .make = [](const EffectContext& c) { return std::make_unique<RateRandomWalk>(c); }};
}

}  // namespace zerodrift::twin::effects
