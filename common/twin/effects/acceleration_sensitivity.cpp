// SPDX-License-Identifier: Apache-2.0
// Bias that follows the acceleration, gravity included (strain of the coil):
//     kx ax + ky ay + kz az,  a the specific force in frame b
// Default: 0.02 deg/h/g along x.
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

constexpr double kStandardGravityMps2 = 9.80665;

class AccelerationSensitivity final : public Effect {
 public:
  explicit AccelerationSensitivity(const EffectContext& context)
      : x_(core::radps_from_deg_h(context.parameter("x_deg_h_per_g")) / kStandardGravityMps2),
        y_(core::radps_from_deg_h(context.parameter("y_deg_h_per_g")) / kStandardGravityMps2),
        z_(core::radps_from_deg_h(context.parameter("z_deg_h_per_g")) / kStandardGravityMps2) {}

  double step(const EffectInputs& inputs) noexcept override {
    const core::PerAxis<double>& v = inputs.acceleration_mps2;
    return x_ * v[0] + y_ * v[1] + z_ * v[2];
  }

 private:
  double x_, y_, z_;  // rad/s per m/s²
};

}  // namespace

EffectDefinition acceleration_sensitivity() {
  return {
      .kind = "acceleration_sensitivity",
      .equation = "kx ax + ky ay + kz az",
      .source = "IEEE Std 952-1997, model equation",
      .contribution = Contribution::kDrift,
      .parameters = {{"x_deg_h_per_g", "kx", 0.02},
                     {"y_deg_h_per_g", "ky", 0.0},
                     {"z_deg_h_per_g", "kz", 0.0}},
      .inputs = {},
      .needs = {Need::kAcceleration},
      .confused_with = {"vibration_rectification"},
      .make = [](const EffectContext& c) { return std::make_unique<AccelerationSensitivity>(c); }};
}

}  // namespace zerodrift::twin::effects
