// SPDX-License-Identifier: Apache-2.0
// Where a series steps once and stays: the few places that are worth an exact evaluation, since a
// coarse grid would step over a sharp one.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace zerodrift::diagnosis {

struct StepPlaces {
  std::vector<std::size_t> first_after{};  // index of the first value after each, likeliest first
  double looked_at = 1.0;                  // places that can be told apart
};

// Largest local maxima of (s' C^-1 r)² / (s' C^-1 s) over steps s, both about their mean, of a
// residual r with noise covariance C. Two are at least a fiftieth of the series apart and none
// nearer to an end. `weighted`: C^-1 r; `variances`: eigenvalues of C in the cosine transform of
// the same length, of which the first is not read. None of a series without noise or shorter than
// 100 values. O(n log n).
[[nodiscard]] StepPlaces step_places(std::span<const double> weighted,
                                     std::span<const double> variances, std::size_t most);

}  // namespace zerodrift::diagnosis
