// SPDX-License-Identifier: Apache-2.0
// Constant zero-rate offset. Default: turn-on bias of a tactical-grade FOG, 0.1 deg/h.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_bias(const EffectContext& context) {
  return without_memory(
      [bias_radps = context.radps("bias_deg_h")](const EffectInputs&) { return bias_radps; });
}

}  // namespace

EffectDefinition bias() {
  return {.equation = "b0",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {{"bias_deg_h", "offset b0", 0.1}},
          .search = {.is_constant = true},
          .make = make_bias};
}

}  // namespace zerodrift::twin::effects
