// SPDX-License-Identifier: Apache-2.0
// Scale factor that changes with the rate itself, odd in the rate:
//     k W (W/W0)²
// Default: 20 ppm at W0 = 100 deg/s.
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class ScaleFactorNonlinearity final : public Effect {
 public:
  explicit ScaleFactorNonlinearity(const EffectContext& context)
      : axis_(core::index(context.axis)),
        error_(context.parameter("error_ppm") * 1e-6),
        full_radps_(context.parameter("at_deg_s") * core::kRadPerDeg) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double rate = inputs.true_rate_radps[axis_];
    const double share = rate / full_radps_;
    return error_ * rate * share * share;
  }

 private:
  std::size_t axis_;
  double error_;
  double full_radps_;
};

}  // namespace

EffectDefinition scale_factor_nonlinearity() {
  return {
      .kind = "scale_factor_nonlinearity",
      .equation = "k W (W/W0)^2",
      .source = "IEEE Std 952-1997, scale-factor nonlinearity",
      .contribution = Contribution::kDrift,
      .parameters = {{"error_ppm", "k, scale-factor error at W0", 20.0, -1e6, 1e6},
                     {"at_deg_s", "W0", 100.0, 1e-3, 1e5, ParameterRole::kConvention}},
      .inputs = {},
      .needs = {Need::kReferenceRate},
      .confused_with = {},
      .make = [](const EffectContext& c) { return std::make_unique<ScaleFactorNonlinearity>(c); }};
}

}  // namespace zerodrift::twin::effects
