// SPDX-License-Identifier: Apache-2.0
#include "common/comparison/geometric_mean.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace zerodrift::comparison {
namespace {

// Rule: by hand: logarithms 0, 1, 2 have mean 1 and standard deviation 1; Student's t of two
// degrees of freedom at 97.5 % is 4.302653 (Abramowitz and Stegun, table 26.10).
TEST(GeometricMean, OfThreeFiguresIsAsByHand) {
  const std::array values{1.0, std::exp(1.0), std::exp(2.0)};
  const GeometricMean mean = geometric_mean(values);
  EXPECT_EQ(mean.count, 3U);
  EXPECT_NEAR(std::log(mean.value), 1.0, 1e-12);
  EXPECT_NEAR(std::log(mean.lower), 1.0 - 4.302653 / std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(std::log(mean.upper), 1.0 + 4.302653 / std::sqrt(3.0), 1e-6);
}

TEST(GeometricMean, WhatIsNoFigureIsLeftOutAndOneAloneHasNoInterval) {
  const std::array values{2.0, 0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                          std::numeric_limits<double>::infinity()};
  const GeometricMean mean = geometric_mean(values);
  EXPECT_EQ(mean.count, 1U);
  EXPECT_DOUBLE_EQ(mean.value, 2.0);
  EXPECT_TRUE(std::isnan(mean.lower) && std::isnan(mean.upper));
  EXPECT_TRUE(std::isnan(geometric_mean({}).value));
}

// Rule: the interval holds the truth in 95 % of all cases; 4 sigma of 2000 trials is 1.95 %.
TEST(GeometricMean, TheIntervalHoldsAsOftenAsItSays) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal(0.3, 0.7);
  int held = 0;
  constexpr int kTrials = 2000;
  for (int k = 0; k < kTrials; ++k) {
    std::vector<double> values(6);
    for (double& value : values) value = std::exp(normal(random));
    const GeometricMean mean = geometric_mean(values);
    held += mean.lower <= std::exp(0.3) && std::exp(0.3) <= mean.upper ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(held) / kTrials, 0.95, 0.0195);
}

}  // namespace
}  // namespace zerodrift::comparison
