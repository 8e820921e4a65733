// SPDX-License-Identifier: Apache-2.0
// Where measurement and twin disagree: ranges of time and of every input, octaves of frequency and
// cluster times, each with a significance against the coloured noise.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/diagnosis/finding.h"
#include "common/diagnosis/generic_functions.h"

namespace zerodrift::diagnosis {

struct ResidualView {
  std::span<const double> residual_radps;  // measured minus twin; any value where not valid
  std::span<const std::uint8_t> valid;
  std::span<const double> dct_variances;  // of the noise
  double interval_s = 1.0;
};

// Series and ranges are bridged where samples are missing (GapBridge); the mean says nothing. An
// input has up to twelve ranges with about as many values in each, and one for each value that
// fills one by itself.
// Ranges whose corrected p-value is below `significance`, most significant first; neighbouring ones
// of one kind are joined. In a range of an input the statistic is the generalised least-squares
// level of the residual there, c'C^-1 r / sqrt(c'C^-1 c); in an octave the residual's power over
// the noise's. p-values are multiplied by the number of ranges looked at.
// O(channels * n log n).
[[nodiscard]] std::vector<Disagreement> locate(const ResidualView& view,
                                               const std::vector<InputChannel>& channels,
                                               double significance = 0.01);

// Cluster times at which the measured Allan deviation lies outside the twin's, judged by the
// degrees of freedom that white noise would have.
[[nodiscard]] std::vector<Disagreement> locate_cluster_times(const AllanCurves& curves,
                                                             double record_s,
                                                             double significance = 0.01);

}  // namespace zerodrift::diagnosis
