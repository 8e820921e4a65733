// SPDX-License-Identifier: Apache-2.0
// Scale factor that changes with the rate itself, odd in the rate:
//     k W (W/W0)²
// Default: 20 ppm at W0 = 100 deg/s.
#include "common/core/units.h"
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_scale_factor_nonlinearity(const EffectContext& context) {
  const std::size_t axis = core::index(context.axis);
  const double error = context.parameter("error_ppm") * 1e-6;
  const double full_radps = context.parameter("at_deg_s") * core::kRadPerDeg;
  return without_memory([=](const EffectInputs& inputs) {
    const double rate = inputs.true_rate_radps[axis];
    const double share = rate / full_radps;
    return error * rate * share * share;
  });
}

}  // namespace

EffectDefinition scale_factor_nonlinearity() {
  return {.equation = "k W (W/W0)^2",
          .source = "IEEE Std 952-1997, scale-factor nonlinearity",
          .parameters = {{"error_ppm", "k, scale-factor error at W0", 20.0, -1e6, 1e6},
                         convention("at_deg_s", "W0", 100.0, {1e-3, 1e5})},
          .needs = {Need::kReferenceRate},
          .make = make_scale_factor_nonlinearity};
}

}  // namespace zerodrift::twin::effects
