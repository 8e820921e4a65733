// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/oscillation_scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
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

// Whatever its frequency is to the steps: a scan that fell by half between two of them would rank
// by chance.
TEST(OscillationScanLaws, ASignalBetweenTwoStepsCountsNearlyAsMuch) {
  constexpr int kSeeds = 20;
  for (const std::size_t size : {10'000U, 8192U, 6007U}) {
    std::vector<double> phase(size);
    std::iota(phase.begin(), phase.end(), 0.0);
    const double cell = 1.0 / static_cast<double>(size - 1);
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (int eighth = 0; eighth < 8; ++eighth) {
      const double frequency = (321.0 + eighth / 8.0) * cell;
      double mean = 0.0;
      for (int seed = 0; seed < kSeeds; ++seed) {
        auto series = white(size, 100 + static_cast<std::uint64_t>(seed));
        for (std::size_t i = 0; i < size; ++i)
          series[i] += 0.3 * std::cos(kTurn * frequency * phase[i] + seed);
        const auto peaks = oscillation_peaks(series, phase, {.highest_frequency = 0.25});
        ASSERT_FALSE(peaks.frequencies.empty());
        EXPECT_NEAR(peaks.frequencies.front(), frequency, 0.6 * cell) << size << ' ' << eighth;
        mean += peaks.ratios.front() / kSeeds;
      }
      least = std::min(least, mean);
      most = std::max(most, mean);
    }
    // sinc²(1/4) = .81 in the middle of two steps, sinc²(1/2) = .41 if they were twice as wide;
    // means are good to 3 %.
    EXPECT_GT(least, 0.65 * most) << size;
  }
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

TEST(OscillationScanScenario, FindsWhenTheUpperLevelOfACycleBeginsAndEnds) {
  constexpr std::size_t kSize = 18'000;
  constexpr double kHz = 1.0 / 903.0;
  std::vector<double> time_s(kSize);
  std::iota(time_s.begin(), time_s.end(), 0.5);
  for (const double duty : {0.2, 0.45, 0.7}) {
    auto series = white(kSize, 5);
    for (std::size_t i = 0; i < kSize; ++i) {
      const double turns = kHz * time_s[i] + 0.3;
      series[i] += turns - std::floor(turns) < duty ? 1.0 : 0.0;
    }
    const std::vector<double> looked_at{kHz + 0.4 / kSize};  // between two steps of a scan
    const auto cycles = cycles_at(looked_at, series, time_s);
    ASSERT_FALSE(cycles.empty());
    EXPECT_NEAR(cycles[0].frequency_hz, kHz, 1.0 / 32.0 / kSize);
    // Of the lower level where that is the shorter one; a part of a period is 1/96.
    EXPECT_NEAR(cycles[0].duty, std::min(duty, 1.0 - duty), 0.02);
    const double begins = duty <= 0.5 ? 0.3 : 0.3 - duty;
    EXPECT_NEAR(std::remainder(cycles[0].phase_turns - begins, 1.0), 0.0, 0.05);
  }
}

TEST(OscillationScanScenario, FindsResetsThatShowOnlyWhileTheGyroTurnsSlowly) {
  constexpr std::size_t kSize = 18'000;
  constexpr double kPeriod = 137.0;
  auto series = white(kSize, 3);
  std::mt19937_64 random(4);
  std::vector<double> middle(kSize), turn(kSize);
  double angle = 0.0;
  double rate = 0.0;
  for (std::size_t i = 0; i < kSize; ++i) {
    if (i % 200 == 0) {  // at rest, slow or fast, as on a rate table
      const double sign = random() % 2 == 0 ? 1.0 : -1.0;
      const double kind = static_cast<double>(random() % 3);
      rate = sign * kind * (kind < 1.5 ? 1.0 + static_cast<double>(random() % 40) : 5000.0);
    }
    turn[i] = rate;
    middle[i] = angle + 0.5 * rate;
    angle += rate;
    const double half = std::numbers::pi * rate / kPeriod;
    const double kept = half == 0.0 ? 1.0 : std::sin(half) / half;
    // A third of the record shows it: d = .25 sqrt(3000) = 14.
    series[i] += 0.25 * kept * std::sin(kTurn * middle[i] / kPeriod);
  }
  const auto peaks = angle_peaks(series, middle, turn, 6);
  ASSERT_FALSE(peaks.frequencies.empty());
  const auto ends = std::minmax_element(middle.begin(), middle.end());
  const double range = *ends.second - *ends.first;
  // What short stretches tell is a bundle of peaks; one of the strongest is within a cell of
  // resolution.
  const bool found = std::any_of(peaks.frequencies.begin(), peaks.frequencies.end(), [&](double f) {
    return std::abs(f - 1.0 / kPeriod) < 1.0 / range;
  });
  EXPECT_TRUE(found) << peaks.frequencies.front();
  // Nothing of it without the effect: exponential, the largest of some 1e6 over the median is 20.
  const auto none = angle_peaks(white(kSize, 5), middle, turn, 6);
  EXPECT_LT(none.ratios.front(), 26.0);
  EXPECT_GT(peaks.ratios.front(), 26.0);
}

TEST(OscillationScanAbuse, NothingToScanGivesNoPeak) {
  const std::vector<double> constant(100, 1.0);
  EXPECT_TRUE(oscillation_peaks(constant, constant, {}).frequencies.empty());
  EXPECT_TRUE(oscillation_peaks({}, {}, {}).frequencies.empty());
  EXPECT_TRUE(angle_peaks({}, {}, {}, 3).frequencies.empty());
  EXPECT_TRUE(
      angle_peaks(constant, constant, std::vector<double>(100, 0.0), 3).frequencies.empty());
  EXPECT_TRUE(line_peaks(std::vector<double>(4, 1.0), 1.0, 3).frequencies.empty());
  EXPECT_TRUE(line_peaks(std::vector<double>(100, 0.0), 1.0, 3).frequencies.empty());
  std::vector<double> time_s(100);
  std::iota(time_s.begin(), time_s.end(), 0.0);
  const std::vector<double> fast{0.07, 0.5, std::numeric_limits<double>::quiet_NaN()};
  const std::vector<double> slow{0.05};
  EXPECT_TRUE(cycles_at(fast, constant, time_s).empty());
  EXPECT_TRUE(cycles_at(slow, {}, {}).empty());
  const std::vector<double> unknown(100, std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(cycles_at(slow, unknown, time_s).empty());
}

}  // namespace
}  // namespace zerodrift::diagnosis
