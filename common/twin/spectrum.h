// SPDX-License-Identifier: Apache-2.0
// One-sided power spectral densities of series sampled every interval_s, at
// 0 < frequency_hz <= 1/(2 interval_s): their integral up to there is the variance. Aliasing is
// part of them (they are the discrete processes' own, not the sampled continuous ones').
#pragma once

#include <cmath>
#include <numbers>

namespace zerodrift::twin {

// White, of this variance.
inline double white_density(double variance, double interval_s) noexcept {
  return 2.0 * variance * interval_s;
}

// First-order Markov: a series of this variance whose correlation falls by exp(-interval_s/tau)
// from sample to sample. Far below 1/interval_s it is 4 variance tau/(1 + (2 pi f tau)²).
inline double first_order_density(double variance, double tau_s, double frequency_hz,
                                  double interval_s) noexcept {
  const double memory = std::exp(-interval_s / tau_s);
  const double lost = -std::expm1(-interval_s / tau_s);
  const double half_angle = std::sin(std::numbers::pi * frequency_hz * interval_s);
  return white_density(variance * lost * (1.0 + memory), interval_s) /
         (lost * lost + 4.0 * memory * half_angle * half_angle);
}

}  // namespace zerodrift::twin
