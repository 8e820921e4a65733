// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "common/core/units.h"
#include "common/twin/effect.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin::effects {

// Standard deviation of a sample of white noise of effects with this parameter: N/sqrt(dt).
inline double white_deviation_radps(const Parameters& parameters, double interval_s) {
  return parameters.at("coefficient_deg_per_sqrt_h") * core::kRadPerDeg /
         std::sqrt(core::kSecondsPerHour * interval_s);
}

// Its spectrum, 2 N²; N where nothing makes it grow.
inline Spectrum white_spectrum() {
  const auto density = [](const Parameters& parameters, double interval_s) -> Density {
    const double variance = std::pow(white_deviation_radps(parameters, interval_s), 2.0);
    return [level = white_density(variance, interval_s)](double /*frequency_hz*/) { return level; };
  };
  return {"coefficient_deg_per_sqrt_h", density, NoiseLaw::kWhite, core::kRadPerDeg / 60.0};
}

}  // namespace zerodrift::twin::effects
