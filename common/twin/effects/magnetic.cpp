// SPDX-License-Identifier: Apache-2.0
// Bias that follows the magnetic field (Faraday effect in a coil whose fibre is twisted):
//     kx Bx + ky By + kz Bz,  B the field in frame b
// Default: 0.002 deg/h/uT (0.2 deg/h per gauss) along x, a shielded coil.
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Magnetic final : public Effect {
 public:
  explicit Magnetic(const EffectContext& context)
      : x_(core::radps_from_deg_h(context.parameter("x_deg_h_per_ut"))),
        y_(core::radps_from_deg_h(context.parameter("y_deg_h_per_ut"))),
        z_(core::radps_from_deg_h(context.parameter("z_deg_h_per_ut"))) {}

  double step(const EffectInputs& inputs) noexcept override {
    const core::PerAxis<double>& v = inputs.magnetic_ut;
    return x_ * v[0] + y_ * v[1] + z_ * v[2];
  }

 private:
  double x_, y_, z_;  // rad/s per uT
};

}  // namespace

EffectDefinition magnetic() {
  return {.kind = "magnetic",
          .equation = "kx Bx + ky By + kz Bz",
          .source = "Hotate & Tabe, Applied Optics 25 (1986) 1086",
          .contribution = Contribution::kDrift,
          .parameters = {{"x_deg_h_per_ut", "kx", 2e-3},
                         {"y_deg_h_per_ut", "ky", 0.0},
                         {"z_deg_h_per_ut", "kz", 0.0}},
          .inputs = {},
          .needs = {Need::kMagnetic},
          .confused_with = {},
          .make = [](const EffectContext& c) { return std::make_unique<Magnetic>(c); }};
}

}  // namespace zerodrift::twin::effects
