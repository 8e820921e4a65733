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

// The stochastic effects that a model lists for an axis, as terms of a noise spectrum of a series
// of which this share is valid: bridges over missing samples carry none of the white noises (white
// rate, white angle), whose power falls by as much. `relative_sigma` of a square where the file
// gives no standard error.
[[nodiscard]] NoisePrior noise_prior(const twin::Model& model, core::Axis axis,
                                     double relative_sigma, double valid_share);

[[nodiscard]] double valid_share(std::span<const std::uint8_t> valid);

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
// is a telegraph (its kurtosis, about its sampling error for as many dwell times as there are).
[[nodiscard]] NoiseFindings examine_noise(const NoiseQuestion& question,
                                          const SearchOptions& options);

// Writes what was found into the model: new coefficients, new effects.
void adopt_noise(twin::Model& model, core::Axis axis, const NoiseFindings& findings,
                 const twin::Origin& origin);

}  // namespace zerodrift::diagnosis
