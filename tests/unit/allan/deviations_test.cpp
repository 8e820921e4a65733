// SPDX-License-Identifier: Apache-2.0
#include "common/allan/deviations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/allan/noise_sources.h"

namespace zerodrift::allan {
namespace {

template <typename Source>
std::vector<AllanPoint> octaves_of(Source& source, double interval_s) {
  std::vector<double> rate(1 << 18);
  for (double& y : rate) y = source.next();
  return overlapping_allan(angle_from_rate(rate, interval_s), interval_s, TauGrid::kOctave);
}

TEST(DeviationLaws, WhiteRateFallsWithTheRootOfTau) {
  constexpr std::uint64_t kSeed = 11;
  test::WhiteNoise source(3e-7, 0.01, kSeed);
  for (const AllanPoint& p : octaves_of(source, 0.01)) {
    // 5 sigma of an estimate with these degrees of freedom, on the log scale.
    if (p.degrees_of_freedom < 50) continue;
    EXPECT_NEAR(std::log(p.deviation_radps * std::sqrt(p.tau_s) / 3e-7), 0.0,
                5.0 / std::sqrt(2.0 * p.degrees_of_freedom))
        << "tau = " << p.tau_s << ", seed " << kSeed;
    EXPECT_EQ(p.noise, NoiseType::kAngleRandomWalk) << "tau = " << p.tau_s << ", seed " << kSeed;
  }
}

TEST(DeviationLaws, RandomWalkOfRateGrowsWithTheRootOfTau) {
  constexpr std::uint64_t kSeed = 12;
  test::RandomWalk source(2e-9, 0.01, kSeed);
  int checked = 0;
  for (const AllanPoint& p : octaves_of(source, 0.01)) {
    // Discrete walk against continuous: relative 1/(2m²) of the variance + 5 sigma of the estimate.
    if (p.degrees_of_freedom < 50 || p.tau_s < 0.08) continue;
    const double m = p.tau_s / 0.01;
    EXPECT_NEAR(std::log(p.deviation_radps / (2e-9 * std::sqrt(p.tau_s / 3.0))), 0.0,
                0.5 / (m * m) + 5.0 / std::sqrt(2.0 * p.degrees_of_freedom))
        << "tau = " << p.tau_s << ", seed " << kSeed;
    EXPECT_EQ(p.noise, NoiseType::kRateRandomWalk) << "tau = " << p.tau_s << ", seed " << kSeed;
    ++checked;
  }
  EXPECT_GT(checked, 5);
}

TEST(DeviationLaws, FlickerIsFlat) {
  constexpr std::uint64_t kSeed = 13;
  test::Flicker source(1e-8, 1.0, 0.25, 22, kSeed);
  int checked = 0;
  for (const AllanPoint& p : octaves_of(source, 1.0)) {
    // 1 % for the spectrum's ripple and the band's ends + 5 sigma of the estimate.
    if (p.degrees_of_freedom < 50 || p.tau_s < 8.0) continue;
    const double flat = 1e-8 * std::sqrt(2.0 * std::numbers::ln2 / std::numbers::pi);
    EXPECT_NEAR(std::log(p.deviation_radps / flat), 0.0,
                0.01 + 5.0 / std::sqrt(2.0 * p.degrees_of_freedom))
        << "tau = " << p.tau_s << ", seed " << kSeed;
    if (p.degrees_of_freedom > 200) {
      EXPECT_EQ(p.noise, NoiseType::kBiasInstability) << "tau = " << p.tau_s << ", seed " << kSeed;
    }
    ++checked;
  }
  EXPECT_GT(checked, 5);
}

// White angle of 1 rad is Q = 1 rad: sigma = sqrt(3) Q / tau.
TEST(DeviationLaws, WhiteAngleIsQuantization) {
  constexpr std::uint64_t kSeed = 14;
  test::WhiteNoise source(1.0, 1.0, kSeed);
  std::vector<double> angle(1 << 15);
  for (double& x : angle) x = source.next();
  for (const AllanPoint& p : overlapping_allan(angle, 1.0, TauGrid::kOctave)) {
    if (p.tau_s > 500.0) continue;  // fewer than 64 clusters tell the noises apart too badly
    EXPECT_EQ(p.noise, NoiseType::kQuantization) << "tau = " << p.tau_s << ", seed " << kSeed;
    // 5 sigma of the estimate, on the log scale.
    EXPECT_NEAR(std::log(p.deviation_radps * p.tau_s / std::sqrt(3.0)), 0.0,
                5.0 / std::sqrt(2.0 * p.degrees_of_freedom))
        << "tau = " << p.tau_s << ", seed " << kSeed;
  }
}

// A constant ramp of rate R: sigma = R tau / sqrt(2) for Allan, nothing for Hadamard.
TEST(DeviationLaws, HadamardIsBlindToARampThatAllanSees) {
  std::vector<double> rate(1000);
  for (std::size_t i = 0; i < rate.size(); ++i) rate[i] = 1e-6 * static_cast<double>(i);
  const auto angle = angle_from_rate(rate, 1.0);
  for (const std::size_t m : {1u, 7u, 50u}) {
    const double tau = static_cast<double>(m);
    // Rounding: second differences of angles up to 0.1 rad carry 1e-16 rad against 1e-6 rad.
    EXPECT_NEAR(deviation(Statistic::kOadev, angle, 1.0, m)->deviation, 1e-6 * tau / std::sqrt(2.0),
                1e-15);
    EXPECT_NEAR(deviation(Statistic::kAdev, angle, 1.0, m)->deviation, 1e-6 * tau / std::sqrt(2.0),
                1e-15);
    EXPECT_LT(deviation(Statistic::kOhdev, angle, 1.0, m)->deviation, 1e-15);
    EXPECT_LT(deviation(Statistic::kHdev, angle, 1.0, m)->deviation, 1e-15);
  }
}

TEST(DeviationAbuse, ARecordTooShortHasNoValue) {
  const std::vector<double> empty;
  const std::vector<double> two{0.0, 1.0};
  for (const auto statistic :
       {Statistic::kAdev, Statistic::kOadev, Statistic::kMdev, Statistic::kTdev, Statistic::kHdev,
        Statistic::kOhdev, Statistic::kTotdev}) {
    EXPECT_FALSE(deviation(statistic, empty, 1.0, 1)) << name(statistic);
    EXPECT_FALSE(deviation(statistic, two, 1.0, 1)) << name(statistic);
    EXPECT_FALSE(deviation(statistic, std::vector<double>(100, 0.0), 1.0, 1000)) << name(statistic);
  }
  EXPECT_TRUE(overlapping_allan(empty, 1.0, TauGrid::kOctave).empty());
  EXPECT_TRUE(overlapping_allan(two, 1.0, TauGrid::kQuarterOctave).empty());
  EXPECT_EQ(angle_from_rate({}, 1.0).size(), 1u);
}

TEST(DeviationAbuse, AStuckRateHasZeroDeviationAndFiniteBounds) {
  const auto angle = angle_from_rate(std::vector<double>(1000, 0.3), 1.0);
  for (const AllanPoint& p : overlapping_allan(angle, 1.0, TauGrid::kOctave)) {
    EXPECT_LT(p.deviation_radps, 1e-12);  // the mean of 1000 equal numbers is off by some 1e-15
    EXPECT_TRUE(std::isfinite(p.lower_radps) && std::isfinite(p.upper_radps));
  }
}

}  // namespace
}  // namespace zerodrift::allan
