// SPDX-License-Identifier: Apache-2.0
// Spectral line, averaged over the integration interval as the sensor does:
//     sinc(pi f dt) (A sin(2 pi f (t - dt/2) + phi) + B cos(2 pi f (t - dt/2) + phi))
// Default: 0.05 deg/h at 1 mHz, a cycling heater.
#include <cmath>
#include <numbers>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_line(const EffectContext& context) {
  const double frequency_hz = context.parameter("frequency_hz");
  const double phase_rad = context.parameter("phase_rad");
  const double half_interval_s = context.interval_s / 2.0;
  const double half_turn = std::numbers::pi * frequency_hz * context.interval_s;
  const double averaged = std::sin(half_turn) / half_turn;
  const double radps = context.radps("amplitude_deg_h") * averaged;
  const double quadrature_radps = context.radps("quadrature_deg_h") * averaged;
  return without_memory([=](const EffectInputs& inputs) {
    const double turns = frequency_hz * (inputs.time_s - half_interval_s);
    const double angle = 2.0 * std::numbers::pi * (turns - std::floor(turns)) + phase_rad;
    return radps * std::sin(angle) + quadrature_radps * std::cos(angle);
  });
}

}  // namespace

EffectDefinition line() {
  return {
      .equation = "sinc(pi f dt) (A sin(a) + B cos(a)), a = 2 pi f (t - dt/2) + phi",
      .source = "IEEE Std 952-1997, Annex C",
      .parameters = {{"amplitude_deg_h", "A", 0.05},
                     {"quadrature_deg_h", "B", 0.0},
                     shape("frequency_hz", "f", 1e-3, {1e-9, 1e5},
                           {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3}, SearchRule::kFrequency),
                     convention("phase_rad", "phi", 0.0, {-1e3, 1e3})},
      .needs = {Need::kRawRate},
      .search = {.has_free_phase = true},
      .make = make_line};
}

}  // namespace zerodrift::twin::effects
