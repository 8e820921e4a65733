// SPDX-License-Identifier: Apache-2.0
// Single samples that are far off (a transmission error, a discharge): a sample carries one with
// probability 1 - exp(-n dt), its height is Gaussian,
//     sigma w
// whatever the interval. Default: 10 deg/h, twice an hour.
#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_spikes(const EffectContext& context) {
  const NoiseStream heights = context.noise;
  const NoiseStream arrivals = context.noise.substream(0);
  const double deviation_radps = context.radps("deviation_deg_h");
  const double probability = -std::expm1(-context.parameter("spikes_per_h") * context.interval_s /
                                         core::kSecondsPerHour);  // a sample
  return without_memory([=](const EffectInputs& inputs) {
    if (arrivals.uniform(inputs.sample) >= probability) return 0.0;
    return deviation_radps * heights.gaussian(inputs.sample);
  });
}

}  // namespace

EffectDefinition spikes() {
  return {.equation = "sigma w in Poisson samples, n an hour",
          .source = "Poisson arrivals of Gaussian height",
          .family = Family::kRecordFault,
          .contribution = Contribution::kNoise,
          .parameters = {{"deviation_deg_h", "sigma, standard deviation of the height", 10.0, 0.0},
                         shape("spikes_per_h", "n", 2.0, {0.0, 1e6}, {0.3, 1.0, 3.0, 10.0, 30.0})},
          .needs = {Need::kRawRate},
          .search = {.fault = LocalFault::kSpikes},
          .make = make_spikes};
}

}  // namespace zerodrift::twin::effects
