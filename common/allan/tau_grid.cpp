// SPDX-License-Identifier: Apache-2.0
#include "common/allan/tau_grid.h"

#include <span>

namespace zerodrift::allan {
namespace {

constexpr std::uint32_t kMaxLevel = 58;  // 27 << 58 still fits 64 bits

std::vector<Cluster> clusters(std::span<const std::uint32_t> small,
                              std::span<const std::uint32_t> octave, std::uint64_t largest) {
  std::vector<Cluster> result;
  const auto append = [&](std::uint32_t level, std::span<const std::uint32_t> lags) {
    for (const std::uint32_t lag : lags) {
      const Cluster cluster{level, lag};
      if (cluster.size() <= largest) result.push_back(cluster);
    }
  };
  append(0, small);
  for (std::uint32_t level = 0; level <= kMaxLevel; ++level) append(level, octave);
  return result;
}

}  // namespace

std::vector<Cluster> clusters(TauGrid grid, std::uint64_t largest) {
  static constexpr std::uint32_t kOctaveSmall[] = {1, 2, 4, 8};
  static constexpr std::uint32_t kOctave[] = {16};
  static constexpr std::uint32_t kQuarterSmall[] = {1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 13};
  static constexpr std::uint32_t kQuarter[] = {16, 19, 23, 27};
  return grid == TauGrid::kOctave ? clusters(kOctaveSmall, kOctave, largest)
                                  : clusters(kQuarterSmall, kQuarter, largest);
}

}  // namespace zerodrift::allan
