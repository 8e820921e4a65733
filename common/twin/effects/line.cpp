// SPDX-License-Identifier: Apache-2.0
// Spectral line, averaged over the integration interval as the sensor does:
//     sinc(pi f dt) (A sin(2 pi f (t - dt/2) + phi) + B cos(2 pi f (t - dt/2) + phi))
// Default: 0.05 deg/h at 1 mHz, a cycling heater.
#include <cmath>
#include <numbers>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Line final : public Effect {
 public:
  explicit Line(const EffectContext& context)
      : radps_(core::radps_from_deg_h(context.parameter("amplitude_deg_h"))),
        quadrature_radps_(core::radps_from_deg_h(context.parameter("quadrature_deg_h"))),
        frequency_hz_(context.parameter("frequency_hz")),
        phase_rad_(context.parameter("phase_rad")),
        half_interval_s_(context.interval_s / 2.0) {
    const double half_turn = std::numbers::pi * frequency_hz_ * context.interval_s;
    const double averaged = std::sin(half_turn) / half_turn;
    radps_ *= averaged;
    quadrature_radps_ *= averaged;
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double turns = frequency_hz_ * (inputs.time_s - half_interval_s_);
    const double angle = 2.0 * std::numbers::pi * (turns - std::floor(turns)) + phase_rad_;
    return radps_ * std::sin(angle) + quadrature_radps_ * std::cos(angle);
  }

 private:
  double radps_;
  double quadrature_radps_;
  double frequency_hz_;
  double phase_rad_;
  double half_interval_s_;
};

}  // namespace

EffectDefinition line() {
  return {.kind = "line",
          .equation = "sinc(pi f dt) (A sin(a) + B cos(a)), a = 2 pi f (t - dt/2) + phi",
          .source = "IEEE Std 952-1997, Annex C",
          .contribution = Contribution::kDrift,
          .parameters = {{"amplitude_deg_h", "A", 0.05},
                         {"quadrature_deg_h", "B", 0.0},
                         {"frequency_hz",
                          "f",
                          1e-3,
                          1e-9,
                          1e5,
                          ParameterRole::kShape,
                          {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3},
                          SearchRule::kFrequency},
                         {"phase_rad", "phi", 0.0, -1e3, 1e3, ParameterRole::kConvention}},
          .inputs = {},
          .needs = {Need::kRawRate},
          .confused_with = {},
          .search = {.has_free_phase = true},
          .make = [](const EffectContext& c) { return std::make_unique<Line>(c); }};
}

}  // namespace zerodrift::twin::effects
