// SPDX-License-Identifier: Apache-2.0
#include "common/report/numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace zerodrift::report {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Numbers, AsTablesPrintThem) {
  EXPECT_EQ(significant(0.0217, 3), "0.0217");
  EXPECT_EQ(significant(9.33e-4, 3), "9.33e-4");
  EXPECT_EQ(scientific(0.0157, 3), "1.57e-2");
  EXPECT_EQ(significant(5.0, 3), "5.00");
  EXPECT_EQ(significant(-0.5, 2), "-0.50");
  EXPECT_EQ(significant(0.0, 3), "0.00");
  EXPECT_EQ(significant(1234.4, 3), "1234");
  EXPECT_EQ(significant(1.5e6, 3), "1.50e6");
}

TEST(Numbers, RoundingMayMoveThePoint) {
  EXPECT_EQ(significant(0.9996, 3), "1.00");
  EXPECT_EQ(significant(0.00099996, 3), "0.00100");
  EXPECT_EQ(significant(999999.6, 3), "1.00e6");
  EXPECT_EQ(scientific(9.996, 3), "1.00e1");
}

TEST(Numbers, WhatIsNoNumberSaysSo) {
  EXPECT_EQ(significant(std::nan(""), 3), "n/a");
  EXPECT_EQ(scientific(kInfinity, 3), "inf");
  EXPECT_EQ(significant(-kInfinity, 3), "-inf");
}

TEST(Numbers, ReadBackWithinHalfAUnitOfTheLastDigit) {
  constexpr std::uint64_t kSeed = 11;
  std::mt19937_64 random{kSeed};
  for (int i = 0; i < 20000; ++i) {
    const double exponent = static_cast<double>(random() % 600) - 300.0;
    const double value =
        (1.0 + static_cast<double>(random() >> 11U) * 0x1p-53) * std::pow(10.0, exponent);
    // Half a unit of the 4th digit, relative to the smallest mantissa; 1e-12 for the parsing.
    const double tolerance = value * (0.5e-3 + 1e-12);
    ASSERT_NEAR(std::stod(significant(value, 4)), value, tolerance) << "seed " << kSeed;
    ASSERT_NEAR(std::stod(scientific(value, 4)), value, tolerance) << "seed " << kSeed;
  }
}

}  // namespace
}  // namespace zerodrift::report
