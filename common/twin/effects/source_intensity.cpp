// SPDX-License-Identifier: Apache-2.0
// Bias that follows the current of the light source (Kerr effect, offsets of the detector):
//     k (I - I0)
// Default: 0.01 deg/h/mA.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_source_intensity(const EffectContext& context) {
  const double radps_per_ma = context.radps("coefficient_deg_h_per_ma");
  const double reference_ma = context.parameter("reference_ma");
  return without_memory([=](const EffectInputs& inputs) {
    return radps_per_ma * (inputs.source_current_ma - reference_ma);
  });
}

}  // namespace

EffectDefinition source_intensity() {
  return {.equation = "k (I - I0)",
          .source = "Ezekiel, Davis & Hellwarth, Optics Letters 7 (1982) 457 (Kerr effect)",
          .parameters = {{"coefficient_deg_h_per_ma", "k", 0.01},
                         convention("reference_ma", "I0", kNominalSourceCurrentMa, {0.0, 1e4})},
          .needs = {Need::kSourceCurrent},
          .make = make_source_intensity};
}

}  // namespace zerodrift::twin::effects
