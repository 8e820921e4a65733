// SPDX-License-Identifier: Apache-2.0
// The noise of a gyro against the noise of its model: which coefficients are wrong, which kind of
// noise is missing.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/diagnosis.h"
#include "common/diagnosis/noise_spectrum.h"
#include "common/diagnosis/search.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// Relative standard error of a model's noise squares without one in the file.
inline constexpr double kModelNoiseSigma = 0.3;

// The stochastic effects that a model lists for an axis, as terms of a noise spectrum of a series
// of which this share is valid: bridges over missing samples carry none of the white noises (white
// rate, white angle), whose power falls by as much. `relative_sigma` of a square where the file
// gives no standard error.
[[nodiscard]] NoisePrior noise_prior(const twin::Model& model, core::Axis axis,
                                     double relative_sigma, double valid_share);

[[nodiscard]] double valid_share(std::span<const std::uint8_t> valid);

// Share of a noise's power that is left in a series of which `share` is valid, as GapBridge bridges
// it: `share` of the white noises, all of the slow ones.
[[nodiscard]] double seen_share(NoiseKind kind, double share);

struct NoiseFindings {
  std::vector<NamedEffect> effects{};  // kinds the model lacks
  std::vector<Recalibration> recalibrated{};
  std::vector<NoiseTerm> terms{};  // of the noise as found
  std::vector<double> squares{};
};

struct NoiseQuestion {
  // series: what is left after all deterministic effects; known columns as in the search.
  const SearchProblem& problem;
  const twin::Model& model;
  core::Axis axis;
  double false_alarm = 0.01;
};

// Restricted likelihoods of the model's own kinds with free coefficients, then with one more kind
// at a time (angle random walk, bias instability, rate random walk, quantisation, Markov at several
// correlation times), accepted above log(kinds / false_alarm) after half a log of the number of
// degrees of freedom for its coefficient. A Markov noise whose most probable course has two levels
// is a telegraph (kurtosis less the square of the skewness, 1 of any two levels and 3 of a
// Gaussian, about its sampling error for as many dwell times as there are). A kind that the model
// lists without coefficients is fitted and told of as recalibrated from 0. Nothing is found in a
// record that stands still.
[[nodiscard]] NoiseFindings examine_noise(const NoiseQuestion& question,
                                          const SearchOptions& options);

// Writes what was found into the model: new coefficients, new effects.
void adopt_noise(twin::Model& model, core::Axis axis, const NoiseFindings& findings,
                 const twin::Origin& origin);

}  // namespace zerodrift::diagnosis
