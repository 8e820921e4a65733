// SPDX-License-Identifier: Apache-2.0
// Scale factor that differs between the two senses of rotation, even in the rate:
//     k |W|
// Default: 10 ppm.
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_scale_factor_asymmetry(const EffectContext& context) {
  const std::size_t axis = core::index(context.axis);
  const double error = context.parameter("error_ppm") * 1e-6;
  return without_memory(
      [=](const EffectInputs& inputs) { return error * std::abs(inputs.true_rate_radps[axis]); });
}

}  // namespace

EffectDefinition scale_factor_asymmetry() {
  return {
      .equation = "k |W|",
      .source = "IEEE Std 952-1997, scale-factor asymmetry",
      .parameters = {{"error_ppm", "k, half the difference between the senses", 10.0, -1e6, 1e6}},
      .needs = {Need::kReferenceRate},
      .make = make_scale_factor_asymmetry};
}

}  // namespace zerodrift::twin::effects
