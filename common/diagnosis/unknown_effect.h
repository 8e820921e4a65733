// SPDX-License-Identifier: Apache-2.0
// What a generic function that won, or formulas, say of an effect that the catalogue lacks.
#pragma once

#include <string>
#include <vector>

#include "common/diagnosis/finding.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/joint_fit.h"

namespace zerodrift::diagnosis {

// Its shape in words and as a table over the first input. `channels`: those the function is of.
[[nodiscard]] UnknownEffect unknown_effect(const FittedEffect& found,
                                           const GenericFunction& function,
                                           const std::vector<InputChannel>& channels);

// "bump at 24 °C in temperature_coil", "something that depends on rate, supply".
[[nodiscard]] std::string dependence_in_words(const std::vector<std::string>& depends_on,
                                              const std::vector<double>& waveform,
                                              const std::vector<InputChannel>& channels);

// What formulas say: `waveform` is what they add together, about its mean, and `depends_on` what
// they read, by the channels' names.
[[nodiscard]] UnknownEffect unknown_as_formulas(std::string description,
                                                std::vector<NamedEffect> formulas,
                                                std::vector<std::string> depends_on,
                                                const std::vector<double>& waveform,
                                                const std::vector<InputChannel>& channels);

}  // namespace zerodrift::diagnosis
