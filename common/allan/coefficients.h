// SPDX-License-Identifier: Apache-2.0
// Noise coefficients from an Allan deviation curve (IEEE Std 952 annex C):
//
//   sigma²(tau) = 3 Q²/tau² + N²/tau + (2 ln 2/pi) B² + K² tau/3 + R² tau²/2
//     + A² (sin²(pi f tau)/(pi f tau))²                                     sinusoid
//     + (q T)²/tau [1 - (T/2 tau)(3 - 4 e^(-tau/T) + e^(-2 tau/T))]          first-order Markov
//
// N, B and K are always fitted; the rest where it is asked for or where the curve asks for it.
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
#include "common/allan/white_part.h"

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

// The same for a sinusoid of amplitude 1 rad/s and for a Markov noise with q = 1 rad/s^1.5.
[[nodiscard]] double sinusoid_unit_variance(double frequency_hz, double tau_s) noexcept;
[[nodiscard]] double markov_unit_variance(double time_constant_s, double tau_s) noexcept;

// Allan variance of a sum of noises with the given coefficients, (rad/s)².
[[nodiscard]] double model_variance(const PerNoiseTerm<double>& coefficients,
                                    double tau_s) noexcept;

enum class Identification : std::uint8_t {
  kNotFitted,   // not asked for, or not enough data
  kUpperBound,  // indistinguishable from zero: only `upper` says something, at the one-sided
                // confidence
  kInterval,    // value with two-sided bounds
  kWithheld,    // fitted, but the fit doesn't explain the curve: `value` says nothing of the gyro
};

struct Coefficient {
  Identification identification = Identification::kNotFitted;
  double value = 0.0;  // SI; the best fit also where only a bound is known (0 at the boundary)
  double lower = 0.0;
  double upper = 0.0;
};

// A rate A sin(2 pi f t + phase).
struct Sinusoid {
  Coefficient amplitude_radps;
  Coefficient frequency_hz;
};

// First-order Markov rate dy/dt = -y/T + q w, w white of unit density: walks with K = q below T,
// is white with N = qT above; standard deviation q sqrt(T/2).
struct MarkovNoise {
  Coefficient drive_radps_rts;  // q, rad/s^1.5
  Coefficient time_constant_s;  // T
};

// Terms that are added one by one where the curve cannot be explained without them.
struct TermsOnEvidence {
  bool quantization = false;
  bool rate_ramp = false;
  bool sinusoid = false;
  bool markov = false;
};

inline constexpr TermsOnEvidence kEveryTermOnEvidence{true, true, true, true};

inline constexpr int kMostOctavesLeftOut = 5;

struct CoefficientOptions {
  PerNoiseTerm<bool> fitted{false, true, true, true, false};  // N, B, K
  double confidence = 0.95;
  double min_degrees_of_freedom = 2.0;  // points with fewer are left out
  int max_iterations = 50;
  TermsOnEvidence on_evidence{};  // besides `fitted`
  // Shortest octaves of tau that may be left out, and one more, where the model cannot explain the
  // curve with them: a sensor's bandwidth, or a hum near half the sampling rate.
  int most_octaves_left_out = 0;

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

enum class FitStatus : std::uint8_t {
  kConverged,
  kIterationLimit,  // weights still moved; the coefficients are those of the last round
  kTooFewPoints,    // fewer usable points than terms; nothing was fitted
  kUnexplained,     // no mixture of these noises gives such a curve; see `white_alone`
};

struct TauRange {
  double from_s = 0.0;
  double to_s = 0.0;
};

struct CoefficientReport {
  FitStatus status = FitStatus::kTooFewPoints;
  PerNoiseTerm<Coefficient> coefficients{};
  std::size_t points = 0;       // used
  double shortest_tau_s = 0.0;  // of these
  ShortTaus short_taus = ShortTaus::kMixture;
  int iterations = 0;
  // Square residuals over points - terms, weighted by the inverse of the points' covariance. Values
  // well above 1 say that the model lacks a term.
  double reduced_chi_square = 0.0;
  // Of a curve that isn't explained: where N, and nothing else, could be stated.
  std::optional<TauRange> white_alone;
  std::optional<Sinusoid> sinusoid;   // where the curve asked for one
  std::optional<MarkovNoise> markov;  // where the curve asked for one

  [[nodiscard]] const Coefficient& operator[](NoiseTerm term) const {
    return coefficients[index(term)];
  }
};

// Generalised non-negative least squares on sigma²: weights are the inverse of the points'
// covariance (edf, and the correlation of overlapping estimates at different taus) under the fitted
// model, iterated until they rest; covariance by the sandwich formula; bounds on the log scale. A
// term whose estimate does not exceed its uncertainty gets an upper bound only: the largest
// coefficient that would leave so small an estimate, and never more than a single point of the
// curve allows.
//
// Terms on evidence, by forward selection: of the terms not in the model the one whose score - the
// part of the whitened residual that only this term can take up, in standard deviations under the
// model without it - is farthest above its threshold is added, f or T refined, and the search goes
// on. The thresholds (3.3 for Q and R, 4.8 for the sinusoid and 4.3 for the Markov noise, whose f
// and T are searched for) give a record of N, of N and K, or of N, B and K a chance below 2 % to
// get any further term (measured: CoefficientPromise of the unit tests). A sinusoid needs its first
// two peaks on the curve (1.5/f up to the longest tau) and f below a fifth of the sampling rate; a
// Markov noise T of at least eight times the shortest tau and 5 T up to the longest. Longer ones
// stay in B, K and R, shorter ones in N. What is refined to beyond its range is not added. A noise
// of short T is easily taken for B, and a few octaves of Markov noise *are* B: the simpler story is
// kept until it fails.
//
// Octaves left out: where the reduced chi-square of all points is above 3, one after the other up
// to `most_octaves_left_out` until it is not; one more then, for what it does not see; none where
// no number helps, since then the reason is elsewhere. The shortest taus are known to parts in a
// thousand and would outvote all others: fitted to all of an ADIS16405's, whose bandwidth shows up
// to 0.1 s, N comes out a fifth too small. N is meant to be the white noise that accumulates to an
// angle: over times longer than the sensor's own.
//
// Where it is white: where octaves may be left out and the shortest taus are those of a low-pass
// (white_part.h), the fit begins where the curve is white. A curve that the model doesn't explain -
// reduced chi-square above 3 and of a chance below 0.1 % - or whose white part the bandwidth hides
// states nothing: no bound and no interval of a model that is wrong. Where it has a white part all
// the same, that alone is fitted for N.
//
// Throws std::invalid_argument with validate()'s sentence. O(2^terms + points³) an iteration;
// allocates.
[[nodiscard]] CoefficientReport fit_coefficients(std::span<const AllanPoint> points,
                                                 const CoefficientOptions& options = {});

// fit_coefficients with every term on evidence, and the shortest octaves of tau left out where the
// curve asks for it.
[[nodiscard]] CoefficientReport identify_noise(std::span<const AllanPoint> points,
                                               CoefficientOptions options = {});

// Allan variance of everything that was fitted, (rad/s)², for the curve beside the points. Terms
// that have an upper bound only count with their best value.
[[nodiscard]] double model_variance(const CoefficientReport& report, double tau_s) noexcept;

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
