// SPDX-License-Identifier: Apache-2.0
// Input axis that isn't quite the body axis, so that it sees the rates about the other two:
//     m1 W(next) + m2 W(last),  next and last of axis x are y and z, of y z and x, of z x and y
// Default: 100 microradians (20 arcsec) towards the next axis.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_misalignment(const EffectContext& context) {
  const std::size_t next = (core::index(context.axis) + 1) % core::kAxisCount;
  const std::size_t last = (core::index(context.axis) + 2) % core::kAxisCount;
  const double towards_next = context.parameter("next_axis_urad") * 1e-6;
  const double towards_last = context.parameter("last_axis_urad") * 1e-6;
  return without_memory([=](const EffectInputs& inputs) {
    return towards_next * inputs.true_rate_radps[next] +
           towards_last * inputs.true_rate_radps[last];
  });
}

}  // namespace

EffectDefinition misalignment() {
  return {.equation = "m1 W(next axis) + m2 W(last axis)",
          .source = "IEEE Std 952-1997, input-axis misalignment",
          .parameters = {{"next_axis_urad", "m1: of x towards y, of y towards z, of z towards x",
                          100.0, -1e6, 1e6},
                         {"last_axis_urad", "m2: of x towards z, of y towards x, of z towards y",
                          0.0, -1e6, 1e6}},
          .needs = {Need::kCrossAxisRate},
          .confused_with = {"scale_factor"},
          .make = make_misalignment};
}

}  // namespace zerodrift::twin::effects
