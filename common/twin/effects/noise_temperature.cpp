// SPDX-License-Identifier: Apache-2.0
// White rate noise that grows with temperature (source power, detector and electronics):
//     N exp(k (T - T0)) w(t), w white with unit spectral density
// beside the constant angle random walk. Standard deviation of a sample at T0: N/sqrt(dt). Default:
// 0.003 deg/√h at 25 °C, twice as much 35 °C above.
#include <algorithm>
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

// 2 N²: at the reference temperature.
double density(const Parameters& parameters, double /*frequency_hz*/, double interval_s) {
  return white_density(std::pow(deviation_radps(parameters, interval_s), 2.0), interval_s);
}

class NoiseTemperature final : public Effect {
 public:
  explicit NoiseTemperature(const EffectContext& context)
      : noise_(context.noise),
        deviation_radps_(deviation_radps(context.parameters, context.interval_s)),
        growth_per_degc_(context.parameter("growth_per_degc")),
        reference_degc_(context.parameter("reference_degc")),
        point_(context.inputs.front()) {}

  double step(const EffectInputs& inputs) noexcept override {
    constexpr double kMostEFolds = 20.0;
    const double temperature = temperature_degc(inputs, point_);
    if (!std::isfinite(temperature)) return 0.0;
    const double e_folds =
        std::clamp(growth_per_degc_ * (temperature - reference_degc_), -kMostEFolds, kMostEFolds);
    return deviation_radps_ * std::exp(e_folds) * noise_.gaussian(inputs.sample);
  }

 private:
  NoiseStream noise_;
  double deviation_radps_;
  double growth_per_degc_;
  double reference_degc_;
  TemperaturePoint point_;
};

}  // namespace

EffectDefinition noise_temperature() {
  return {
      .kind = "noise_temperature",
      .equation = "N exp(k (T - T0)) w(t), w white with unit spectral density",
      .source = "white noise of a level that follows a temperature",
      .family = Family::kStochastic,
      .contribution = Contribution::kNoise,
      .parameters = {{"coefficient_deg_per_sqrt_h", "N, at the reference temperature", 3e-3, 0.0},
                     {"growth_per_degc",
                      "k, of the standard deviation",
                      0.02,
                      -1.0,
                      1.0,
                      ParameterRole::kShape,
                      {-0.05, -0.02, 0.01, 0.02, 0.05}},
                     reference_parameter()},
      .inputs = {TemperaturePoint::kCoil},
      .needs = {Need::kTemperature, Need::kRawRate},
      .confused_with = {"angle_random_walk", "spikes"},
      .spectrum = {"coefficient_deg_per_sqrt_h", density, NoiseLaw::kWhite,
                   core::kRadPerDeg / 60.0},
      .make = [](const EffectContext& c) { return std::make_unique<NoiseTemperature>(c); }};
}

}  // namespace zerodrift::twin::effects
