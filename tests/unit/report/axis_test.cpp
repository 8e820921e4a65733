// SPDX-License-Identifier: Apache-2.0
#include "common/report/axis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace zerodrift::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string labels(const AxisRange& range, int wanted) {
  std::string text;
  for (const Tick& tick : ticks(range, wanted)) {
    if (tick.label.empty()) continue;
    if (!text.empty()) text += ' ';
    text += tick.label;
  }
  return text;
}

TEST(AxisTicks, GoldenLabels) {
  EXPECT_EQ(labels({0.0, 5.0}, 8), "0.0 0.5 1.0 1.5 2.0 2.5 3.0 3.5 4.0 4.5 5.0");
  EXPECT_EQ(labels({-0.31, 0.74}, 6), "-0.2 0.0 0.2 0.4 0.6");
  EXPECT_EQ(labels({0.0, 18000.0}, 8), "0 2000 4000 6000 8000 10000 12000 14000 16000 18000");
  EXPECT_EQ(labels({0.0, 4e7}, 4), "0 1e7 2e7 3e7 4e7");
  EXPECT_EQ(labels({1e-9, 3.1e-9}, 4), "1.0e-9 1.5e-9 2.0e-9 2.5e-9 3.0e-9");
  EXPECT_EQ(labels({0.005, 2620.0, AxisScale::kLogarithmic}, 8), "0.01 0.1 1 10 100 1000");
  EXPECT_EQ(labels({0.005, 3e5, AxisScale::kLogarithmic}, 8), "10⁻² 10⁻¹ 10⁰ 10¹ 10² 10³ 10⁴ 10⁵");
  EXPECT_EQ(labels({0.8, 30.0, AxisScale::kLogarithmic}, 8), "1 2 5 10 20");
  EXPECT_EQ(labels({3.0, 4.0, AxisScale::kLogarithmic}, 4), "3.0 3.2 3.4 3.6 3.8 4.0");
}

TEST(AxisTicks, AreWithinTheRangeAscendingAndLabelledTruly) {
  constexpr std::uint64_t kSeed = 2;
  std::mt19937_64 random{kSeed};
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  for (int i = 0; i < 5000; ++i) {
    const double low = (uniform() - 0.5) * std::pow(10.0, 20.0 * uniform() - 10.0);
    const double length = std::pow(10.0, 20.0 * uniform() - 10.0);
    const std::vector<double> ends{low, low + length};
    const AxisRange range = range_of(ends, AxisScale::kLinear, 0.0);
    const std::vector<Tick> found = ticks(range, 6);
    // Steps are at most 2 times what is wanted: 1, 2 or 5 next to 1 to 10 in the logarithm.
    ASSERT_GE(found.size(), 3U) << range.low << ' ' << range.high << " seed " << kSeed;
    ASSERT_LE(found.size(), 13U);
    for (std::size_t k = 0; k < found.size(); ++k) {
      ASSERT_GE(found[k].at, range.low);
      ASSERT_LE(found[k].at, range.high);
      if (k > 0) {
        ASSERT_GT(found[k].at, found[k - 1].at);
      }
      // A label is exact but for the tick's own rounding; 1e-6 steps were allowed at the ends.
      ASSERT_NEAR(std::stod(found[k].label), found[k].at, 2e-6 * (range.high - range.low))
          << found[k].label;
    }
  }
}

TEST(AxisRanges, HoldAllThatCanBeDrawnAndNothingElse) {
  const std::vector<double> values{kNan, 3.0, kInfinity, -1.0, -kInfinity, 1e285};
  const AxisRange linear = range_of(values, AxisScale::kLinear, 0.0);
  EXPECT_EQ(linear.low, -1.0);
  EXPECT_EQ(linear.high, 3.0);
  EXPECT_EQ(range_of(values, AxisScale::kLogarithmic, 0.0).scale, AxisScale::kLogarithmic);
  const AxisRange widened = range_of(values, AxisScale::kLinear, 0.03125);
  EXPECT_EQ(widened.low, -1.125);
  EXPECT_EQ(widened.high, 3.125);
}

TEST(AxisRanges, AlwaysHaveALength) {
  for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLogarithmic}) {
    for (const std::vector<double>& values : {std::vector<double>{},
                                              {kNan},
                                              {0.0},
                                              {-5.0},
                                              {7.0, 7.0},
                                              {1e280, -1e280},
                                              {1e-280},
                                              {1e280},
                                              {1e9, 1e9 + 1e-6}}) {
      const AxisRange range = range_of(values, scale, 0.04);
      EXPECT_LT(range.low, range.high);
      EXPECT_TRUE(std::isfinite(range.high - range.low));
      EXPECT_FALSE(ticks(range, 6).empty());
      EXPECT_TRUE(scale == AxisScale::kLinear || range.low > 0.0);
    }
  }
}

TEST(AxisRanges, EndsAreAtZeroAndOne) {
  const AxisRange range{0.01, 100.0, AxisScale::kLogarithmic};
  EXPECT_NEAR(range.position(0.01), 0.0, 1e-15);  // rounding of log10
  EXPECT_NEAR(range.position(1.0), 0.5, 1e-15);
  EXPECT_NEAR(range.position(100.0), 1.0, 1e-15);
}

}  // namespace
}  // namespace zerodrift::report
