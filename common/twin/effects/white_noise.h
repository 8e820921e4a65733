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
  const auto density = [](const Parameters& parameters, double /*frequency_hz*/,
                          double interval_s) {
    return white_density(std::pow(white_deviation_radps(parameters, interval_s), 2.0), interval_s);
  };
  return {"coefficient_deg_per_sqrt_h", density, NoiseLaw::kWhite, core::kRadPerDeg / 60.0};
}

}  // namespace zerodrift::twin::effects
