// SPDX-License-Identifier: Apache-2.0
// Scale-factor error:
//     k W,  W the true rate about the gyro's own axis (Earth rate included)
// Default: 100 ppm, tactical grade.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_scale_factor(const EffectContext& context) {
  const std::size_t axis = core::index(context.axis);
  const double error = context.parameter("error_ppm") * 1e-6;
  return without_memory(
      [=](const EffectInputs& inputs) { return error * inputs.true_rate_radps[axis]; });
}

}  // namespace

EffectDefinition scale_factor() {
  return {.equation = "k W",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {{"error_ppm", "k", 100.0, -1e6, 1e6}},
          .needs = {Need::kReferenceRate},
          .confused_with = {"misalignment"},
          .make = make_scale_factor};
}

}  // namespace zerodrift::twin::effects
