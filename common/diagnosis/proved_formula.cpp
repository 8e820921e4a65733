// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/proved_formula.h"

namespace zerodrift::diagnosis {

std::optional<Trial> proved_formula(const TrialInput& input, const Split& split,
                                    Vocabulary vocabulary) {
  if (split.kind == HeldOut::kNothing) return std::nullopt;
  std::optional<Trial> trial = explain_by_formula(input, vocabulary);
  if (!trial) return std::nullopt;
  const Comparison gain = compare_on(split.held_out, input.model, trial->repaired, input.axis);
  if (judge(*trial, gain, split.kind) != Acceptance::kAccepted) return std::nullopt;
  return trial;
}

}  // namespace zerodrift::diagnosis
