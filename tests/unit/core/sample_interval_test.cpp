// SPDX-License-Identifier: Apache-2.0
#include "common/core/sample_interval.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace zerodrift::core {
namespace {

std::vector<double> intervals_of(const std::vector<double>& steps_s, double usual_s = 0.0) {
  SampleInterval interval(usual_s);
  std::vector<double> intervals_s;
  for (const double step_s : steps_s) intervals_s.push_back(interval.after(step_s));
  return intervals_s;
}

// Rule: a gap is no part of what the sample behind it measured, whatever its length.
TEST(SampleInterval, LeavesAGapOut) {
  for (const double gap_s : {0.04, 0.25, 8.0, 1e6}) {
    EXPECT_EQ(intervals_of({0.02, 0.02, gap_s, 0.02}), (std::vector<double>(4, 0.02))) << gap_s;
    EXPECT_EQ(intervals_of({gap_s, 0.02}, 0.02), (std::vector<double>(2, 0.02))) << gap_s;
  }
}

// Rule: steps that stay longer are another rate; shorter ones are what they are.
TEST(SampleInterval, FollowsAnotherRate) {
  EXPECT_EQ(intervals_of({0.01, 0.1, 0.1, 0.1, 0.1, 0.1}),
            (std::vector<double>{0.01, 0.01, 0.01, 0.01, 0.1, 0.1}));
  EXPECT_EQ(intervals_of({0.1, 0.01, 0.01}), (std::vector<double>{0.1, 0.01, 0.01}));
}

// Law: with stamps that jitter no time is lost, and none is counted twice.
TEST(SampleInterval, OfStampsThatJitterIsTheStep) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> step_s(0.017, 0.023);
  std::vector<double> steps_s(2000);
  for (double& one : steps_s) one = step_s(random);
  EXPECT_EQ(intervals_of(steps_s), steps_s);
}

}  // namespace
}  // namespace zerodrift::core
