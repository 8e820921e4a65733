// SPDX-License-Identifier: Apache-2.0
// Switching at random between two levels A apart (a mode hop, a contact):
//     A/2 for a time of mean tau_up, then -A/2 for a time of mean tau_down, exponentially
//     distributed
// Stationary from the first sample and exact at any interval: the state is correlated over tau with
// 1/tau = 1/tau_up + 1/tau_down, and is up for the share tau_up/(tau_up + tau_down) of the time;
// the variance is A² times this share times the other's. Default: 0.1 deg/h, ten minutes each.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin::effects {
namespace {

struct Switching {
  double share_up = 0.0;
  double tau_s = 0.0;
};

Switching switching_of(const Parameters& parameters) {
  const double up_s = parameters.at("up_s");
  const double down_s = parameters.at("down_s");
  return {up_s / (up_s + down_s), up_s * down_s / (up_s + down_s)};
}

// That of a Markov process of the same variance and correlation.
Density density(const Parameters& parameters, double interval_s) {
  const Switching switching = switching_of(parameters);
  const double amplitude_radps = core::radps_from_deg_h(parameters.at("amplitude_deg_h"));
  const double variance =
      amplitude_radps * amplitude_radps * switching.share_up * (1.0 - switching.share_up);
  return FirstOrderDensity(variance, switching.tau_s, interval_s);
}

FirstOrder first_order(const Parameters& parameters) {
  const Switching switching = switching_of(parameters);
  const double share = switching.share_up;
  return {std::abs(parameters.at("amplitude_deg_h")) * std::sqrt(share * (1.0 - share)),
          switching.tau_s};
}

Parameters parameters_of(const TwoLevels& noise) {
  return {
      {"amplitude_deg_h", noise.amplitude_deg_h}, {"up_s", noise.up_s}, {"down_s", noise.down_s}};
}

class Telegraph final : public Effect {
 public:
  explicit Telegraph(const EffectContext& context)
      : noise_(context.noise), half_step_radps_(context.radps("amplitude_deg_h") / 2.0) {
    const Switching switching = switching_of(context.parameters);
    const double forgotten = -std::expm1(-context.interval_s / switching.tau_s);
    leave_up_ = (1.0 - switching.share_up) * forgotten;
    leave_down_ = switching.share_up * forgotten;
    level_ = noise_.substream(0).uniform(0) < switching.share_up ? Level::kUp : Level::kDown;
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double value = level_ == Level::kUp ? half_step_radps_ : -half_step_radps_;
    const double leave = level_ == Level::kUp ? leave_up_ : leave_down_;
    if (noise_.uniform(inputs.sample) < leave) {
      level_ = level_ == Level::kUp ? Level::kDown : Level::kUp;
    }
    return value;
  }

 private:
  enum class Level { kUp, kDown };

  NoiseStream noise_;
  double half_step_radps_;
  double leave_up_ = 0.0;  // probabilities a sample
  double leave_down_ = 0.0;
  Level level_ = Level::kUp;
};

}  // namespace

EffectDefinition telegraph() {
  return {
      .equation = "A/2 or -A/2, dwell times exponential with means tau_up and tau_down",
      .source = "Machlup, J. Applied Physics 25 (1954) 341",
      .family = Family::kStochastic,
      .parameters = {{"amplitude_deg_h", "A, between the levels", 0.1},
                     shape("up_s", "tau_up", 600.0, {1e-3, 1e9}, {30.0, 120.0, 600.0, 2400.0}),
                     shape("down_s", "tau_down", 600.0, {1e-3, 1e9}, {30.0, 120.0, 600.0, 2400.0})},
      .needs = {Need::kLongRecord},
      .confused_with = {"markov"},
      .spectrum = {.scale = "amplitude_deg_h",
                   .density = density,
                   .law = NoiseLaw::kTwoLevel,
                   .si_per_unit = core::kRadPerSecPerDegPerHour,
                   .first_order = first_order,
                   .parameters_of_levels = parameters_of},
      .make = make<Telegraph>};
}

}  // namespace zerodrift::twin::effects
