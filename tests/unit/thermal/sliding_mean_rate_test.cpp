// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/sliding_mean_rate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/support/wrong_key.h"

namespace zerodrift::thermal {
namespace {

using core::from_seconds;

std::vector<double> noisy_temperatures(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.05);
  std::vector<double> temperatures(n);
  for (std::size_t i = 0; i < n; ++i) {
    temperatures[i] = -15.0 + 60.0 * std::sin(1e-4 * static_cast<double>(i)) + noise(random);
  }
  return temperatures;
}

double mean(const std::vector<double>& values, std::size_t first, std::size_t n) {
  long double sum = 0.0L;
  for (std::size_t i = first; i < first + n; ++i) sum += static_cast<long double>(values[i]);
  return static_cast<double>(sum / static_cast<long double>(n));
}

struct Stream {
  std::size_t window_samples;
  double rate_hz;
  std::size_t check_every;
};

class SlidingMeanGolden : public ::testing::TestWithParam<Stream> {};

TEST_P(SlidingMeanGolden, EqualsTheDifferenceOfTwoMeansOfEquation12) {
  constexpr std::uint64_t kSeed = 12;
  SCOPED_TRACE(kSeed);
  const auto [k, f, check_every] = GetParam();
  const auto temperatures = noisy_temperatures(3 * k + 5, kSeed);
  SlidingMeanRate rate({.window_samples = k, .sample_rate_hz = f, .max_gap_s = 10.0});
  for (std::size_t n = 0; n < temperatures.size(); ++n) {
    rate.add(from_seconds(static_cast<double>(n) / f), temperatures[n]);
    ASSERT_EQ(rate.rate_degc_per_s().has_value(), n >= k) << n;
    if (n < k || n % check_every != 0) continue;
    const double literal = (mean(temperatures, n - k + 1, k) - mean(temperatures, n - k, k)) * f;
    // Each mean of temperatures below 64 °C is rounded to double, 64 * 2^-53 = 7e-15; their
    // difference is multiplied by f.
    ASSERT_NEAR(*rate.rate_degc_per_s(), literal, 2.0 * 7.2e-15 * f);
  }
}

INSTANTIATE_TEST_SUITE_P(Streams, SlidingMeanGolden,
                         ::testing::Values(Stream{12000, 200.0, 997}, Stream{600, 10.0, 1},
                                           Stream{60, 1.0, 1}, Stream{1, 1.0, 1}));

TEST(SlidingMeanLaws, OnAParabolaItReadsTheRateHalfAWindowAgo) {
  for (const SlidingMeanRateOptions& options :
       {SlidingMeanRateOptions{},
        SlidingMeanRateOptions{.window_samples = 600, .sample_rate_hz = 10.0, .max_gap_s = 10.0}}) {
    SlidingMeanRate rate(options);
    const double f = options.sample_rate_hz;
    const double curvature = 1e-4;  // °C/s²
    const auto k = static_cast<double>(options.window_samples);
    for (double i = 0.0; i <= 2.0 * k; i += 1.0) {
      rate.add(from_seconds(i / f), 20.0 + 0.5 * curvature * (i / f) * (i / f));
    }
    EXPECT_DOUBLE_EQ(rate.lag_s(), k / 2.0 / f);
    EXPECT_DOUBLE_EQ(rate.lag_s(), 30.0);
    const double now_s = 2.0 * k / f;
    // Temperatures below 32 °C are rounded to 3.6e-15 °C; the difference of two over 60 s: 1.2e-16
    // °C/s.
    EXPECT_NEAR(*rate.rate_degc_per_s(), curvature * (now_s - rate.lag_s()), 1e-15);
  }
}

TEST(SlidingMeanLaws, TheNoiseGainIsThatOfTwoReadings) {
  constexpr std::uint64_t kSeed = 5;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise;
  SlidingMeanRate rate({.window_samples = 20, .sample_rate_hz = 10.0, .max_gap_s = 1.0});
  double square_sum = 0.0;
  constexpr int kRates = 200'000;
  for (int i = 0; i < kRates + 20; ++i) {
    rate.add(from_seconds(i * 0.1), noise(random));
    if (const auto r = rate.rate_degc_per_s()) square_sum += *r * *r;
  }
  // Each reading serves two rates, so at least n / 2 independent ones: sigma of the rms sqrt(1 / n)
  // = 0.22 %; 5 sigma.
  EXPECT_NEAR(std::sqrt(square_sum / kRates) / rate.noise_gain_per_s(), 1.0, 0.011);
}

TEST(SlidingMeanScenario, LostReadingsAndOtherRatesThanTheGridsLeaveARampsRateRight) {
  constexpr std::uint64_t kSeed = 6;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  constexpr double kRamp = 0.03;  // °C/s
  const SlidingMeanRateOptions options{
      .window_samples = 600, .sample_rate_hz = 10.0, .max_gap_s = 10.0};
  for (const double stream_hz : {0.5, 1.0, 10.0, 10.013, 200.0}) {
    SlidingMeanRate rate(options);
    for (double t = 0.0; t < 300.0; t += 1.0 / stream_hz) {
      if (random() % 20 == 0) continue;
      rate.add(from_seconds(t), kRamp * t);
    }
    ASSERT_TRUE(rate.rate_degc_per_s());
    // A reading is taken as it is at its nearest grid point, half a period off at either end: one
    // period in 600, or at stream rates below the grid's up to half a period at either end alike.
    EXPECT_NEAR(*rate.rate_degc_per_s() / kRamp, 1.0, 1.0 / 600.0 + 1e-9) << stream_hz;
  }
}

TEST(SlidingMeanScenario, ALongGapStartsTheWindowAfreshAndAShortOneDoesNot) {
  const SlidingMeanRateOptions options{
      .window_samples = 100, .sample_rate_hz = 10.0, .max_gap_s = 2.0};
  SlidingMeanRate rate(options);
  double t = 0.0;
  for (; t < 20.0; t += 0.1) rate.add(from_seconds(t), 0.1 * t);
  t += 1.5;
  rate.add(from_seconds(t), 0.1 * t);
  EXPECT_TRUE(rate.rate_degc_per_s());
  t += 2.5;
  for (int i = 0; i < 100; ++i, t += 0.1) {
    rate.add(from_seconds(t), 0.1 * t);
    EXPECT_FALSE(rate.rate_degc_per_s());
  }
  rate.add(from_seconds(t), 0.1 * t);
  // Rounding only: 40 sums of 0.1 and the division.
  EXPECT_NEAR(*rate.rate_degc_per_s(), 0.1, 1e-9);
}

TEST(SlidingMeanAbuse, NotFiniteRepeatedLateAndExtremeReadingsChangeNothing) {
  const SlidingMeanRateOptions options{
      .window_samples = 20, .sample_rate_hz = 10.0, .max_gap_s = 2.0};
  SlidingMeanRate clean(options);
  SlidingMeanRate abused(options);
  for (int i = 0; i < 50; ++i) {
    const auto time = from_seconds(0.1 * i);
    const double temperature = std::sin(0.1 * i);
    clean.add(time, temperature);
    abused.add(time, temperature);
    abused.add(time, 80.0);
    abused.add(from_seconds(0.1 * i - 0.25), i > 3 ? 80.0 : std::nan(""));
    abused.add(from_seconds(0.1 * i + 0.01), std::numeric_limits<double>::infinity());
    abused.add(core::kNever, 80.0);
    abused.add(core::SensorTime::max(), 80.0);
    ASSERT_EQ(clean.rate_degc_per_s(), abused.rate_degc_per_s());
  }
  ASSERT_TRUE(clean.rate_degc_per_s());
}

TEST(SlidingMeanAbuse, WrongOptionsAreRefusedWithTheirKey) {
  const auto key_of = zerodrift::testing::wrong_key<SlidingMeanRate, SlidingMeanRateOptions>;
  EXPECT_EQ(key_of({.window_samples = 0}), "window_samples");
  EXPECT_EQ(key_of({.window_samples = 1'000'000'000}), "window_samples");
  EXPECT_EQ(key_of({.sample_rate_hz = 0.0}), "sample_rate_hz");
  EXPECT_EQ(key_of({.sample_rate_hz = std::nan("")}), "sample_rate_hz");
  EXPECT_EQ(key_of({.max_gap_s = 0.0}), "max_gap_s");
  EXPECT_EQ(key_of({.max_gap_s = 1e9}), "max_gap_s");
}

}  // namespace
}  // namespace zerodrift::thermal
