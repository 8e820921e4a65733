// SPDX-License-Identifier: Apache-2.0
// First-order Markov (exponentially correlated) noise of standard deviation sigma and correlation
// time tau, stationary from the first sample; q² = 2 sigma²/tau. Allan deviation peaks at .617
// sigma near 1.89 tau. Default: 0.05 deg/h over 10 minutes.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin::effects {
namespace {

Density density(const Parameters& parameters, double interval_s) {
  const double sigma_radps = core::radps_from_deg_h(parameters.at("sigma_deg_h"));
  return FirstOrderDensity(sigma_radps * sigma_radps, parameters.at("tau_s"), interval_s);
}

FirstOrder first_order(const Parameters& parameters) {
  return {parameters.at("sigma_deg_h"), parameters.at("tau_s")};
}

Parameters parameters_of(const FirstOrder& noise) {
  return {{"sigma_deg_h", noise.sigma_deg_h}, {"tau_s", noise.tau_s}};
}

class Markov final : public Effect {
 public:
  explicit Markov(const EffectContext& context) : noise_(context.noise), value_radps_(0.0) {
    const double sigma = context.radps("sigma_deg_h");
    const double step = context.interval_s / context.parameter("tau_s");
    memory_ = std::exp(-step);
    innovation_radps_ = sigma * std::sqrt(-std::expm1(-2.0 * step));
    value_radps_ = sigma * noise_.substream(0).gaussian(0);
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double value = value_radps_;
    value_radps_ = memory_ * value_radps_ + innovation_radps_ * noise_.gaussian(inputs.sample);
    return value;
  }

 private:
  NoiseStream noise_;
  double memory_ = 0.0;
  double innovation_radps_ = 0.0;
  double value_radps_;
};

}  // namespace

EffectDefinition markov() {
  return {.equation = "db/dt = -b/tau + q w(t), q^2 = 2 sigma^2/tau",
          .source = "IEEE Std 952-1997, Annex C",
          .family = Family::kStochastic,
          .parameters = {{"sigma_deg_h", "standard deviation", 0.05, 0.0},
                         shape("tau_s", "correlation time", 600.0, {1e-3, 1e9},
                               {10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0})},
          .needs = {Need::kLongRecord},
          .confused_with = {"bias_instability", "telegraph"},
          .spectrum = {"sigma_deg_h", density, NoiseLaw::kFirstOrder, core::kRadPerSecPerDegPerHour,
                       first_order, parameters_of},
          .make = make<Markov>};
}

}  // namespace zerodrift::twin::effects
