// SPDX-License-Identifier: Apache-2.0
// From what a search found to what is written into a model.
#pragma once

#include <vector>

#include "common/diagnosis/find_missing.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/search_problem.h"
#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

// The amplitudes once more beside the known parameters that were found wrong; the others stay as
// the model has them. In the search all were free, so that a small error of theirs is not mistaken
// for an effect; but corrections within their errors make a twin worse elsewhere. What doesn't fit
// together stays as it was.
void refit_amplitudes(SearchReport& report, const SearchProblem& searched,
                      const SearchOptions& options);

// Amplitudes of the model that were fitted to this record without what was found in it are no
// file's: they are fitted once more beside it. Those that had no evidence need some.
void free_calibrated(SearchReport& report, const std::vector<KnownParameter>& known,
                     const twin::Model& model, const TrialInput& input);

// What is left of the series without the corrections of the known columns, about its mean.
void take_off_corrections(std::vector<double>& left,
                          const std::vector<CorrectionFinding>& corrections,
                          const SearchProblem& problem);

// What is left after the search, with the known columns that were refitted: for the noise.
[[nodiscard]] std::vector<double> remainder_of(const SearchReport& report,
                                               const SearchProblem& problem);

// The trial's effects and events into its repaired model, with where they come from.
void add_to_model(Trial& trial, const TrialInput& input);

}  // namespace zerodrift::diagnosis
