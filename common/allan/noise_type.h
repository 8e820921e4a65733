// SPDX-License-Identifier: Apache-2.0
// The power-law noises of a gyro's rate. The value is the exponent alpha of the rate's spectral
// density S(f) ~ f^alpha.
#pragma once

#include <cstdint>
#include <string_view>

namespace zerodrift::allan {

enum class NoiseType : std::int8_t {
  kQuantization = 2,      // white angle; Allan deviation ~ 1/tau
  kAngleRandomWalk = 0,   // white rate; ~ 1/sqrt(tau)
  kBiasInstability = -1,  // flicker of rate; constant
  kRateRandomWalk = -2,   // ~ sqrt(tau); steeper noises and ramps are filed here
};

constexpr std::string_view name(NoiseType noise) {
  switch (noise) {
    case NoiseType::kQuantization: return "quantization";
    case NoiseType::kAngleRandomWalk: return "angle random walk";
    case NoiseType::kBiasInstability: return "bias instability";
    case NoiseType::kRateRandomWalk: return "rate random walk";
  }
  return "unknown";
}

}  // namespace zerodrift::allan
