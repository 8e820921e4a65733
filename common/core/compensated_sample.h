// SPDX-License-Identifier: Apache-2.0
// A sample with the drift taken off: what the compensation answers, and what its topic carries.
#pragma once

#include <cstdint>

#include "common/core/axis.h"
#include "common/core/mode.h"
#include "common/core/samples.h"

namespace zerodrift::core {

struct CompensatedSample {
  AngularRateSample raw;         // as it came; rate = raw.rate - applied_drift
  bool late = false;             // answered after a later sequence
  PerAxis<double> rate_radps{};  // frame b
  PerAxis<double> applied_drift_radps{};
  PerAxis<double> drift_variance{};   // (rad/s)²; -1 unknown
  PerAxis<double> sensor_variance{};  // of one sample about its one-second mean at rest; -1 unknown
  PerAxis<Mode> mode{};
  PerAxis<Reason> reason{};
  PerAxis<Rung> rung{};
  std::uint64_t model_epoch = 0;
  std::int64_t publish_time_ns = 0;  // carried along for the owner, never looked at
  std::int64_t ingress_time_ns = 0;
};

}  // namespace zerodrift::core
