// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/oscillation_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace zerodrift::diagnosis {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

std::vector<double> white(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values(n);
  for (double& value : values) value = normal(random);
  return values;
}

TEST(OscillationScanScenario, FindsFringesAlongATemperatureThatGoesUpAndDown) {
  constexpr std::size_t kSize = 9000;
  auto series = white(kSize, 1);
  std::vector<double> temperature(kSize);
  for (std::size_t i = 0; i < kSize; ++i) {
    const double x = static_cast<double>(i) / kSize;
    temperature[i] = -20.0 + 80.0 * (x < 0.5 ? 2.0 * x : 2.0 - 2.0 * x);
    series[i] += 0.2 * std::sin(kTurn * temperature[i] / 3.7 + 1.0);  // d = .2 sqrt(4500) = 13
  }
  const auto peaks = oscillation_peaks(series, temperature, {.highest_frequency = 2.0});
  ASSERT_FALSE(peaks.frequencies.empty());
  // A step is 1 / (4 * 80) of a cycle a degree.
  EXPECT_NEAR(peaks.frequencies.front(), 1.0 / 3.7, 1.0 / 320.0);
}

TEST(OscillationScanScenario, FindsALineInTime) {
  constexpr std::size_t kSize = 10'000;
  auto series = white(kSize, 2);
  for (std::size_t i = 0; i < kSize; ++i)
    series[i] += 0.2 * std::cos(kTurn * 0.12345 * static_cast<double>(i));
  const auto peaks = line_peaks(series, 1.0, 3);
  ASSERT_EQ(peaks.frequencies.size(), 3U);
  EXPECT_NEAR(peaks.frequencies.front(), 0.12345, 1.0 / 32'768.0);
  EXPECT_EQ(peaks.looked_at, 5000.0);
}

TEST(OscillationScanAbuse, NothingToScanGivesNoPeak) {
  const std::vector<double> constant(100, 1.0);
  EXPECT_TRUE(oscillation_peaks(constant, constant, {}).frequencies.empty());
  EXPECT_TRUE(oscillation_peaks({}, {}, {}).frequencies.empty());
  EXPECT_TRUE(line_peaks(std::vector<double>(4, 1.0), 1.0, 3).frequencies.empty());
  EXPECT_TRUE(line_peaks(std::vector<double>(100, 0.0), 1.0, 3).frequencies.empty());
}

}  // namespace
}  // namespace zerodrift::diagnosis
