// SPDX-License-Identifier: Apache-2.0
// A formula for what the catalogue doesn't know, judged by the same evidence as the catalogue's
// effects and against the same nameless rivals.
//
//   terms: the grammar of formula_terms.h to depth 3. Screen (term_screen.h) -> the few best terms
//   as groups of a search beside every generic function; each pays for the whole grammar that was
//   looked at. While a generic function stays significant beside them, once more for what is left.
//   curves: splines over the inputs of the generic function that won, one times the other where
//   there are two. While another one stays significant beside them, once more for its inputs.
#pragma once

#include <cstdint>
#include <optional>

#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

enum class Vocabulary : std::uint8_t { kTerms, kCurves };

// `input.model` is what stands without the unknown. The trial's effects are the formulas, which its
// repaired model has too, and its unknown tells them. Nothing where no formula has the evidence;
// whether other data confirm one is not asked here. Deterministic; at most two screens and two
// searches, some 4 s for 18 000 points and 30 operands.
[[nodiscard]] std::optional<Trial> explain_by_formula(const TrialInput& input,
                                                      Vocabulary vocabulary);

}  // namespace zerodrift::diagnosis
