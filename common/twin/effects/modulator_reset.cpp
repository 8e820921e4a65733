// SPDX-License-Identifier: Apache-2.0
// Resets of the phase ramp of a closed loop that aren't exactly 2 pi: a scale-factor error and a
// fringe that runs once a reset,
//     k W + s <sin phi> + c <cos phi>,  dphi/dt = 2 pi W/R,  <> the mean over the integration
//     interval
// where R is the angle turned through between resets (n lambda/D: 4.6 arcsec for a coil of 0.1 m).
// The ramp starts anew at each power-on. The mean is exact for a rate that is constant over the
// interval; resets faster than the samples average out. Default: 10 ppm, 0.02 deg/h.
#include <cmath>
#include <numbers>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"
#include "common/twin/power_on.h"

namespace zerodrift::twin::effects {
namespace {

class ModulatorReset final : public Effect {
 public:
  explicit ModulatorReset(const EffectContext& context)
      : axis_(core::index(context.axis)),
        interval_s_(context.interval_s),
        error_(context.parameter("error_ppm") * 1e-6),
        sine_radps_(context.radps("sine_deg_h")),
        cosine_radps_(context.radps("cosine_deg_h")),
        resets_per_rad_(1.0 / (context.parameter("angle_arcsec") * core::kRadPerDeg / 3600.0)) {}

  double step(const EffectInputs& inputs) noexcept override {
    if (was_off(since_power_on_s_, inputs.since_power_on_s)) phase_turns_ = 0.0;
    since_power_on_s_ = inputs.since_power_on_s;
    const double rate = inputs.true_rate_radps[axis_];
    const double resets = rate * interval_s_ * resets_per_rad_;
    if (!std::isfinite(resets)) return resets;
    const double half_turn = std::numbers::pi * resets;
    const double kept = half_turn == 0.0 ? 1.0 : std::sin(half_turn) / half_turn;
    const double middle = 2.0 * std::numbers::pi * phase_turns_ + half_turn;
    phase_turns_ += resets;
    phase_turns_ -= std::floor(phase_turns_);
    return error_ * rate +
           kept * (sine_radps_ * std::sin(middle) + cosine_radps_ * std::cos(middle));
  }

 private:
  std::size_t axis_;
  double interval_s_;
  double error_;
  double sine_radps_;
  double cosine_radps_;
  double resets_per_rad_;
  double phase_turns_ = 0.0;  // at the interval's start, within 0 and 1
  double since_power_on_s_ = 0.0;
};

}  // namespace

EffectDefinition modulator_reset() {
  return {.equation = "k W + s <sin phi> + c <cos phi>, dphi/dt = 2 pi W/R",
          .source = "Lefevre, The Fiber-Optic Gyroscope (1993), closed loop with a phase ramp",
          .parameters = {{"error_ppm", "k", 10.0, -1e6, 1e6},
                         {"sine_deg_h", "s", 0.02},
                         {"cosine_deg_h", "c", 0.0},
                         shape("angle_arcsec", "R, angle between resets", 4.6, {1e-3, 1e6},
                               {0.5, 1.0, 2.0, 4.6, 10.0, 20.0}, SearchRule::kAngle)},
          .needs = {Need::kReferenceRate},
          .confused_with = {"line"},
          .search = {.limit = "scale_factor"},
          .make = make<ModulatorReset>};
}

}  // namespace zerodrift::twin::effects
