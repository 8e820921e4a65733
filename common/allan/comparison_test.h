// SPDX-License-Identifier: Apache-2.0
// Is one stream noisier than another at this tau? For "the compensated output is no worse than the
// raw one" and "this hour is worse than the last".
#pragma once

#include "common/allan/allan_point.h"

namespace zerodrift::allan {

// One-sided p-value of the hypothesis that the true variance behind `first` is not larger than the
// one behind `second`: the chance that two estimates of one and the same variance would show this
// ratio or a larger one. Small (below 0.01, say) = `first` is significantly larger. Variance ratio
// test: s1²/s2² ~ F(edf1, edf2), P(F > f) = I_x(edf2/2, edf1/2) with x = edf2 / (edf2 + edf1 f)
// (NIST/SEMATECH e-Handbook 1.3.5.9; DLMF 8.17). 1 where either point says nothing (no degrees of
// freedom, a deviation that is no number), and where both are 0; 0 where only `second` is 0.
//
// Which way it errs: the F distribution holds for independent estimates. A raw and a compensated
// stream share their white noise, their estimates move together, the ratio scatters less than F
// says: the test then cries out *less* often than its level and finds a real increase a little
// later - it errs on the quiet side. Two streams of one tau that were compared every minute are
// many looks at the same data: ask for a smaller p, or for persistence over a window.
//
// O(sqrt(edf)), at most some 10 µs; no allocation.
[[nodiscard]] double larger_variance_p_value(const AllanPoint& first,
                                             const AllanPoint& second) noexcept;

}  // namespace zerodrift::allan
