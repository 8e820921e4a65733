// SPDX-License-Identifier: Apache-2.0
// Rates too small to be felt (cross-talk from the modulation into the detector locks the loop):
//     -W where |W| < w0, else 0
// Default: 0.1 deg/h.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class DeadBand final : public Effect {
 public:
  explicit DeadBand(const EffectContext& context)
      : axis_(core::index(context.axis)),
        half_width_radps_(core::radps_from_deg_h(context.parameter("half_width_deg_h"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double rate = inputs.true_rate_radps[axis_];
    return std::abs(rate) < half_width_radps_ ? -rate : 0.0;
  }

 private:
  std::size_t axis_;
  double half_width_radps_;
};

}  // namespace

EffectDefinition dead_band() {
  return {.kind = "dead_band",
          .equation = "-W where |W| < w0, else 0",
          .source = "IEEE Std 528-2001, dead band",
          .contribution = Contribution::kDrift,
          .parameters = {{"half_width_deg_h",
                          "w0",
                          0.1,
                          0.0,
                          1e6,
                          ParameterRole::kShape,
                          {0.01, 0.03, 0.1, 0.3, 1.0, 3.0}}},
          .inputs = {},
          .needs = {Need::kSlowReferenceRate},
          .confused_with = {"quantization"},
          .make = [](const EffectContext& c) { return std::make_unique<DeadBand>(c); }};
}

}  // namespace zerodrift::twin::effects
