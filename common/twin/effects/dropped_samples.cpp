// SPDX-License-Identifier: Apache-2.0
// Samples that never arrive, singly or in bursts: a two-state chain that loses the share p of all
// samples in bursts of mean length L (at least one sample), stationary from the first sample. A
// lost sample has no rate (SampleStatus::kLost); the effect adds 0. Default: one in a thousand,
// singly.
#include <algorithm>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

class DroppedSamples final : public Effect {
 public:
  explicit DroppedSamples(const EffectContext& context) : noise_(context.noise) {
    const double share = context.parameter("share");
    const double samples = std::max(1.0, context.parameter("mean_burst_s") / context.interval_s);
    end_burst_ = 1.0 / samples;
    begin_burst_ = std::min(1.0, end_burst_ * share / (1.0 - share));
    if (noise_.substream(0).uniform(0) < share) status_ = SampleStatus::kLost;
  }

  double step(const EffectInputs& inputs) noexcept override {
    const double draw = noise_.uniform(inputs.sample);
    if (inputs.sample == 0) return 0.0;
    const bool lost = status_ == SampleStatus::kLost ? draw >= end_burst_ : draw < begin_burst_;
    status_ = lost ? SampleStatus::kLost : SampleStatus::kMeasured;
    return 0.0;
  }

  [[nodiscard]] SampleStatus status() const noexcept override { return status_; }

 private:
  NoiseStream noise_;
  double begin_burst_ = 0.0;  // probabilities a sample
  double end_burst_ = 1.0;
  SampleStatus status_ = SampleStatus::kMeasured;
};

}  // namespace

EffectDefinition dropped_samples() {
  return {.equation = "share p lost, in bursts of mean length L",
          .source = "Gilbert, Bell System Technical J. 39 (1960) 1253",
          .family = Family::kRecordFault,
          .contribution = Contribution::kOutput,
          .parameters = {shape("share", "p", 1e-3, {0.0, 0.5}, {1e-4, 1e-3, 1e-2, 0.1}),
                         shape("mean_burst_s", "L, 0 = single samples", 0.0, {0.0, 1e5},
                               {0.0, 0.1, 1.0, 10.0})},
          .needs = {Need::kTimeStamps},
          .search = {.fault = LocalFault::kDroppedSamples},
          .make = make<DroppedSamples>};
}

}  // namespace zerodrift::twin::effects
