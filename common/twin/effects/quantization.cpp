// SPDX-License-Identifier: Apache-2.0
// Angle quantization: the output counts whole steps of the integrated angle and the rest waits for
// the next sample, so no angle is lost:
//     rate = (round(theta_k / q) - round(theta_(k-1) / q)) q / dt
// Allan variance 3 Q²/tau² with Q = q/sqrt(12). Default: 0.1 arcsec a count.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin::effects {
namespace {

constexpr double kRadPerArcsec = core::kRadPerDeg / 3600.0;
constexpr double kRoot12 =
    3.4641016151377544;  // an angle rounded to steps q is wrong by q/sqrt(12) rms

class Quantization final : public Effect {
 public:
  explicit Quantization(const EffectContext& context)
      : step_rad_(context.parameter("step_arcsec") * kRadPerArcsec),
        interval_s_(context.interval_s) {}

  double step(const EffectInputs& inputs) noexcept override {
    if (!std::isfinite(inputs.rate_radps)) return 0.0;
    const double angle_rad = remainder_rad_ + inputs.rate_radps * interval_s_;
    const double counted_rad = std::round(angle_rad / step_rad_) * step_rad_;
    remainder_rad_ = angle_rad - counted_rad;
    return counted_rad / interval_s_ - inputs.rate_radps;
  }

 private:
  double step_rad_;
  double interval_s_;
  double remainder_rad_ = 0.0;
};

// The difference of white rounding errors of variance q²/12:
//     8 (q²/12) sin²(pi f dt)/dt, far below 1/dt the 2 Q² dt (2 pi f)² of IEEE Std 952
Density density(const Parameters& parameters, double interval_s) {
  const double step_rad = parameters.at("step_arcsec") * kRadPerArcsec;
  return [step_rad, interval_s](double frequency_hz) {
    const double sine = half_angle(frequency_hz, interval_s);
    return 8.0 / 12.0 * step_rad * step_rad * sine * sine / interval_s;
  };
}

}  // namespace

EffectDefinition quantization() {
  return {
      .equation = "(round(theta_k / q) - round(theta_(k-1) / q)) q / dt",
      .source = "IEEE Std 952-1997, Annex C",
      .family = Family::kStochastic,
      .contribution = Contribution::kOutput,
      .parameters = {shape("step_arcsec", "q", 0.1, {1e-9, 1e6}, {0.01, 0.03, 0.1, 0.3, 1.0, 3.0})},
      .needs = {Need::kRawRate},
      .confused_with = {"angle_random_walk"},
      .spectrum = {"step_arcsec", density, NoiseLaw::kQuantization, kRadPerArcsec / kRoot12},
      .make = make<Quantization>};
}

}  // namespace zerodrift::twin::effects
