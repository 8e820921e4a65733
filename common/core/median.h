// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace zerodrift::core {

// Median of |x| of a normal x with a standard deviation of 1.
inline constexpr double kMedianOfNormal = 0.6745;

// The upper one of an even number, 0 of none. O(values).
[[nodiscard]] inline double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace zerodrift::core
