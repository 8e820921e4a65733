// SPDX-License-Identifier: Apache-2.0
// Slow ageing-like trend over the record, that a power-on doesn't restart:
//     R t + L ln(1 + t/tau)
// Allan variance of the linear part R² tau²/2. Default: 0.01 deg/h per hour, no logarithm.
#include <algorithm>
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class RateRamp final : public Effect {
 public:
  explicit RateRamp(const EffectContext& context)
      : radps2_(core::radps_from_deg_h(context.parameter("ramp_deg_per_h2")) /
                core::kSecondsPerHour),
        logarithm_radps_(core::radps_from_deg_h(context.parameter("logarithm_deg_h"))),
        tau_s_(context.parameter("logarithm_tau_s")) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double t = std::max(inputs.time_s, 0.0);
    const double logarithm =
        logarithm_radps_ != 0.0 ? logarithm_radps_ * std::log1p(t / tau_s_) : 0.0;
    return radps2_ * t + logarithm;
  }

 private:
  double radps2_;
  double logarithm_radps_;
  double tau_s_;
};

}  // namespace

EffectDefinition rate_ramp() {
  return {.kind = "rate_ramp",
          .equation = "R t + L ln(1 + t/tau), t since the start of the record",
          .source = "IEEE Std 952-1997, Annex C",
          .contribution = Contribution::kDrift,
          .parameters = {{"ramp_deg_per_h2", "R, deg/h per hour", 0.01},
                         {"logarithm_deg_h", "L", 0.0},
                         {"logarithm_tau_s",
                          "tau",
                          3600.0,
                          1e-3,
                          1e9,
                          ParameterRole::kShape,
                          {60.0, 300.0, 1200.0, 3600.0, 14400.0}}},
          .inputs = {},
          .needs = {Need::kLongRecord},
          .confused_with = {"rate_random_walk"},
          .make = [](const EffectContext& c) { return std::make_unique<RateRamp>(c); }};
}

}  // namespace zerodrift::twin::effects
