// SPDX-License-Identifier: Apache-2.0
// A formula that data which took no part in finding it confirm.
#pragma once

#include <optional>

#include "common/diagnosis/formula_search.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

// Beside `input.model`, by explain_by_formula() (formula_search.h), whose cost it has. Nothing
// where nothing was kept back, no formula has the evidence, or what was kept back speaks against
// it.
[[nodiscard]] std::optional<Trial> proved_formula(const TrialInput& input, const Split& split,
                                                  Vocabulary vocabulary);

}  // namespace zerodrift::diagnosis
