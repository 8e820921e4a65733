// SPDX-License-Identifier: Apache-2.0
// Scale factor that differs between the two senses of rotation, even in the rate:
//     k |W|
// Default: 10 ppm.
#include <cmath>

#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class ScaleFactorAsymmetry final : public Effect {
 public:
  explicit ScaleFactorAsymmetry(const EffectContext& context)
      : axis_(core::index(context.axis)), error_(context.parameter("error_ppm") * 1e-6) {}

  double step(const EffectInputs& inputs) noexcept override {
    return error_ * std::abs(inputs.true_rate_radps[axis_]);
  }

 private:
  std::size_t axis_;
  double error_;
};

}  // namespace

EffectDefinition scale_factor_asymmetry() {
  return {
      .kind = "scale_factor_asymmetry",
      .equation = "k |W|",
      .source = "IEEE Std 952-1997, scale-factor asymmetry",
      .contribution = Contribution::kDrift,
      .parameters = {{"error_ppm", "k, half the difference between the senses", 10.0, -1e6, 1e6}},
      .inputs = {},
      .needs = {Need::kReferenceRate},
      .confused_with = {},
      .make = [](const EffectContext& c) { return std::make_unique<ScaleFactorAsymmetry>(c); }};
}

}  // namespace zerodrift::twin::effects
