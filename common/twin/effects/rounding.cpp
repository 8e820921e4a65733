// SPDX-License-Identifier: Apache-2.0
// Values that are written with too few digits: the rate is a multiple of a step q, and the true
// rate beside it one of a step r, whose error shows in the difference of both:
//     round(total / q) q - total + w - round(w / r) r
// Unlike quantization, which counts angle, nothing is carried over to the next sample. Default: a
// rate in steps of 0.1 deg/h, an exact true rate.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Rounding final : public Effect {
 public:
  explicit Rounding(const EffectContext& context)
      : step_radps_(core::radps_from_deg_h(context.parameter("step_deg_h"))),
        reference_step_radps_(core::radps_from_deg_h(context.parameter("reference_step_deg_h"))),
        axis_(core::index(context.axis)) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double true_rate = inputs.true_rate_radps[axis_];
    double added = 0.0;
    if (std::isfinite(inputs.rate_radps)) added += error(inputs.rate_radps, step_radps_);
    if (reference_step_radps_ > 0.0 && std::isfinite(true_rate))
      added -= error(true_rate, reference_step_radps_);
    return added;
  }

 private:
  static double error(double value, double step) { return std::round(value / step) * step - value; }

  double step_radps_;
  double reference_step_radps_;
  std::size_t axis_;
};

}  // namespace

EffectDefinition rounding() {
  return {.kind = "rounding",
          .equation = "round(total / q) q - total + w - round(w / r) r",
          .source = "Bennett, Bell System Technical J. 27 (1948) 446",
          .family = Family::kRecordFault,
          .contribution = Contribution::kOutput,
          .parameters = {{"step_deg_h",
                          "q, step of the rate",
                          0.1,
                          1e-9,
                          1e6,
                          ParameterRole::kShape,
                          {0.001, 0.01, 0.1, 1.0, 10.0}},
                         {"reference_step_deg_h", "r, step of the true rate; 0 = exact", 0.0, 0.0,
                          1e6, ParameterRole::kConvention}},
          .inputs = {},
          .needs = {Need::kRawRate},
          .confused_with = {"quantization"},
          .search = {.fault = LocalFault::kRounding},
          .make = [](const EffectContext& c) { return std::make_unique<Rounding>(c); }};
}

}  // namespace zerodrift::twin::effects
