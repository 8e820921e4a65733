// SPDX-License-Identifier: Apache-2.0
// One-sided power spectral densities of series sampled every interval_s, at
// 0 < frequency_hz <= 1/(2 interval_s): their integral up to there is the variance. Aliasing is
// part of them (they are the discrete processes' own, not the sampled continuous ones').
#pragma once

#include <cmath>
#include <numbers>

namespace zerodrift::twin {

// sin(pi f dt).
inline double half_angle(double frequency_hz, double interval_s) noexcept {
  return std::sin(std::numbers::pi * frequency_hz * interval_s);
}

// White, of this variance.
inline double white_density(double variance, double interval_s) noexcept {
  return 2.0 * variance * interval_s;
}

// First-order Markov: a series of this variance whose correlation falls by exp(-interval_s/tau)
// from sample to sample. Far below 1/interval_s it is 4 variance tau/(1 + (2 pi f tau)²).
class FirstOrderDensity {
 public:
  FirstOrderDensity(double variance, double tau_s, double interval_s) noexcept
      : interval_s_(interval_s),
        memory_(std::exp(-interval_s / tau_s)),
        lost_(-std::expm1(-interval_s / tau_s)),
        white_(white_density(variance * lost_ * (1.0 + memory_), interval_s)) {}

  double operator()(double frequency_hz) const noexcept {
    return at(half_angle(frequency_hz, interval_s_));
  }
  // At sin(pi frequency_hz interval_s).
  [[nodiscard]] double at(double half_angle) const noexcept {
    return white_ / (lost_ * lost_ + 4.0 * memory_ * half_angle * half_angle);
  }

 private:
  double interval_s_;
  double memory_;
  double lost_;
  double white_;
};

}  // namespace zerodrift::twin
