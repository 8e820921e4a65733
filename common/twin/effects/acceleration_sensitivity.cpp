// SPDX-License-Identifier: Apache-2.0
// Bias that follows the acceleration, gravity included (strain of the coil):
//     kx ax + ky ay + kz az,  a the specific force in frame b
// Default: 0.02 deg/h/g along x.
#include "common/core/units.h"
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_acceleration_sensitivity(const EffectContext& context) {
  return along_axes({context.radps("x_deg_h_per_g") / core::kStandardGravityMps2,
                     context.radps("y_deg_h_per_g") / core::kStandardGravityMps2,
                     context.radps("z_deg_h_per_g") / core::kStandardGravityMps2},
                    &EffectInputs::acceleration_mps2);
}

}  // namespace

EffectDefinition acceleration_sensitivity() {
  return {.equation = "kx ax + ky ay + kz az",
          .source = "IEEE Std 952-1997, model equation",
          .parameters = {{"x_deg_h_per_g", "kx", 0.02},
                         {"y_deg_h_per_g", "ky", 0.0},
                         {"z_deg_h_per_g", "kz", 0.0}},
          .needs = {Need::kAcceleration},
          .confused_with = {"vibration_rectification"},
          .make = make_acceleration_sensitivity};
}

}  // namespace zerodrift::twin::effects
