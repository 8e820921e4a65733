// SPDX-License-Identifier: Apache-2.0
#include "common/core/sequence_gap.h"

#include <gtest/gtest.h>

namespace zerodrift::core {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();

TEST(SequenceGap, NumbersBetweenTwoAreLost) {
  EXPECT_EQ(numbers_lost(5, 6), 0U);
  EXPECT_EQ(numbers_lost(5, 9), 3U);
  EXPECT_EQ(numbers_lost(5, 5 + kLongestLoss), kLongestLoss - 1);
}

TEST(SequenceGapAbuse, NothingIsLostWhereANewCountBegins) {
  EXPECT_EQ(numbers_lost(5, 5), 0U);
  EXPECT_EQ(numbers_lost(5, 4), 0U);
  EXPECT_EQ(numbers_lost(5, 6 + kLongestLoss), 0U);
  EXPECT_EQ(numbers_lost(0, kMost), 0U);
  EXPECT_EQ(numbers_lost(kMost, 0), 0U);
}

TEST(SequenceGapAbuse, SumsSaturate) {
  EXPECT_EQ(saturating_sum(2, 3), 5U);
  EXPECT_EQ(saturating_sum(kMost - 1, 1), kMost);
  EXPECT_EQ(saturating_sum(kMost, 1), kMost);
  EXPECT_EQ(saturating_sum(1, kMost), kMost);
}

}  // namespace
}  // namespace zerodrift::core
