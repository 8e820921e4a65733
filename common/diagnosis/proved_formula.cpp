// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/proved_formula.h"

#include <utility>

#include "common/diagnosis/formula_search.h"

namespace zerodrift::diagnosis {
namespace {

double nats(const Comparison& comparison) {
  return comparison.gain_nats + comparison.noise_gain_nats;
}

}  // namespace

std::optional<ProvedFormula> proved_formula(const TrialInput& input, const Split& split) {
  if (split.kind == HeldOut::kNothing) return std::nullopt;
  std::optional<Trial> trial = explain_by_formula(input);
  if (!trial) return std::nullopt;
  const Comparison gain = compare_on(split.held_out, input.model, trial->repaired, input.axis);
  if (judge(*trial, gain, split.kind) != Acceptance::kAccepted) return std::nullopt;
  return ProvedFormula{*std::move(trial), nats(gain)};
}

double held_out_nats(const TrialInput& input, const Split& split, const twin::Model& repaired) {
  return nats(compare_on(split.held_out, input.model, repaired, input.axis));
}

}  // namespace zerodrift::diagnosis
