// SPDX-License-Identifier: Apache-2.0
#include "common/record/run_numbers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace zerodrift::record {
namespace {

core::AngularRateSample sample(std::uint64_t number, double time_s) {
  core::AngularRateSample made;
  made.sequence = number;
  made.time = core::from_seconds(time_s);
  return made;
}

TEST(RunNumbers, AreTheSamplesOwnInTheFirstRun) {
  RunNumbers numbers;
  for (const std::uint64_t own : {41U, 42U, 45U, 44U, 43U, 46U, 46U, 3000U, 3001U})
    EXPECT_EQ(numbers.number(sample(own, static_cast<double>(own))), own);
  EXPECT_EQ(numbers.later_runs(), 0U);
}

// Whatever runs a publisher had, with samples lost, late and twice among them: each keeps a number
// of its own, in the order that they were taken in.
TEST(RunNumbers, GoOnOverAnyRuns) {
  std::mt19937_64 random{3};
  for (int world = 0; world < 500; ++world) {
    RunNumbers numbers;
    double time_s = 1.0;
    const std::uint64_t runs = 1 + random() % 5;
    std::set<std::uint64_t> given;
    std::uint64_t highest_before = 0;
    for (std::uint64_t run = 0; run < runs; ++run) {
      const std::uint64_t first = random() % 2;
      const std::uint64_t length = 3 + random() % 500;
      std::vector<std::pair<std::uint64_t, double>> order;
      for (std::uint64_t k = 0; k < length; ++k) {
        time_s += 0.01;
        if (k > 0 && random() % 20 == 0) continue;  // lost
        order.emplace_back(first + k, time_s);
        if (order.size() > 3 && random() % 20 == 0)  // the one before comes late
          std::swap(order[order.size() - 1], order[order.size() - 2]);
      }
      std::uint64_t highest = highest_before;
      for (const auto& [own, at_s] : order) {
        const auto number = numbers.number(sample(own, at_s));
        ASSERT_TRUE(number.has_value()) << world;
        ASSERT_TRUE(given.insert(*number).second) << world << ": " << *number << " twice";
        ASSERT_TRUE(run == 0 || *number > highest_before) << world;
        ASSERT_EQ(numbers.number(sample(own, at_s)), number) << "a repeat is one";
        highest = std::max(highest, *number);
      }
      highest_before = highest;
      time_s += 5.0;
    }
    EXPECT_EQ(numbers.later_runs(), runs - 1) << world;
  }
}

// Late by a few, with a stamp of any kind: no run begins.
TEST(RunNumbers, AWrongStampBeginsNoRun) {
  for (const double wrong_s : {-1e6, 0.0, 1e6}) {
    RunNumbers numbers;
    for (std::uint64_t own = 0; own < 100; ++own)
      (void)numbers.number(sample(own, static_cast<double>(own)));
    EXPECT_EQ(numbers.number(sample(100, wrong_s)), 100U);
    EXPECT_EQ(numbers.number(sample(98, 98.0)), 98U);
    EXPECT_EQ(numbers.number(sample(97, wrong_s + 1.0)), 97U);
    EXPECT_EQ(numbers.number(sample(101, 101.0)), 101U);
    EXPECT_EQ(numbers.later_runs(), 0U);
  }
}

// Before: where the clock of the second one was behind, its samples were taken for late ones, and
// dropped.
TEST(RunNumbers, OfTwoPublishersAtOnceThereAreNone) {
  for (const double apart_s : {-1e6, -10.0, -0.01, 0.0, 0.01, 10.0, 1e6}) {
    for (const std::uint64_t first : {0U, 1U, 500U}) {
      SCOPED_TRACE(std::to_string(apart_s) + " s, from " + std::to_string(first));
      RunNumbers numbers;
      for (std::uint64_t own = 0; own < 1000; ++own)
        (void)numbers.number(sample(own, 0.01 * static_cast<double>(own)));
      std::optional<std::uint64_t> number = 0;
      for (std::uint64_t k = 0; k < 10 && number; ++k) {
        const double time_s = 10.0 + 0.02 * static_cast<double>(k);
        number = numbers.number(sample(first + k, time_s + apart_s));
        if (number) number = numbers.number(sample(1000 + k, time_s + 0.01));
      }
      EXPECT_FALSE(number.has_value());
    }
  }
}

// A publisher that is started again, after its clock was set back, is one after the other.
TEST(RunNumbers, GoOnWhereTheClockWasSetBackBetweenTwoRuns) {
  RunNumbers numbers;
  std::uint64_t expected = 0;
  for (const double from_s : {1000.0, 0.0, 500.0}) {
    for (std::uint64_t own = 0; own < 200; ++own)
      EXPECT_EQ(numbers.number(sample(own, from_s + static_cast<double>(own))), expected++);
  }
  EXPECT_EQ(numbers.later_runs(), 2U);
}

}  // namespace
}  // namespace zerodrift::record
