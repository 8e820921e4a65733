// SPDX-License-Identifier: Apache-2.0
// Noise coefficients from an Allan deviation curve (IEEE Std 952 annex C):
//
//   sigma²(tau) = 3 Q²/tau² + N²/tau + (2 ln 2/pi) B² + K² tau/3 + R² tau²/2
//
// Inside everything is SI; noise_units.h converts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/allan/allan_point.h"

namespace zerodrift::allan {

enum class NoiseTerm : std::uint8_t {
  kQuantization,     // Q, rad
  kAngleRandomWalk,  // N, rad/√s
  kBiasInstability,  // B, rad/s
  kRateRandomWalk,   // K, rad/s^1.5
  kRateRamp,         // R, rad/s²
};

inline constexpr std::size_t kNoiseTermCount = 5;
inline constexpr std::array<NoiseTerm, kNoiseTermCount> kNoiseTerms{
    NoiseTerm::kQuantization, NoiseTerm::kAngleRandomWalk, NoiseTerm::kBiasInstability,
    NoiseTerm::kRateRandomWalk, NoiseTerm::kRateRamp};

constexpr std::size_t index(NoiseTerm term) {
  return static_cast<std::size_t>(term);
}

constexpr std::string_view symbol(NoiseTerm term) {
  constexpr std::array<std::string_view, kNoiseTermCount> kSymbols{"Q", "N", "B", "K", "R"};
  return kSymbols[index(term)];
}

template <typename T>
using PerNoiseTerm = std::array<T, kNoiseTermCount>;

// What a coefficient of 1 adds to the Allan variance at tau: the factors of the equation above.
[[nodiscard]] double unit_variance(NoiseTerm term, double tau_s) noexcept;

// Allan variance of a sum of noises with the given coefficients, (rad/s)².
[[nodiscard]] double model_variance(const PerNoiseTerm<double>& coefficients,
                                    double tau_s) noexcept;

enum class Identification : std::uint8_t {
  kNotFitted,   // not asked for, or not enough data
  kUpperBound,  // indistinguishable from zero: only `upper` says something, at the one-sided
                // confidence
  kInterval,    // value with two-sided bounds
};

struct Coefficient {
  Identification identification = Identification::kNotFitted;
  double value = 0.0;  // SI; the best fit also where only a bound is known (0 at the boundary)
  double lower = 0.0;
  double upper = 0.0;
};

struct CoefficientOptions {
  PerNoiseTerm<bool> fitted{false, true, true, true, false};  // N, B, K
  double confidence = 0.95;
  double min_degrees_of_freedom = 2.0;  // points with fewer are left out
  int max_iterations = 50;

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

enum class FitStatus : std::uint8_t {
  kConverged,
  kIterationLimit,  // weights still moved; the coefficients are those of the last round
  kTooFewPoints,    // fewer usable points than terms; nothing was fitted
};

struct CoefficientReport {
  FitStatus status = FitStatus::kTooFewPoints;
  PerNoiseTerm<Coefficient> coefficients{};
  std::size_t points = 0;  // used
  int iterations = 0;
  // Weighted square residuals over points - terms. The points are correlated, so values below 1 are
  // usual; values well above 1 say that the model lacks a term.
  double reduced_chi_square = 0.0;

  [[nodiscard]] const Coefficient& operator[](NoiseTerm term) const {
    return coefficients[index(term)];
  }
};

// Non-negative least squares on sigma² with weights edf / (2 sigma⁴), sigma² from the fitted model,
// iterated until the weights rest. Covariance by the sandwich formula with the correlation of
// overlapping estimates at different taus; bounds on the log scale. A term whose estimate does not
// exceed its uncertainty gets an upper bound only: the largest coefficient that would leave so
// small an estimate (very loose where the record is short for the term). Throws
// std::invalid_argument with validate()'s sentence. O(2^terms * points) an iteration, O(points²) at
// the end; allocates.
[[nodiscard]] CoefficientReport fit_coefficients(std::span<const AllanPoint> points,
                                                 const CoefficientOptions& options = {});

// Correlation of the overlapping Allan variances at two taus of one record of one pure noise, T
// much longer than both: the integral of the squared cross-covariance of their second differences
// (tabulated, interpolated).
[[nodiscard]] double variance_correlation(NoiseTerm noise, double tau_ratio) noexcept;

// The paper's way, for like-with-like comparison: each coefficient is read off the curve where the
// log-log slope between neighbours comes nearest to the term's own (-1, -1/2, 0, 1/2, 1), carried
// along that slope to its reading point: Q sqrt(3) s, N 1 s, K 3 s, R sqrt(2) s; B is the curve's
// minimum over 0.664. Nothing where no slope comes within 1/4; no statement of confidence. Points
// with fewer degrees of freedom than given are left out.
[[nodiscard]] PerNoiseTerm<std::optional<double>> read_slopes(std::span<const AllanPoint> points,
                                                              double min_degrees_of_freedom = 2.0);

}  // namespace zerodrift::allan
