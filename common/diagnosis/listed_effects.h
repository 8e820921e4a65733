// SPDX-License-Identifier: Apache-2.0
// Effects that a model lists without coefficients: known to be there, fitted before anything that
// is missing is looked for.
#pragma once

#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

// Tells what this record has no channel or no component for, of all that the model lists.
void tell_untestable(Trial& trial, const TrialInput& input);

// Gives those without coefficients the ones of a search of their own.
void fit_listed(Trial& trial, const TrialInput& input);

// Those that got none are not passed over in silence.
void tell_unfitted(Trial& trial, const TrialInput& input);

}  // namespace zerodrift::diagnosis
