// SPDX-License-Identifier: Apache-2.0
// The noise of a gyro against the noise of its model: which coefficients are wrong, which kind of
// noise is missing.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/noise_spectrum.h"
#include "common/diagnosis/search_problem.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

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
// degrees of freedom for its coefficient. A Markov noise is a telegraph where two levels are
// likelier (two_levels.h); slow noise listed without coefficients is asked for levels as well. A
// kind that the model lists without coefficients is fitted and reported as recalibrated from 0.
// Nothing is found in a record that stands still.
[[nodiscard]] NoiseFindings examine_noise(const NoiseQuestion& question,
                                          const SearchOptions& options);

// The slow noise that is more than three times what the model states, or that it states no value of
// (from 0); nullptr for none.
[[nodiscard]] const Recalibration* inflated_noise(const std::vector<Recalibration>& changes);

// Writes what was found into the model: new coefficients, new effects.
void adopt_noise(twin::Model& model, core::Axis axis, const NoiseFindings& findings,
                 const twin::Origin& origin);

}  // namespace zerodrift::diagnosis
