// SPDX-License-Identifier: Apache-2.0
// Angle quantization: the output counts whole steps of the integrated angle and the rest waits for
// the next sample, so no angle is lost:
//     rate = (round(theta_k / q) - round(theta_(k-1) / q)) q / dt
// Allan variance 3 Q²/tau² with Q = q/sqrt(12). Default: 0.1 arcsec a count.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

constexpr double kRadPerArcsec = core::kRadPerDeg / 3600.0;

class Quantization final : public Effect {
 public:
  explicit Quantization(const EffectContext& context)
      : step_rad_(context.parameter("step_arcsec") * kRadPerArcsec),
        interval_s_(context.interval_s) {}

  double step(const EffectInputs& inputs) noexcept override {
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

}  // namespace

EffectDefinition quantization() {
  return {.kind = "quantization",
          .equation = "(round(theta_k / q) - round(theta_(k-1) / q)) q / dt",
          .source = "IEEE Std 952-1997, Annex C",
          .contribution = Contribution::kOutput,
          .parameters = {{"step_arcsec", "q", 0.1, 1e-9, 1e6}},
          .inputs = {},
          .make = [](const EffectContext& c) { return std::make_unique<Quantization>(c); }};
}

}  // namespace zerodrift::twin::effects
