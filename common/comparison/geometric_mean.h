// SPDX-License-Identifier: Apache-2.0
// Mean of figures that differ by factors, with an interval.
#pragma once

#include <cstddef>
#include <limits>
#include <span>

namespace zerodrift::comparison {

// NaN: not known.
struct GeometricMean {
  double value = std::numeric_limits<double>::quiet_NaN();
  double lower = std::numeric_limits<double>::quiet_NaN();  // of 95 %, from two figures on
  double upper = std::numeric_limits<double>::quiet_NaN();
  std::size_t count = 0;
};

// Of those that are finite and above 0, taken for independent: exp(m ± t s / sqrt n) with mean m
// and standard deviation s of their logarithms and Student's t of n - 1 degrees of freedom.
[[nodiscard]] GeometricMean geometric_mean(std::span<const double> values);

}  // namespace zerodrift::comparison
