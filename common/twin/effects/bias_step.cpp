// SPDX-License-Identifier: Apache-2.0
// Bias that shifts once and stays (a shock, stress that relaxes at once, another mode of the
// source):
//     A from t0 on, t since the start of the record
// Mean over the interval in which it falls. What happened in one record says nothing of the next.
// Default: 0.05 deg/h half an hour after the start.
#include <algorithm>

#include "common/twin/effect_parts.h"

namespace zerodrift::twin::effects {
namespace {

std::unique_ptr<Effect> make_bias_step(const EffectContext& context) {
  const double radps = context.radps("amplitude_deg_h");
  const double at_s = context.parameter("at_s");
  const double interval_s = context.interval_s;
  return without_memory([=](const EffectInputs& inputs) {
    return radps * std::clamp((inputs.time_s - at_s) / interval_s, 0.0, 1.0);
  });
}

}  // namespace

EffectDefinition bias_step() {
  return {.equation = "A from t0 on, t since the start of the record",
          .source = "IEEE Std 952-1997 (bias repeatability, shock)",
          .parameters = {{"amplitude_deg_h", "A", 0.05},
                         shape("at_s", "t0", 1800.0, {0.0, 1e9}, {600.0, 1800.0, 7200.0},
                               SearchRule::kTime)},
          .needs = {Need::kLongRecord},
          .confused_with = {"rate_random_walk"},
          .search = {.happens_once = true},
          .make = make_bias_step};
}

}  // namespace zerodrift::twin::effects
