// SPDX-License-Identifier: Apache-2.0
// Bias that follows the current of the light source (Kerr effect, offsets of the detector):
//     k (I - I0)
// Default: 0.01 deg/h/mA.
#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class SourceIntensity final : public Effect {
 public:
  explicit SourceIntensity(const EffectContext& context)
      : radps_per_ma_(core::radps_from_deg_h(context.parameter("coefficient_deg_h_per_ma"))),
        reference_ma_(context.parameter("reference_ma")) {}

  double step(const EffectInputs& inputs) noexcept override {
    return radps_per_ma_ * (inputs.source_current_ma - reference_ma_);
  }

 private:
  double radps_per_ma_;
  double reference_ma_;
};

}  // namespace

EffectDefinition source_intensity() {
  return {.kind = "source_intensity",
          .equation = "k (I - I0)",
          .source = "Ezekiel, Davis & Hellwarth, Optics Letters 7 (1982) 457 (Kerr effect)",
          .contribution = Contribution::kDrift,
          .parameters = {{"coefficient_deg_h_per_ma", "k", 0.01},
                         {"reference_ma", "I0", kNominalSourceCurrentMa, 0.0, 1e4,
                          ParameterRole::kConvention}},
          .inputs = {},
          .needs = {Need::kSourceCurrent},
          .confused_with = {},
          .make = [](const EffectContext& c) { return std::make_unique<SourceIntensity>(c); }};
}

}  // namespace zerodrift::twin::effects
