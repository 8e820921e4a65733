// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/local_polynomial_rate.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/support/wrong_key.h"

namespace zerodrift::thermal {
namespace {

using core::from_seconds;

struct TimedReading {
  double time_s;
  double temperature_degc;
};

// Independent reference: Householder QR over single readings, in seconds relative to the newest.
LocalPolynomialFit least_squares(const std::vector<TimedReading>& readings, int degree) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd a(n, degree + 1);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TimedReading& reading = readings[static_cast<std::size_t>(i)];
    for (int p = 0; p <= degree; ++p)
      a(i, p) = std::pow(reading.time_s - readings.back().time_s, p);
    y(i) = reading.temperature_degc;
  }
  const Eigen::VectorXd c = a.colPivHouseholderQr().solve(y);
  const Eigen::MatrixXd covariance = (a.transpose() * a).inverse();
  return {c(0), c(1), std::sqrt(covariance(1, 1))};
}

TEST(LocalPolynomialGolden, OneReadingABinEqualsLeastSquaresByQr) {
  constexpr std::uint64_t kSeed = 31;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> within_bin(0.0, 0.999);
  std::normal_distribution<double> noise(0.0, 0.1);
  for (const int degree : {1, 2}) {
    LocalPolynomialRate rate({.degree = degree});
    std::vector<TimedReading> window;
    for (int second = 0; second < 200; ++second) {
      if (random() % 4 == 0) continue;  // an empty bin
      const double time_s = second + within_bin(random);
      const double temperature_degc = -10.0 + 0.03 * time_s + noise(random);
      rate.add(from_seconds(time_s), temperature_degc);
      window.push_back({core::seconds(from_seconds(time_s)), temperature_degc});
      std::erase_if(window, [&](const TimedReading& r) { return r.time_s < second - 59; });
      const auto fit = rate.fit();
      if (!fit || second < 60) continue;
      const LocalPolynomialFit expected = least_squares(window, degree);
      // Normal equations on [-1, 0]: condition below 1e3, so 1e3 * 60 roundings of values of a few
      // degrees = 1e-11 °C at most; over 60 s the rate is better still. The gain is relative, by
      // the same count.
      ASSERT_NEAR(fit->temperature_degc, expected.temperature_degc, 1e-11);
      ASSERT_NEAR(fit->rate_degc_per_s, expected.rate_degc_per_s, 1e-12);
      ASSERT_NEAR(fit->noise_gain_per_s / expected.noise_gain_per_s, 1.0, 1e-9);
    }
  }
}

TEST(LocalPolynomialLaws, IsExactOnPolynomialsOfItsDegreeForAnySpacingAndBinning) {
  constexpr std::uint64_t kSeed = 32;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::exponential_distribution<double> interval(20.0);  // 20 readings/s on average, in bursts
  for (const int degree : {1, 2}) {
    for (const std::size_t bins : {8U, 13U, 60U, 64U}) {
      LocalPolynomialRate rate({.degree = degree, .bins = bins});
      const double slope = -0.04;
      const double curvature = degree == 2 ? 2e-4 : 0.0;
      double time_s = -50.0;
      while (time_s < 100.0) {
        time_s = core::seconds(from_seconds(time_s + interval(random)));
        rate.add(from_seconds(time_s), 60.0 + slope * time_s + curvature * time_s * time_s);
      }
      ASSERT_TRUE(rate.fit());
      // 1200 readings of 64 °C summed in a bin of up to 150: 150 * 7e-15 = 1e-12 °C a bin mean at
      // worst, times the fit's gain (below 10 for the value, 200 / 60 s for the rate).
      EXPECT_NEAR(rate.fit()->temperature_degc, 60.0 + time_s * (slope + curvature * time_s),
                  1e-11);
      EXPECT_NEAR(rate.fit()->rate_degc_per_s, slope + 2.0 * curvature * time_s, 4e-12);
    }
  }
}

TEST(LocalPolynomialLaws, DegreeOneReadsAParabolasRateHalfAWindowAgoAndDegreeTwoNow) {
  constexpr double kCurvature = 1e-4;  // °C/s²
  for (const int degree : {1, 2}) {
    LocalPolynomialRate rate({.degree = degree});
    double time_s = 0.0;
    for (int i = 0; i <= 24'000; ++i) {
      time_s = i * 0.005;
      rate.add(from_seconds(time_s), 0.5 * kCurvature * time_s * time_s);
    }
    // The window is whole bins, so at the first reading of a bin it is one bin of 60 short: half a
    // second of lag.
    EXPECT_NEAR(*rate.rate_degc_per_s(), kCurvature * (time_s - rate.lag_s()),
                degree == 1 ? 0.51 * kCurvature : 1e-12);
  }
}

TEST(LocalPolynomialLaws, TheNoiseGainIsThatOfIndependentWindows) {
  constexpr std::uint64_t kSeed = 33;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise;
  for (const int degree : {1, 2}) {
    LocalPolynomialRate rate({.degree = degree});
    double square_sum = 0.0;
    double gain = 0.0;
    constexpr int kWindows = 2000;
    for (int w = 0; w < kWindows; ++w) {
      for (int i = 0; i < 600; ++i) rate.add(from_seconds(w * 60.0 + i * 0.1), noise(random));
      const auto fit = rate.fit();
      ASSERT_TRUE(fit);
      gain = fit->noise_gain_per_s;
      square_sum += fit->rate_degc_per_s * fit->rate_degc_per_s;
    }
    // The rms of n independent values has relative sigma sqrt(1 / 2n) = 1.6 %; 5 sigma.
    EXPECT_NEAR(std::sqrt(square_sum / kWindows) / gain, 1.0, 0.08);
    // The evenly spread limit of the header; end effects are of order 1/60.
    EXPECT_NEAR(gain / (std::sqrt((degree == 1 ? 12.0 : 192.0) / 600.0) / 60.0), 1.0, 0.03);
  }
}

TEST(LocalPolynomialLaws, ShiftingAllTimesByWholeBinsChangesNoBit) {
  LocalPolynomialRate here({.degree = 2});
  LocalPolynomialRate there({.degree = 2});
  const core::SensorTime shift = std::chrono::seconds(1'760'000'000);
  for (int i = 0; i < 900; ++i) {
    const double temperature_degc = std::sin(0.01 * i);
    here.add(from_seconds(0.1 * i), temperature_degc);
    there.add(from_seconds(0.1 * i) + shift, temperature_degc);
    ASSERT_EQ(here.rate_degc_per_s(), there.rate_degc_per_s());
  }
  ASSERT_TRUE(here.rate_degc_per_s());
}

TEST(LocalPolynomialLaws, ThereIsARateOnceBinsAndSpanSufficeAndNotBefore) {
  LocalPolynomialRate by_span({});  // 1 reading/s: bins suffice after 6 s, the span of 30 s decides
  for (int i = 0; i <= 60; ++i) {
    by_span.add(from_seconds(i), 20.0 + i);
    ASSERT_EQ(by_span.rate_degc_per_s().has_value(), i >= 30) << i;
  }
  LocalPolynomialRate by_bins({});  // 1 reading in 10 s: 6 bins at 50 s
  for (int i = 0; i <= 6; ++i) {
    by_bins.add(from_seconds(10 * i), 20.0 + i);
    ASSERT_EQ(by_bins.rate_degc_per_s().has_value(), i >= 5) << i;
  }
}

TEST(LocalPolynomialScenario, ALongGapStartsTheWindowAfreshAndAShortOneDoesNot) {
  LocalPolynomialRate rate({});
  double time_s = 0.0;
  const auto feed = [&](double duration_s) {
    for (const double end_s = time_s + duration_s; time_s < end_s; time_s += 0.1) {
      rate.add(from_seconds(time_s), 0.02 * time_s);
    }
  };
  feed(70.0);
  time_s += 14.0;
  rate.add(from_seconds(time_s), 0.02 * time_s);
  ASSERT_TRUE(rate.rate_degc_per_s());
  EXPECT_NEAR(*rate.rate_degc_per_s(), 0.02,
              1e-9);  // a ramp stays exact across empty bins; rounding of times 1e-9
  time_s += 16.0;
  feed(29.0);
  EXPECT_FALSE(rate.rate_degc_per_s());
  feed(2.0);
  ASSERT_TRUE(rate.rate_degc_per_s());
  EXPECT_NEAR(*rate.rate_degc_per_s(), 0.02, 1e-9);
}

TEST(LocalPolynomialAbuse, NotFiniteRepeatedLateAndExtremeReadingsChangeNothing) {
  LocalPolynomialRate clean({});
  LocalPolynomialRate abused({});
  for (int i = 0; i < 700; ++i) {
    const double temperature_degc = 0.01 * i;
    clean.add(from_seconds(0.1 * i), temperature_degc);
    abused.add(from_seconds(0.1 * i), temperature_degc);
    abused.add(from_seconds(0.1 * i), 80.0);
    abused.add(from_seconds(0.1 * i - 3.0), 80.0);
    abused.add(from_seconds(0.1 * i + 0.01), std::nan(""));
    abused.add(from_seconds(0.1 * i + 0.01), -std::numeric_limits<double>::infinity());
    abused.add(core::kNever, 80.0);
    abused.add(core::SensorTime::max(), 80.0);
    ASSERT_EQ(clean.rate_degc_per_s(), abused.rate_degc_per_s());
  }
  ASSERT_TRUE(clean.rate_degc_per_s());
}

TEST(LocalPolynomialAbuse, ReadingsCrowdedIntoTwoInstantsGiveNoParabola) {
  // Times a microsecond apart around two instants: three bins or more are never filled, so no rate
  // at any count.
  LocalPolynomialRate rate({.degree = 2, .min_bins = 4});
  for (int i = 0; i < 1000; ++i) rate.add(from_seconds(0.1 + 1e-6 * i), i % 2);
  for (int i = 0; i < 1000; ++i) rate.add(from_seconds(14.1 + 1e-6 * i), i % 2);
  EXPECT_FALSE(rate.fit());
}

TEST(LocalPolynomialAbuse, WrongOptionsAreRefusedWithTheirKey) {
  const auto key_of =
      zerodrift::testing::wrong_key<LocalPolynomialRate, LocalPolynomialRateOptions>;
  EXPECT_EQ(key_of({.degree = 3}), "degree");
  EXPECT_EQ(key_of({.degree = 0}), "degree");
  EXPECT_EQ(key_of({.window_s = -1.0}), "window_s");
  EXPECT_EQ(key_of({.window_s = std::nan("")}), "window_s");
  EXPECT_EQ(key_of({.bins = 65}), "bins");
  EXPECT_EQ(key_of({.bins = 3}), "bins");
  EXPECT_EQ(key_of({.min_bins = 61}), "min_bins");
  EXPECT_EQ(key_of({.min_bins = 3}), "min_bins");
  EXPECT_EQ(key_of({.min_span_fraction = 1.0}), "min_span_fraction");
  EXPECT_EQ(key_of({.max_gap_s = 0.0}), "max_gap_s");
}

}  // namespace
}  // namespace zerodrift::thermal
