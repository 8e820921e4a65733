// SPDX-License-Identifier: Apache-2.0
// A formula that data which took no part in finding it confirm.
#pragma once

#include <optional>

#include "common/diagnosis/held_out.h"
#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

struct ProvedFormula {
  Trial trial;
  double held_out_nats = 0.0;  // how much likelier it makes what was kept back
};

// Beside `input.model`, by explain_by_formula() (formula_search.h), whose cost it has. Nothing
// where nothing was kept back, no formula has the evidence, or what was kept back speaks against
// it.
[[nodiscard]] std::optional<ProvedFormula> proved_formula(const TrialInput& input,
                                                          const Split& split);

// How much likelier `repaired` makes what was kept back than `input.model` does: its drift, and its
// noise on what the drift leaves.
[[nodiscard]] double held_out_nats(const TrialInput& input, const Split& split,
                                   const twin::Model& repaired);

}  // namespace zerodrift::diagnosis
