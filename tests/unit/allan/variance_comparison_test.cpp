// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/allan/chi_square.h"
#include "common/allan/comparison_test.h"
#include "common/allan/rolling_allan.h"
#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

AllanPoint estimate(double deviation, double degrees_of_freedom) {
  AllanPoint p;
  p.tau_s = 1.0;
  p.deviation_radps = deviation;
  p.degrees_of_freedom = degrees_of_freedom;
  return p;
}

// Printed percentage points (NIST/SEMATECH e-Handbook 1.3.6.7.3), half a unit of the last digit
// times the density there.
TEST(FDistribution, EqualsThePrintedTables) {
  EXPECT_NEAR(f_upper_tail(161.448, 1, 1), 0.05, 1e-6);
  EXPECT_NEAR(f_upper_tail(3.326, 5, 10), 0.05, 2e-5);
  EXPECT_NEAR(f_upper_tail(3.368, 10, 20), 0.01, 1e-5);
  EXPECT_NEAR(f_upper_tail(2.348, 20, 20), 0.0316, 2e-4);
}

TEST(FDistributionLaws, TwoNumeratorDegreesHaveAClosedForm) {
  for (const double d : {0.7, 3.0, 40.0, 1e4}) {
    for (const double f : {1e-3, 0.4, 1.0, 7.0}) {
      // log_gamma(1e4) = 8e4 to 1e-16 relative.
      EXPECT_NEAR(f_upper_tail(f, 2.0, d) / std::pow(1.0 + 2.0 * f / d, -0.5 * d), 1.0, 1e-10)
          << f << " with " << d;
    }
  }
}

TEST(FDistributionLaws, ExchangeOfNumeratorAndDenominatorGivesTheComplement) {
  for (const double a : {0.5, 2.3, 17.0, 900.0}) {
    for (const double b : {1.0, 5.9, 2000.0}) {
      for (const double f : {0.2, 0.97, 1.0, 3.1})
        EXPECT_NEAR(f_upper_tail(f, a, b) + f_upper_tail(1.0 / f, b, a), 1.0, 1e-11);
    }
  }
}

// F(a, infinity) is chi-square over its degrees of freedom; the difference falls like 1/b.
TEST(FDistributionLaws, ManyDenominatorDegreesGiveChiSquare) {
  for (const double a : {1.0, 6.5, 30.0})
    EXPECT_NEAR(f_upper_tail(1.3, a, 1e9), 1.0 - chi_square_cdf(1.3 * a, a), 1e-5);
}

TEST(VarianceComparison, EqualEstimatesSayNothing) {
  EXPECT_NEAR(larger_variance_p_value(estimate(3e-7, 25.0), estimate(3e-7, 25.0)), 0.5, 1e-12);
  EXPECT_LT(larger_variance_p_value(estimate(6e-7, 25.0), estimate(3e-7, 25.0)), 0.01);
  EXPECT_GT(larger_variance_p_value(estimate(3e-7, 25.0), estimate(6e-7, 25.0)), 0.99);
  EXPECT_GT(larger_variance_p_value(estimate(6e-7, 1.5), estimate(3e-7, 1.5)), 0.1);
}

struct Alarms {
  double independent = 0.0;
  double shared = 0.0;
};

// Share of runs with p < 5 % at one tau where first and second are equally noisy: with noises of
// their own, and with four fifths of the variance in common.
Alarms alarms_at_five_per_cent() {
  constexpr int kRuns = 600;
  constexpr int kSamples = 512;
  constexpr std::size_t kTau = 4;  // 16 s, edf about 45
  Alarms alarms;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const RollingAllanOptions options{.sample_interval_s = 1.0, .longest_tau_s = 16.0};
  for (int run = 0; run < kRuns; ++run) {
    RollingAllan raw(options), other(options), compensated(options);
    for (int i = 0; i < kSamples; ++i) {
      const double common = 2.0 * normal(random);
      raw.add(1e-6 * (common + normal(random)));
      compensated.add(1e-6 * (common + normal(random)));
      other.add(1e-6 * std::sqrt(5.0) * normal(random));
    }
    const auto p = [&](const RollingAllan& second) {
      return larger_variance_p_value(*raw.point(kTau, Span::kSinceStart),
                                     *second.point(kTau, Span::kSinceStart));
    };
    alarms.independent += p(other) < 0.05 ? 1.0 / kRuns : 0.0;
    alarms.shared += p(compensated) < 0.05 ? 1.0 / kRuns : 0.0;
  }
  return alarms;
}

TEST(VarianceComparisonLaws, AlarmsAsOftenAsItsLevelAndLessWhereNoiseIsShared) {
  const Alarms alarms = alarms_at_five_per_cent();
  EXPECT_NEAR(alarms.independent, 0.05, 0.036);  // 4 sigma, binomial, 600 runs
  EXPECT_LT(alarms.shared, 0.02);  // the ratio scatters by sqrt(1 - 0.8²) = 0.6: 0.3 % expected
}

TEST(VarianceComparisonAbuse, PointsThatSayNothingRaiseNoAlarm) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(larger_variance_p_value(estimate(nan, 5.0), estimate(1.0, 5.0)), 1.0);
  EXPECT_EQ(larger_variance_p_value(estimate(1.0, 5.0), estimate(1.0, nan)), 1.0);
  EXPECT_EQ(larger_variance_p_value(estimate(1.0, 0.0), estimate(1.0, 5.0)), 1.0);
  EXPECT_EQ(larger_variance_p_value(AllanPoint{}, AllanPoint{}), 1.0);
  EXPECT_EQ(larger_variance_p_value(estimate(0.0, 5.0), estimate(0.0, 5.0)), 1.0);
  EXPECT_EQ(larger_variance_p_value(estimate(1.0, 5.0), estimate(0.0, 5.0)), 0.0);
  EXPECT_EQ(larger_variance_p_value(estimate(1e200, 5.0), estimate(1e-200, 5.0)), 0.0);
}

}  // namespace
}  // namespace zerodrift::allan
