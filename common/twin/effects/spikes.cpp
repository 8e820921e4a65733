// SPDX-License-Identifier: Apache-2.0
// Single samples that are far off (a transmission error, a discharge): a sample carries one with
// probability 1 - exp(-n dt), its height is Gaussian,
//     sigma w
// whatever the interval. Default: 10 deg/h, twice an hour.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"

namespace zerodrift::twin::effects {
namespace {

class Spikes final : public Effect {
 public:
  explicit Spikes(const EffectContext& context)
      : heights_(context.noise),
        arrivals_(context.noise.substream(0)),
        deviation_radps_(core::radps_from_deg_h(context.parameter("deviation_deg_h"))),
        probability_(-std::expm1(-context.parameter("spikes_per_h") * context.interval_s /
                                 core::kSecondsPerHour)) {}

  double step(const EffectInputs& inputs) noexcept override {
    if (arrivals_.uniform(inputs.sample) >= probability_) return 0.0;
    return deviation_radps_ * heights_.gaussian(inputs.sample);
  }

 private:
  NoiseStream heights_;
  NoiseStream arrivals_;
  double deviation_radps_;
  double probability_;  // a sample
};

}  // namespace

EffectDefinition spikes() {
  return {.kind = "spikes",
          .equation = "sigma w in Poisson samples, n an hour",
          .source = "Poisson arrivals of Gaussian height",
          .family = Family::kRecordFault,
          .contribution = Contribution::kNoise,
          .parameters = {{"deviation_deg_h", "sigma, standard deviation of the height", 10.0, 0.0},
                         {"spikes_per_h",
                          "n",
                          2.0,
                          0.0,
                          1e6,
                          ParameterRole::kShape,
                          {0.3, 1.0, 3.0, 10.0, 30.0}}},
          .inputs = {},
          .needs = {Need::kRawRate},
          .confused_with = {},
          .search = {.fault = LocalFault::kSpikes},
          .make = [](const EffectContext& c) { return std::make_unique<Spikes>(c); }};
}

}  // namespace zerodrift::twin::effects
