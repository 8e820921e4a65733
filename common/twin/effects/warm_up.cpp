// SPDX-License-Identifier: Apache-2.0
// Transient after power-on as the light source and electronics settle:
//     A exp(-(t/tau)^p),  t since power-on
// Default: 0.2 deg/h dying away in 10 minutes.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class WarmUp final : public Effect {
 public:
  explicit WarmUp(const EffectContext& context)
      : amplitude_radps_(core::radps_from_deg_h(context.parameter("amplitude_deg_h"))),
        tau_s_(context.parameter("tau_s")),
        exponent_(context.parameter("exponent")) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double age = inputs.since_power_on_s / tau_s_;
    const double decay = exponent_ == 1.0 ? age : std::pow(age, exponent_);
    return amplitude_radps_ * std::exp(-decay);
  }

 private:
  double amplitude_radps_;
  double tau_s_;
  double exponent_;
};

}  // namespace

EffectDefinition warm_up() {
  return {.kind = "warm_up",
          .equation = "A exp(-(t/tau)^p), t since power-on",
          .source = "IEEE Std 952-1997 (warm-up time); stretched exponential",
          .contribution = Contribution::kDrift,
          .parameters = {{"amplitude_deg_h", "A", 0.2},
                         {"tau_s",
                          "decay time",
                          600.0,
                          1e-3,
                          1e6,
                          ParameterRole::kShape,
                          {60.0, 180.0, 420.0, 900.0, 1800.0, 3600.0}},
                         {"exponent",
                          "p, 1 = plain exponential",
                          1.0,
                          0.05,
                          5.0,
                          ParameterRole::kShape,
                          {0.6, 1.0, 1.5}}},
          .inputs = {},
          .needs = {Need::kPowerOn},
          .confused_with = {"rate_ramp"},
          .make = [](const EffectContext& c) { return std::make_unique<WarmUp>(c); }};
}

}  // namespace zerodrift::twin::effects
