// SPDX-License-Identifier: Apache-2.0
// Which parameters of a formula its result is linear in.
#pragma once

#include <cstddef>
#include <span>

#include "common/twin/formula.h"

namespace zerodrift::twin {

// A summand of the whole formula, as its parser meets it.
struct FormulaSummand {
  std::size_t node = 0;
  std::size_t position = 0;  // of its first character, from 0
};

// Marks those in `formula`, one of each summand or all of its spline. Throws FormulaProblem where a
// summand has none, or a spline stands where the result is not linear in it. O(nodes²).
void find_amplitudes(Formula& formula, std::span<const FormulaSummand> summands);

}  // namespace zerodrift::twin
