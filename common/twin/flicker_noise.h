// SPDX-License-Identifier: Apache-2.0
// Bias instability (1/f noise) as a sum of first-order Markov processes, one an octave of
// correlation time.
#pragma once

#include <cstdint>
#include <vector>

#include "common/twin/random.h"
#include "common/twin/spectrum.h"

namespace zerodrift::twin {

struct FlickerNoiseOptions {
  double bias_instability = 0.0;         // B, in the unit of the output
  double shortest_correlation_s = 0.04;  // correlation times run from here in octaves
  double longest_correlation_s = 1e6;    // to at least here
};

// One-sided power spectral density of FlickerNoise at this interval, in its unit squared per Hz:
// within 2 % of B²/(pi f) for 1/f from 150 times the shortest (or 250 times interval_s, where that
// is longer) to 1/4 of the longest correlation time.
class FlickerDensity {
 public:
  FlickerDensity(const FlickerNoiseOptions& options, double interval_s);

  double operator()(double frequency_hz) const noexcept;

 private:
  double interval_s_;
  double level_variance_;
  std::vector<FirstOrderDensity> levels_;  // of unit variance
};

// Flicker of bias instability B has the one-sided spectrum B²/(pi f) and the flat Allan variance
// (2 ln2/pi) B² (IEEE Std 952-1997, Annex C). A Markov process of variance s² and correlation time
// T has 4 s² T/(1 + (2 pi f T)²); summed over T = T0 2^j that is s²/(ln2 f), hence s² = (ln2/pi) B²
// for every octave. The ends cost accuracy: the Allan deviation is within 2 % of flat for taus
// from 32 times the shortest to 1/16 of the longest correlation time, by default 1.3 s to 6e4 s.
class FlickerNoise {
 public:
  FlickerNoise(const FlickerNoiseOptions& options, double interval_s, const NoiseStream& noise);

  // Value at the next sample; `sample` counts up by one from call to call. Each process moves every
  // 1/16 of its correlation time (at most 1 s) and is held in between: about two random numbers a
  // sample.
  double step(std::uint64_t sample) noexcept;

  // Allan variance of the sum at tau, from the closed form of each process.
  [[nodiscard]] double allan_variance(double tau_s) const noexcept;

 private:
  struct Level {
    double correlation_s;
    std::uint64_t stride;  // samples from move to move
    double memory;         // exp(-stride interval / correlation)
    double innovation;     // standard deviation that keeps the process stationary
    NoiseStream noise;
    double value;
  };

  double level_variance_;
  std::vector<Level> levels_;  // shortest first, so that strides don't decrease
  double sum_ = 0.0;
};

}  // namespace zerodrift::twin
