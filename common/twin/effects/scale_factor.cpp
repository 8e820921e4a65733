// SPDX-License-Identifier: Apache-2.0
// Scale-factor error:
//     k W,  W the true rate about the gyro's own axis (Earth rate included)
// Default: 100 ppm, tactical grade.
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class ScaleFactor final : public Effect {
 public:
  explicit ScaleFactor(const EffectContext& context)
      : axis_(core::index(context.axis)), error_(context.parameter("error_ppm") * 1e-6) {}

  double step(const EffectInputs& inputs) noexcept override {
    return error_ * inputs.true_rate_radps[axis_];
  }

 private:
  std::size_t axis_;
  double error_;
};

}  // namespace

EffectDefinition scale_factor() {
  return {.kind = "scale_factor",
          .equation = "k W",
          .source = "IEEE Std 952-1997, model equation",
          .contribution = Contribution::kDrift,
          .parameters = {{"error_ppm", "k", 100.0, -1e6, 1e6}},
          .inputs = {},
          .needs = {Need::kReferenceRate},
          .confused_with = {"misalignment"},
          .make = [](const EffectContext& c) { return std::make_unique<ScaleFactor>(c); }};
}

}  // namespace zerodrift::twin::effects
