// SPDX-License-Identifier: Apache-2.0
// One point of an Allan deviation curve, with what is needed to judge it.
#pragma once

#include <cstdint>

#include "common/allan/noise_type.h"

namespace zerodrift::allan {

struct AllanPoint {
  double tau_s = 0.0;               // cluster time
  double deviation_radps = 0.0;     // overlapping Allan deviation
  std::uint64_t pairs = 0;          // second differences behind it
  double degrees_of_freedom = 0.0;  // equivalent, for `noise`
  double lower_radps = 0.0;         // chi-square bounds at the confidence that was asked for
  double upper_radps = 0.0;
  NoiseType noise = NoiseType::kAngleRandomWalk;  // identified at this tau
  double clusters = 0.0;  // pairs over pairs per tau, about T/tau - 2; 0 where not known
};

}  // namespace zerodrift::allan
