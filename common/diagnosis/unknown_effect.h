// SPDX-License-Identifier: Apache-2.0
// What a generic function that won says of an effect that the catalogue lacks.
#pragma once

#include <vector>

#include "common/diagnosis/finding.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/joint_fit.h"

namespace zerodrift::diagnosis {

// Its shape in words and as a table over the first input. `channels`: those the function is of.
[[nodiscard]] UnknownEffect unknown_effect(const FittedEffect& found,
                                           const GenericFunction& function,
                                           const std::vector<InputChannel>& channels);

}  // namespace zerodrift::diagnosis
