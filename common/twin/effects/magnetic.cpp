// SPDX-License-Identifier: Apache-2.0
// Bias that follows the magnetic field (Faraday effect in a coil whose fibre is twisted):
//     kx Bx + ky By + kz Bz,  B the field in frame b
// Default: 0.002 deg/h/uT (0.2 deg/h per gauss) along x, a shielded coil.
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_magnetic(const EffectContext& context) {
  return along_axes({context.radps("x_deg_h_per_ut"), context.radps("y_deg_h_per_ut"),
                     context.radps("z_deg_h_per_ut")},
                    &EffectInputs::magnetic_ut);
}

}  // namespace

EffectDefinition magnetic() {
  return {.equation = "kx Bx + ky By + kz Bz",
          .source = "Hotate & Tabe, Applied Optics 25 (1986) 1086",
          .parameters = {{"x_deg_h_per_ut", "kx", 2e-3},
                         {"y_deg_h_per_ut", "ky", 0.0},
                         {"z_deg_h_per_ut", "kz", 0.0}},
          .needs = {Need::kMagnetic},
          .make = make_magnetic};
}

}  // namespace zerodrift::twin::effects
