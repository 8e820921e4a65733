// SPDX-License-Identifier: Apache-2.0
// How far a measured deviation may be trusted: noise identification, equivalent degrees of freedom,
// bounds.
//
// Sources: C. A. Greenhall & W. J. Riley, "Uncertainty of stability variances based on finite
// differences", PTTI 2003
// ("G&R" below); W. J. Riley & C. A. Greenhall, "Power law noise identification using the lag 1
// autocorrelation", EFTF 2004; NIST SP 1065.
#pragma once

#include <cstdint>

#include "common/allan/noise_type.h"

namespace zerodrift::allan {

enum class Difference : std::uint8_t { kSecond = 2, kThird = 3 };  // Allan, Hadamard
enum class Averaging : std::uint8_t {
  kPlain,
  kModified
};  // modified also averages the angle over tau

// What an estimate of a variance was made of.
struct EstimateDesign {
  NoiseType noise = NoiseType::kAngleRandomWalk;
  double cluster_size = 1.0;  // m = tau / tau0
  double terms = 1.0;         // M, differences summed, >= 1
  double terms_per_tau =
      1.0;  // S: m where fully overlapped, 1 where not at all, 16 for a stride of tau/16
  Difference difference = Difference::kSecond;
  Averaging averaging = Averaging::kPlain;
};

// Equivalent degrees of freedom of the variance: 2 mean² / variance of the estimator. G&R's
// algorithm: the exact finite sum where it has at most 100 terms, else the asymptotic form for r =
// M/S > d + 1, else a sum with a coarser stride. At most 100 covariances (~10 µs).
[[nodiscard]] double equivalent_degrees_of_freedom(const EstimateDesign& design) noexcept;

struct Bounds {
  double lower = 0.0;
  double upper = 0.0;
};

// Two-sided bounds of a deviation s: sqrt(edf s² / chi²(1 - p/2)) and sqrt(edf s² / chi²(p/2)), p =
// 1 - confidence.
[[nodiscard]] Bounds deviation_bounds(double deviation, double degrees_of_freedom,
                                      double confidence) noexcept;

// Noise type whose second differences at lag tau have the lag-1 (lag tau) autocorrelation nearest
// to the measured one: -2/3 white angle, -1/2 white rate, -0.217 flicker, +1/4 random walk (the
// same model as the degrees of freedom). This is Riley's method with the number of differencings
// fixed at two, so that neither mean nor trend matters. `clusters` is T / tau. White angle lies
// close to white rate and would triple the degrees of freedom, so it must prove itself: 3 standard
// errors, 0.5 / sqrt(clusters) each, below white rate.
[[nodiscard]] NoiseType noise_type_from_lag1(double autocorrelation, double clusters) noexcept;

// Clusters (T / tau) below which the autocorrelation says too little; the noise of the next shorter
// tau is taken then.
inline constexpr double kClustersToIdentifyNoise = 30.0;

}  // namespace zerodrift::allan
