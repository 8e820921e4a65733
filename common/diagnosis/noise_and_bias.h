// SPDX-License-Identifier: Apache-2.0
// What every trial ends with: the noise and the mean that its drift leaves.
#pragma once

#include <span>

#include "common/diagnosis/search_problem.h"
#include "common/diagnosis/stochastic_effects.h"
#include "common/diagnosis/trial.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// Of a remainder beside the problem's known columns.
[[nodiscard]] NoiseFindings noise_of(std::span<const double> remainder, const TrialInput& input,
                                     const SearchProblem& problem, const twin::Model& model);

// Into the trial's repaired model, and reported.
void take_noise(Trial& trial, const TrialInput& input, const NoiseFindings& noise);

// A form that was searched for has no zero of its own: where the record's mean is further off with
// it than with the model that it was added to, the bias takes up the difference.
void keep_mean(Trial& trial, const TrialInput& input);

// The bias takes up the mean that the repaired model's drift leaves where it is more than the
// trial's slow noise makes of a mean, or where the model has no bias to speak of yet. Its standard
// error is that of the mean, as if the rest of the drift were known.
void recalibrate_bias(Trial& trial, const TrialInput& input);

// Of a trial that stands in the end: the standard error of a bias that it fitted, in the model and
// as it is told, gets what the errors of the other coefficients carry into it.
void complete_error_of_bias(Trial& trial, const TrialInput& input);

}  // namespace zerodrift::diagnosis
