// SPDX-License-Identifier: Apache-2.0
// How many samples a source lost, by the numbers of those that came. Any number may come.
#pragma once

#include <cstdint>
#include <limits>

namespace zerodrift::core {

// A source whose numbers jump further lost nothing: it counts on from elsewhere. 24 days at 2 kHz,
// and no outage is longer.
inline constexpr std::uint64_t kLongestLoss = std::uint64_t{1} << 32U;

constexpr bool is_new_count(std::uint64_t before, std::uint64_t next) noexcept {
  return next <= before || next - before > kLongestLoss;
}

// Numbers between the two; none where a new count begins.
constexpr std::uint64_t numbers_lost(std::uint64_t before, std::uint64_t next) noexcept {
  return is_new_count(before, next) ? 0 : next - before - 1;
}

constexpr std::uint64_t saturating_sum(std::uint64_t a, std::uint64_t b) noexcept {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  return b > kMost - a ? kMost : a + b;
}

}  // namespace zerodrift::core
