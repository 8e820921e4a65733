// SPDX-License-Identifier: Apache-2.0
// White rate noise that grows with temperature (source power, detector and electronics):
//     N exp(k (T - T0)) w(t), w white with unit spectral density
// beside the constant angle random walk. Standard deviation of a sample at T0: N/sqrt(dt). Default:
// 0.003 deg/√h at 25 °C, twice as much 35 °C above.
#include <algorithm>
#include <cmath>

#include "common/twin/effect_parts.h"
#include "common/twin/effects/white_noise.h"

namespace zerodrift::twin::effects {
namespace {

constexpr double kMostEFolds = 20.0;

std::unique_ptr<Effect> make_noise_temperature(const EffectContext& context) {
  const TemperaturePoint point = context.inputs.front();
  const NoiseStream noise = context.noise;
  const double deviation_radps = white_deviation_radps(context.parameters, context.interval_s);
  const double growth_per_degc = context.parameter("growth_per_degc");
  const double reference_degc = context.parameter("reference_degc");
  return without_memory([=](const EffectInputs& inputs) {
    const double temperature = temperature_degc(inputs, point);
    if (!std::isfinite(temperature)) return 0.0;
    const double e_folds =
        std::clamp(growth_per_degc * (temperature - reference_degc), -kMostEFolds, kMostEFolds);
    return deviation_radps * std::exp(e_folds) * noise.gaussian(inputs.sample);
  });
}

}  // namespace

EffectDefinition noise_temperature() {
  return {
      .equation = "N exp(k (T - T0)) w(t), w white with unit spectral density",
      .source = "white noise of a level that follows a temperature",
      .family = Family::kStochastic,
      .contribution = Contribution::kNoise,
      .parameters = {{"coefficient_deg_per_sqrt_h", "N, at the reference temperature", 3e-3, 0.0},
                     shape("growth_per_degc", "k, of the standard deviation", 0.02, {-1.0, 1.0},
                           {-0.05, -0.02, 0.01, 0.02, 0.05}),
                     reference_parameter()},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kTemperature, Need::kRawRate},
      .confused_with = {"angle_random_walk", "spikes"},
      .spectrum = white_spectrum(),
      .make = make_noise_temperature};
}

}  // namespace zerodrift::twin::effects
