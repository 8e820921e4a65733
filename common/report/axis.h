// SPDX-License-Identifier: Apache-2.0
// The range of an axis and its ticks.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/report/chart.h"

namespace zerodrift::report {

// What is larger, or on a logarithmic axis smaller, can't be drawn: no difference, ratio or margin
// of such values may leave the range of a double.
inline constexpr double kLargestDrawn = 1e280;
inline constexpr double kSmallestDrawnOnLog = 1e-280;

[[nodiscard]] bool is_drawable(double value, AxisScale scale);

struct AxisRange {
  double low = 0.0;  // below `high`; > 0 on a logarithmic axis
  double high = 1.0;
  AxisScale scale = AxisScale::kLinear;

  // Place along the axis, 0 at `low` and 1 at `high`; `value` must be drawable.
  [[nodiscard]] double position(double value) const;
};

// Smallest range that holds all drawable values, widened by `margin` (up to 0.04) of its length at
// both ends. A range without length, or too short to be resolved in doubles, is widened around
// its middle; one without values is 0 to 1 (logarithmic: 0.1 to 10).
[[nodiscard]] AxisRange range_of(std::span<const double> values, AxisScale scale, double margin);

struct Tick {
  double at = 0.0;
  std::string label;  // empty: a minor tick
};

// Linear: steps of 1, 2 or 5 times a power of ten, about `wanted` of them. Logarithmic: decades
// with minor ticks at 2 to 9; labelled also at 2 and 5 below two decades; below a factor of two as
// a linear axis has them. Ascending, all within the range.
[[nodiscard]] std::vector<Tick> ticks(const AxisRange& range, int wanted);

}  // namespace zerodrift::report
