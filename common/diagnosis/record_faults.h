// SPDX-License-Identifier: Apache-2.0
// Faults of the record itself, seen locally: spikes, clipped samples, lost samples. They are looked
// for before anything is fitted, so that nothing is fitted to them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"

namespace zerodrift::diagnosis {

struct RecordFaults {
  std::vector<NamedEffect> effects{};  // spikes, saturation, dropped_samples, rounding
  std::vector<std::uint8_t> sound{};   // 0: not valid, a spike, clipped, wild, or rounded
  std::size_t left_out = 0;            // wild samples, too few to be called spikes
  double rounding_rms_radps = 0.0;     // of errors by rounding that stay in what is sound
};

// Spikes: single samples more than 5 robust standard deviations off the median of 61 neighbours
// (Hampel) that stand apart from the others, at least two in the record; a single one is left out
// all the same. Noise with heavy tails has none: it thins out. Saturation: three or more samples in
// a row at exactly the largest or smallest value the axis ever has, where the readings pile up.
// Dropped: single samples missing at three places or more; a longer outage is a gap, not an effect.
// Rounding: see rounding.h. O(n log n).
[[nodiscard]] RecordFaults find_record_faults(const MeasuredSeries& series, core::Axis axis,
                                              std::span<const double> residual_radps);

}  // namespace zerodrift::diagnosis
