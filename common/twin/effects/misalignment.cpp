// SPDX-License-Identifier: Apache-2.0
// Input axis that isn't quite the body axis, so that it sees the rates about the other two:
//     m1 W(next) + m2 W(last),  next and last of axis x are y and z, of y z and x, of z x and y
// Default: 100 microradians (20 arcsec) towards the next axis.
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Misalignment final : public Effect {
 public:
  explicit Misalignment(const EffectContext& context)
      : next_((core::index(context.axis) + 1) % core::kAxisCount),
        last_((core::index(context.axis) + 2) % core::kAxisCount),
        towards_next_(context.parameter("next_axis_urad") * 1e-6),
        towards_last_(context.parameter("last_axis_urad") * 1e-6) {}

  double step(const EffectInputs& inputs) noexcept override {
    return towards_next_ * inputs.true_rate_radps[next_] +
           towards_last_ * inputs.true_rate_radps[last_];
  }

 private:
  std::size_t next_;
  std::size_t last_;
  double towards_next_;
  double towards_last_;
};

}  // namespace

EffectDefinition misalignment() {
  return {.kind = "misalignment",
          .equation = "m1 W(next axis) + m2 W(last axis)",
          .source = "IEEE Std 952-1997, input-axis misalignment",
          .contribution = Contribution::kDrift,
          .parameters = {{"next_axis_urad", "m1: of x towards y, of y towards z, of z towards x",
                          100.0, -1e6, 1e6},
                         {"last_axis_urad", "m2: of x towards z, of y towards x, of z towards y",
                          0.0, -1e6, 1e6}},
          .inputs = {},
          .needs = {Need::kCrossAxisRate},
          .confused_with = {"scale_factor"},
          .make = [](const EffectContext& c) { return std::make_unique<Misalignment>(c); }};
}

}  // namespace zerodrift::twin::effects
