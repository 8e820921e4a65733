// SPDX-License-Identifier: Apache-2.0
// Effects that a model lists without coefficients: what becomes of each.
#pragma once

#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

// Tells what this record has no channel or no component for, of all that the model lists.
void tell_untestable(Trial& trial, const TrialInput& input);

// What was found of a listed effect becomes its inputs and coefficients, reported as recalibrated
// from nothing. Amplitudes without a standard error are those of which nothing is known.
void give_coefficients(twin::EffectSpec& waiting, const Candidate& candidate,
                       const NamedEffect& found, std::vector<Recalibration>& changed);

// Those that got none are not passed over in silence.
void tell_unfitted(Trial& trial, const TrialInput& input);

}  // namespace zerodrift::diagnosis
