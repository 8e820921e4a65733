// SPDX-License-Identifier: Apache-2.0
#include "common/core/first_come.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

namespace zerodrift::core {
namespace {

using Filter = FirstCome<int>;
constexpr std::uint64_t kSpan = Filter::kSpan;

TEST(FirstCome, TakesASampleOnceWhoeverWritesItAgain) {
  Filter filter;
  EXPECT_TRUE(filter.takes(1, 7, 1));
  EXPECT_FALSE(filter.takes(1, 7, 2));
  EXPECT_TRUE(filter.takes(1, 8, 2));
  EXPECT_FALSE(filter.takes(1, 8, 1));
  EXPECT_FALSE(filter.takes(1, 8, 1)) << "the same writer, again";
}

// Rule: runs are told apart by their id and nothing else, however short, long or alike they are.
TEST(FirstCome, TakesARunThatIsRepeatedToTheBit) {
  for (const std::uint64_t length : {1U, 10U, 2000U, 5000U, 20000U}) {
    for (const std::uint64_t next : {length, length / 2, 2 * length}) {
      const auto filter = std::make_unique<Filter>();
      for (std::uint64_t run = 1; run <= 3; ++run) {
        for (std::uint64_t k = 1; k <= (run == 2 ? next : length); ++k) {
          ASSERT_TRUE(filter->takes(run, k, 1)) << run << ' ' << k;
          ASSERT_FALSE(filter->takes(run, k, 2)) << run << ' ' << k;
        }
      }
    }
  }
}

// Rule: the one that is late with a whole run has it dropped, though the next run has begun.
TEST(FirstCome, DropsTheRunBeforeOfAWriterThatIsLate) {
  Filter filter;
  for (std::uint64_t k = 1; k <= 100; ++k) filter.takes(1, k, 1);
  for (std::uint64_t k = 1; k <= 100; ++k) filter.takes(2, k, 1);
  for (std::uint64_t k = 1; k <= 100; ++k) EXPECT_FALSE(filter.takes(1, k, 2)) << k;
  EXPECT_FALSE(filter.takes(2, 100, 2));
  EXPECT_TRUE(filter.takes(2, 101, 2));
}

// Rule: a writer that was stopped for longer than the filter remembers repeats nothing.
TEST(FirstCome, DropsWhatAWriterRepeatsFromLongAgo) {
  Filter filter;
  for (std::uint64_t k = 1; k <= 10; ++k) {
    filter.takes(1, k, 1);
    filter.takes(1, k, 2);
  }
  for (std::uint64_t k = 11; k <= 20 * kSpan; ++k) ASSERT_TRUE(filter.takes(1, k, 1));
  for (std::uint64_t k = 11; k <= 3 * kSpan; ++k) ASSERT_FALSE(filter.takes(1, k, 2)) << k;
  EXPECT_FALSE(filter.takes(1, 5 * kSpan, 3)) << "nor does one that was never heard";
  EXPECT_TRUE(filter.takes(1, 20 * kSpan + 1, 2)) << "it has caught up";
}

// Rule: one wild number costs no other sample, and is itself taken once.
TEST(FirstCome, TakesAWildNumberOnceAndGoesOn) {
  for (const std::uint64_t wild : {std::uint64_t{1} << 40U, ~std::uint64_t{0}, std::uint64_t{0}}) {
    SCOPED_TRACE(wild);
    Filter filter;
    constexpr std::uint64_t kBase = 100000;
    for (const int writer : {1, 2}) EXPECT_EQ(filter.takes(1, kBase, writer), writer == 1);
    for (const int writer : {1, 2}) EXPECT_EQ(filter.takes(1, wild, writer), writer == 1);
    for (const int writer : {1, 2}) EXPECT_EQ(filter.takes(1, kBase + 1, writer), writer == 1);
    for (const int writer : {2, 1}) EXPECT_EQ(filter.takes(1, kBase + 2, writer), writer == 2);
    const std::uint64_t after_a_gap = kBase + 3 * kSpan;
    for (const int writer : {1, 2}) EXPECT_EQ(filter.takes(1, after_a_gap, writer), writer == 1);
  }
}

// Rule: the numbers of a run go back where its source's do, and stay there.
TEST(FirstCome, FollowsASourceWhoseNumbersBeginAnew) {
  Filter filter;
  for (std::uint64_t k = 1; k <= 3 * kSpan; ++k) filter.takes(1, k, 1);
  for (std::uint64_t k = 1; k <= 3 * kSpan; ++k) ASSERT_TRUE(filter.takes(1, k, 1)) << k;
}

// Rule: a reader's stream begins with the first sample that it takes; a slower writer's earlier
// ones are not put behind it.
TEST(FirstCome, BeginsWithTheFirstSampleTaken) {
  Filter filter;
  EXPECT_TRUE(filter.takes(1, 100, 1));
  EXPECT_FALSE(filter.takes(1, 98, 2));
  EXPECT_FALSE(filter.takes(1, 99, 2));
  EXPECT_FALSE(filter.takes(1, 100, 2));
  EXPECT_TRUE(filter.takes(1, 101, 2));
  EXPECT_TRUE(filter.takes(1, 97, 1, false)) << "its source sent it after 100";
  EXPECT_TRUE(filter.takes(1, 96, 2, false));
  EXPECT_FALSE(filter.takes(1, 96, 1, false));
}

// Rule: samples of a gap that one writer has and the other lacks are taken, late, once.
TEST(FirstCome, TakesWhatOneWriterLacksFromTheOther) {
  Filter filter;
  EXPECT_TRUE(filter.takes(1, 1, 1));
  EXPECT_FALSE(filter.takes(1, 1, 2));
  for (const std::uint64_t gap : {3U, 10000U}) {
    const std::uint64_t before = gap == 3 ? 1 : 5;
    EXPECT_TRUE(filter.takes(1, before + gap + 1, 1));
    for (std::uint64_t k = before + 1; k <= before + gap; ++k)
      ASSERT_TRUE(filter.takes(1, k, 2)) << k;
    EXPECT_FALSE(filter.takes(1, before + gap + 1, 2));
  }
}

// Rule: whatever the pace of each of three writers, each sample is taken once and in order. 5
// seeds.
TEST(FirstCome, TakesEachOnceAndInOrderFromWritersOfAnyPace) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Filter filter;
    constexpr std::uint64_t kSamples = 30000;
    std::vector<std::uint64_t> next(3, 1);
    std::uint64_t newest = 0;
    while (newest < kSamples) {
      const auto writer = static_cast<std::size_t>(random() % 3);
      for (auto burst = random() % 200; burst > 0; --burst) {
        const std::uint64_t sequence = next[writer]++;
        if (!filter.takes(1, sequence, static_cast<int>(writer))) continue;
        ASSERT_EQ(sequence, newest + 1);
        newest = sequence;
      }
    }
  }
}

}  // namespace
}  // namespace zerodrift::core
