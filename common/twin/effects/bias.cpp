// SPDX-License-Identifier: Apache-2.0
// Constant zero-rate offset. Default: turn-on bias of a tactical-grade FOG, 0.1 deg/h.
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Bias final : public Effect {
 public:
  explicit Bias(const EffectContext& context)
      : bias_radps_(core::radps_from_deg_h(context.parameter("bias_deg_h"))) {}

  double step(const EffectInputs& /*inputs*/) noexcept override { return bias_radps_; }

 private:
  double bias_radps_;
};

}  // namespace

EffectDefinition bias() {
  return {.kind = "bias",
          .equation = "b0",
          .source = "IEEE Std 952-1997, model equation",
          .contribution = Contribution::kDrift,
          .parameters = {{"bias_deg_h", "offset b0", 0.1}},
          .inputs = {},
          .needs = {},
          .confused_with = {},
          .search = {.is_constant = true},
          .make = [](const EffectContext& c) { return std::make_unique<Bias>(c); }};
}

}  // namespace zerodrift::twin::effects
