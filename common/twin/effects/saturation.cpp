// SPDX-License-Identifier: Apache-2.0
// Output that ends at the sensor's limit:
//     the total clipped to -limit and limit
// Clipped samples say so. Default: 500 deg/s.
#include <algorithm>
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

class Saturation final : public Effect {
 public:
  explicit Saturation(const EffectContext& context)
      : limit_radps_(context.parameter("limit_deg_s") * core::kRadPerDeg) {}

  double step(const EffectInputs& inputs) noexcept override {
    const double clipped = std::clamp(inputs.rate_radps, -limit_radps_, limit_radps_);
    status_ = std::abs(inputs.rate_radps) > limit_radps_ ? SampleStatus::kClipped
                                                         : SampleStatus::kMeasured;
    return clipped - inputs.rate_radps;
  }

  [[nodiscard]] SampleStatus status() const noexcept override { return status_; }

 private:
  double limit_radps_;
  SampleStatus status_ = SampleStatus::kMeasured;
};

}  // namespace

EffectDefinition saturation() {
  return {.equation = "clip(total, -limit, limit)",
          .source = "IEEE Std 528-2001, input limits",
          .family = Family::kRecordFault,
          .contribution = Contribution::kOutput,
          .parameters = {shape("limit_deg_s", "largest rate that is given", 500.0, {1e-6, 1e6},
                               {10.0, 30.0, 100.0, 300.0, 1000.0})},
          .needs = {Need::kRawRate},
          .search = {.fault = LocalFault::kSaturation},
          .make = make<Saturation>};
}

}  // namespace zerodrift::twin::effects
