// SPDX-License-Identifier: Apache-2.0
// The paper's preparation and figures: laws, an independent reference, abuse.
#include "common/comparison/paper_preparation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "common/allan/deviations.h"
#include "common/twin/random.h"

namespace zerodrift::comparison {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The minimal standard generator, uniform in (0, 1): the set of NIST SP 1065, continued.
std::vector<double> uniform(std::size_t count) {
  std::vector<double> values;
  for (std::uint64_t n = 1234567890; values.size() < count; n = 16807 * n % 2147483647) {
    values.push_back(static_cast<double>(n) / 2147483647.0);
  }
  return values;
}

std::vector<double> mean_of_every_minute(const std::vector<double>& samples, std::size_t window) {
  std::vector<double> means;
  for (auto first = samples.begin(); samples.end() - first >= static_cast<std::ptrdiff_t>(window);
       ++first) {
    means.push_back(std::accumulate(first, first + static_cast<std::ptrdiff_t>(window), 0.0) /
                    static_cast<double>(window));
  }
  return means;
}

// Rule: a point is the mean of its minute. 900 samples at 2 Hz make 781 full minutes, each a point.
TEST(PreparationLaws, EveryPointIsTheMeanOfItsMinute) {
  const auto samples = uniform(900);
  const auto prepared = prepare(samples, 0.5);
  const auto expected = mean_of_every_minute(samples, 120);
  ASSERT_EQ(prepared.points.size(), expected.size());
  EXPECT_DOUBLE_EQ(prepared.interval_s, 0.5);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    // Sums of 120 values below 1: 120 roundings of at most 120 / 2 * 2^-53 a side, over 120.
    ASSERT_NEAR(prepared.points[i], expected[i], 2 * 60 * 0x1p-53) << i;
  }
}

TEST(PreparationLaws, AConstantComesOutAsItself) {
  const auto prepared = prepare(std::vector<double>(30'000, 0.375), 0.02);
  ASSERT_EQ(prepared.points.size(), kPaperPoints);
  for (const double point : prepared.points) ASSERT_EQ(point, 0.375);  // sums of eighths are exact
}

// Rule: the mean of a ramp over the minute that ends at sample e is the ramp at e - (K - 1) / 2.
TEST(PreparationLaws, ARampComesOutHalfAMinuteLate) {
  constexpr double kIntervalS = 0.1;
  PaperPreparation preparation(kIntervalS, 3600.0);
  for (int i = 0; i < 36'000; ++i) {
    if (!preparation.add(static_cast<double>(i))) continue;
    // Sums of whole numbers below 2^53 are exact, their quotient rounds once.
    ASSERT_DOUBLE_EQ(preparation.points().back(), i - 299.5);
  }
  EXPECT_EQ(preparation.points().size(), kPaperPoints);
}

// Rule: 15 000 points, evenly, the first at the end of the first minute, the last at the record's.
TEST(PreparationLaws, FiveHoursAt200HzMakeEvenPointsFromTheFirstMinuteToTheLastSample) {
  constexpr std::size_t kSamples = 3'600'000;
  PaperPreparation preparation(1.0 / 200.0, 18'000.0);
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < kSamples; ++i) {
    if (preparation.add(1.0)) ends.push_back(i);
  }
  ASSERT_EQ(ends.size(), kPaperPoints);
  EXPECT_EQ(ends.front(), 11'999U);
  EXPECT_EQ(ends.back(), kSamples - 1);
  EXPECT_DOUBLE_EQ(preparation.interval_s(), 17'940.0 / 14'999.0);
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const double exact = 11'999.0 + static_cast<double>(k) * preparation.interval_s() * 200.0;
    ASSERT_LE(std::abs(static_cast<double>(ends[k]) - exact), 0.5 + 1e-6) << k;
  }
}

// Rule: rounding doesn't build up. A running sum would never forget what 1e300 took from it.
TEST(PreparationLaws, ASpikeLeavesNoTraceAfterItsMinute) {
  std::vector<double> samples(20'000, 1.0);
  samples[10] = 1e300;
  const auto points = prepare(samples, 1.0).points;
  EXPECT_GT(points.front(), 1e290);  // ends with sample 59
  // Sample 69 is the last whose minute has the spike; a point every 1.33 samples.
  for (std::size_t i = 12; i < points.size(); ++i) ASSERT_EQ(points[i], 1.0) << i;
}

// Rule: what the header says of white noise after the minute's mean. Ten records of 5 h at 10 Hz.
TEST(PreparationLaws, TheMinutesMeanMakesWhiteNoiseARateRandomWalkBelowAMinute) {
  constexpr int kRecords = 10;
  constexpr double kIntervalS = 0.1;  // white noise of 1 a sample: N² = 0.1
  constexpr double kN2 = kIntervalS;
  const auto variance = [](std::size_t cluster) {
    double sum = 0.0;
    for (std::uint64_t record = 0; record < kRecords; ++record) {
      const auto noise = twin::NoiseStream(1, "white").substream(record);
      PaperPreparation preparation(kIntervalS, 18'000.0);
      for (std::uint64_t i = 0; i < 180'000; ++i) preparation.add(noise.gaussian(i));
      const auto angle = allan::angle_from_rate(preparation.points(), preparation.interval_s());
      const auto point =
          allan::deviation(allan::Statistic::kOadev, angle, preparation.interval_s(), cluster);
      sum += point->deviation * point->deviation / kRecords;
    }
    return sum;
  };
  const double interval_s = 17'940.0 / 14'999.0;
  const auto short_law = [](double tau) { return 2.0 / 3.0 * kN2 * tau / 3600.0; };
  const auto long_law = [](double tau) { return kN2 / tau * (1.0 - 60.0 / (2.0 * tau)); };
  // Degrees of freedom of ten records: about 1.5 T/tau each, but no more than T/tau below the
  // minute; the relative standard deviation of a variance is sqrt(2 / them). 4 sigma.
  const auto tolerance = [](double tau) { return 4.0 * std::sqrt(2.0 * tau / (kRecords * 18e3)); };
  for (const std::size_t cluster : {5U, 10U, 25U}) {
    const double tau = static_cast<double>(cluster) * interval_s;
    // Sums for integrals: a triangle of m steps has (1 + 1/(2 m²)) times the square integral.
    const double grid = 0.5 / static_cast<double>(cluster * cluster);
    EXPECT_NEAR(variance(cluster) / short_law(tau), 1.0, tolerance(tau) + grid) << tau;
  }
  for (const std::size_t cluster : {51U, 100U}) {
    const double tau = static_cast<double>(cluster) * interval_s;
    EXPECT_NEAR(variance(cluster) / long_law(tau), 1.0, tolerance(tau)) << tau;
  }
}

TEST(MomentsLaws, OfFourPoints) {
  const auto m = moments(std::vector<double>{-1.0, 1.0, 3.0, 5.0});
  EXPECT_EQ(m.points, 4U);
  EXPECT_DOUBLE_EQ(m.mean, 2.0);
  EXPECT_DOUBLE_EQ(m.standard_deviation, std::sqrt(5.0));  // 9 + 1 + 1 + 9 over 4
  EXPECT_DOUBLE_EQ(m.mean_absolute_error, 2.5);
  EXPECT_DOUBLE_EQ(m.root_mean_square, 3.0);  // 36 over 4
}

// Rule: sigma is linear in the signal and knows no offset; with all taus four times as long the
// term tau^-1/2 doubles its factor and tau^1/2 halves it.
TEST(PaperCoefficientsLaws, ScaleWithTheSignalAndWithTime) {
  const auto points = prepare(uniform(3000), 1.0).points;
  std::vector<double> other;
  for (const double point : points) other.push_back(3.0 * point - 7.0);
  const auto a = paper_coefficients(points, 1.0).value();
  const auto b = paper_coefficients(other, 4.0).value();
  // Cancellation in the fit of five terms: 1e-16 times its condition, below 1e6.
  constexpr double kRelative = 1e-9;
  const double n = a.angle_random_walk_rad_rts;
  const double k = a.rate_random_walk_radps_rts;
  EXPECT_NEAR(b.angle_random_walk_rad_rts, 6.0 * n, kRelative * n);
  EXPECT_NEAR(b.bias_instability_radps, 3.0 * a.bias_instability_radps,
              kRelative * a.bias_instability_radps);
  EXPECT_NEAR(b.rate_random_walk_radps_rts, 1.5 * k, kRelative * k);
}

// Reference: the same definitions in exact fractions (means) and 60-digit decimals (fit by the
// normal equations), on 20 000 samples at 1 Hz of uniform noise plus a ramp of 1/4096 a sample.
TEST(PaperGolden, PointsMomentsAndCoefficientsOfANoisyRamp) {
  auto samples = uniform(20'000);
  for (std::size_t k = 0; k < samples.size(); ++k) samples[k] += static_cast<double>(k) / 4096.0;
  const auto prepared = prepare(samples, 1.0);
  ASSERT_EQ(prepared.points.size(), kPaperPoints);
  // 60 roundings of sums below 360, over 60: below 1e-13.
  EXPECT_NEAR(prepared.points[0], 0.5029987833753523, 1e-13);
  EXPECT_NEAR(prepared.points[1], 0.4948230228793699, 1e-13);
  EXPECT_NEAR(prepared.points[2], 0.49966161532407954, 1e-13);
  EXPECT_NEAR(prepared.points[7499], 2.9913249989895236, 1e-13);
  EXPECT_NEAR(prepared.points[14'999], 5.367811134089302, 1e-13);
  const auto m = moments(prepared.points);
  // 15 000 roundings of a sum up to 1.6e5: below 15e3 * 1.6e5 / 2 * 2^-53 / 15e3 = 1e-11.
  EXPECT_NEAR(m.mean, 2.9411905387470987, 1e-11);
  EXPECT_NEAR(m.standard_deviation, 1.4078411781144216, 1e-11);
  EXPECT_NEAR(m.mean_absolute_error, 2.9411905387470987, 1e-11);
  EXPECT_NEAR(m.root_mean_square, 3.2607696281721670, 1e-11);
  const auto c = paper_coefficients(prepared.points, prepared.interval_s).value();
  EXPECT_NEAR(c.angle_random_walk_rad_rts, 0.015011035102130024, 1e-11);
  EXPECT_NEAR(c.bias_instability_radps, 0.03274501719257566, 1e-11);
  EXPECT_NEAR(c.rate_random_walk_radps_rts, 0.0018276281307460375, 1e-11);
}

TEST(PreparationAbuse, SamplesThatAreNotFiniteAreLeftOutOfTheirMeans) {
  std::vector<double> samples(600, 2.0);
  for (std::size_t i = 0; i < samples.size(); i += 3) samples[i] = kNaN;
  samples[1] = std::numeric_limits<double>::infinity();
  for (const double point : prepare(samples, 0.5).points) ASSERT_EQ(point, 2.0);
}

TEST(PreparationAbuse, AMinuteWithoutAFiniteSampleIsNaNAndStopsTheCoefficientsOnly) {
  std::vector<double> samples(600, 2.0);
  for (std::size_t i = 200; i < 320; ++i) samples[i] = kNaN;  // exactly the minute that ends at 319
  const auto points = prepare(samples, 0.5).points;
  ASSERT_EQ(points.size(), 481U);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(std::isnan(points[i]), i == 200) << i;
  EXPECT_EQ(moments(points).points, 480U);
  EXPECT_EQ(moments(points).mean, 2.0);
  EXPECT_FALSE(paper_coefficients(points, 0.5).has_value());
}

TEST(PreparationAbuse, ARecordShorterThanAMinuteHasNoPoint) {
  EXPECT_TRUE(prepare(std::vector<double>(119, 1.0), 0.5).points.empty());
  EXPECT_TRUE(prepare({}, 0.5).points.empty());
  EXPECT_EQ(moments({}).points, 0U);
  EXPECT_EQ(prepare(std::vector<double>(120, 1.0), 0.5).points, std::vector<double>{1.0});
}

TEST(PreparationAbuse, ARecordOf1HzGivesOnePointASampleWhileThereAreFewerThan15000) {
  EXPECT_EQ(prepare(std::vector<double>(3600, 1.0), 1.0).points.size(), 3541U);
  EXPECT_EQ(prepare(std::vector<double>(18'000, 1.0), 1.0).points.size(), kPaperPoints);
}

TEST(PreparationAbuse, SamplesAfterTheRecordsEndAreIgnored) {
  PaperPreparation preparation(1.0, 100.0);
  for (int i = 0; i < 100; ++i) preparation.add(1.0);
  ASSERT_EQ(preparation.points().size(), 41U);
  EXPECT_FALSE(preparation.add(5.0));
  EXPECT_EQ(preparation.points().size(), 41U);
  EXPECT_EQ(preparation.points().back(), 1.0);
}

TEST(PreparationAbuse, AWrongIntervalOrDurationIsNamed) {
  EXPECT_THROW(PaperPreparation(0.0, 100.0), std::invalid_argument);
  EXPECT_THROW(PaperPreparation(kNaN, 100.0), std::invalid_argument);
  EXPECT_THROW(PaperPreparation(1.0, -1.0), std::invalid_argument);
  EXPECT_THROW(PaperPreparation(61.0, 1e4), std::invalid_argument);
}

TEST(PaperCoefficientsAbuse, FifteenPointsAreTooFew) {
  EXPECT_FALSE(paper_coefficients(uniform(15), 1.0).has_value());
  EXPECT_TRUE(paper_coefficients(uniform(16), 1.0).has_value());
}

}  // namespace
}  // namespace zerodrift::comparison
