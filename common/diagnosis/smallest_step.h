// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace zerodrift::diagnosis {

// Smallest difference between two neighbouring readings that differ by more than rounding; 0 where
// none do.
[[nodiscard]] inline double smallest_step(std::span<const double> readings,
                                          std::span<const std::uint8_t> valid) {
  constexpr double kRounding = 1e-12;
  double step = 0.0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const double difference = std::abs(readings[i] - readings[i - 1]);
    if (valid[i] == 0 || valid[i - 1] == 0) continue;
    if (difference <= kRounding * std::abs(readings[i])) continue;
    step = step == 0.0 ? difference : std::min(step, difference);
  }
  return step;
}

}  // namespace zerodrift::diagnosis
