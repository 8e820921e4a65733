// SPDX-License-Identifier: Apache-2.0
// Fewer variants of a candidate whose shapes multiply: an exact evaluation of each would cost more
// than all others together.
#pragma once

#include <span>
#include <vector>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/playback.h"

namespace zerodrift::diagnosis {

// Keeps, of the variants with a threshold (twin::SearchRule::kThreshold) that share it and the
// inputs, the three that explain most of the residual: (s' C^-1 r)² / (s' C^-1 s) on means over
// blocks, at most 2000 of them. They are given the prior of all that they stand for, as far as
// those explain the residual as well. Candidates without such a shape stay as they are. `weighted`:
// C^-1 r; `variances`: eigenvalues of C in the cosine transform, of the record or its beginning.
// O(variants * 2000).
void thin_out(std::vector<Candidate>& candidates, const Playback& playback,
              std::span<const double> weighted, std::span<const double> variances);

}  // namespace zerodrift::diagnosis
