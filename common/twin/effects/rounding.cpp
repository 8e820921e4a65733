// SPDX-License-Identifier: Apache-2.0
// Values that are written with too few digits: the rate is a multiple of a step q, and the true
// rate beside it one of a step r, whose error shows in the difference of both:
//     round(total / q) q - total + w - round(w / r) r
// Unlike quantization, which counts angle, nothing is carried over to the next sample. Default: a
// rate in steps of 0.1 deg/h, an exact true rate.
#include <cmath>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

double rounding_error(double value, double step) {
  return std::round(value / step) * step - value;
}

std::unique_ptr<Effect> make_rounding(const EffectContext& context) {
  const std::size_t axis = core::index(context.axis);
  const double step_radps = context.radps("step_deg_h");
  const double reference_step_radps = context.radps("reference_step_deg_h");
  return without_memory([=](const EffectInputs& inputs) {
    const double true_rate = inputs.true_rate_radps[axis];
    double added = 0.0;
    if (std::isfinite(inputs.rate_radps)) added += rounding_error(inputs.rate_radps, step_radps);
    if (reference_step_radps > 0.0 && std::isfinite(true_rate)) {
      added -= rounding_error(true_rate, reference_step_radps);
    }
    return added;
  });
}

}  // namespace

EffectDefinition rounding() {
  return {.equation = "round(total / q) q - total + w - round(w / r) r",
          .source = "Bennett, Bell System Technical J. 27 (1948) 446",
          .family = Family::kRecordFault,
          .contribution = Contribution::kOutput,
          .parameters = {shape("step_deg_h", "q, step of the rate", 0.1, {1e-9, 1e6},
                               {0.001, 0.01, 0.1, 1.0, 10.0}),
                         convention("reference_step_deg_h", "r, step of the true rate; 0 = exact",
                                    0.0, {0.0, 1e6})},
          .needs = {Need::kRawRate},
          .confused_with = {"quantization"},
          .search = {.fault = LocalFault::kRounding},
          .make = make_rounding};
}

}  // namespace zerodrift::twin::effects
