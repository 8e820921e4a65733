// SPDX-License-Identifier: Apache-2.0
// Rates too small to be felt (cross-talk from the modulation into the detector locks the loop):
//     -W where |W| < w0, else 0
// Default: 0.1 deg/h.
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_dead_band(const EffectContext& context) {
  const std::size_t axis = core::index(context.axis);
  const double half_width_radps = context.radps("half_width_deg_h");
  return without_memory([=](const EffectInputs& inputs) {
    const double rate = inputs.true_rate_radps[axis];
    return std::abs(rate) < half_width_radps ? -rate : 0.0;
  });
}

}  // namespace

EffectDefinition dead_band() {
  return {.equation = "-W where |W| < w0, else 0",
          .source = "IEEE Std 528-2001, dead band",
          .parameters = {shape("half_width_deg_h", "w0", 0.1, {0.0, 1e6},
                               {0.01, 0.03, 0.1, 0.3, 1.0, 3.0})},
          .needs = {Need::kSlowReferenceRate},
          .confused_with = {"quantization"},
          .make = make_dead_band};
}

}  // namespace zerodrift::twin::effects
