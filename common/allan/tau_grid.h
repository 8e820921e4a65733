// SPDX-License-Identifier: Apache-2.0
// Cluster sizes m = tau / tau0 at which deviations are taken, and how the streaming cascade reaches
// each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace zerodrift::allan {

enum class TauGrid : std::uint8_t {
  kOctave,         // 1, 2, 4, 8, then 16 * 2^level
  kQuarterOctave,  // 1..8, 10, 11, 13, then {16, 19, 23, 27} * 2^level
};

// m = lag << level: angles kept at a stride of 2^level samples, differenced at `lag` strides.
struct Cluster {
  std::uint32_t level = 0;
  std::uint32_t lag = 1;

  [[nodiscard]] constexpr std::uint64_t size() const noexcept {
    return std::uint64_t{lag} << level;
  }
};

// Every cluster of the grid with size() <= largest, in ascending order. Empty when largest is 0.
[[nodiscard]] std::vector<Cluster> clusters(TauGrid grid, std::uint64_t largest);

}  // namespace zerodrift::allan
