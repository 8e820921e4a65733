// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/gap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace zerodrift::diagnosis {
namespace {

std::vector<double> white(std::size_t n, double sigma, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, sigma);
  std::vector<double> values(n);
  for (double& value : values) value = normal(random);
  return values;
}

TEST(GapLaws, BlockMeansOfWhiteNoiseFallWithTheRootOfTheBlock) {
  constexpr std::size_t kSize = 60'000;
  const auto noise = white(kSize, 2.0, 1);
  const std::vector<std::uint8_t> valid(kSize, 1);
  const std::vector<double> variances(kSize, 4.0);
  // 1000 blocks: a standard deviation is known within 1/sqrt(2000) = 2.2 %; 4 sigma.
  EXPECT_NEAR(rms_of_block_means(noise, valid, 60).about_mean / (2.0 / std::sqrt(60.0)), 1.0, 0.09);
  // The mean is not counted: one of 60 000 coefficients, of 1000 that a mean over 60 lets through.
  EXPECT_NEAR(expected_rms_of_block_means(variances, 60) / (2.0 / std::sqrt(60.0)), 1.0, 1e-3);
}

TEST(GapLaws, AnOffsetCountsAboutZeroAndNotAboutTheMean) {
  const std::vector<double> values{4.0, 4.0, 2.0, 2.0};
  const std::vector<std::uint8_t> valid(4, 1);
  const BlockRms rms = rms_of_block_means(values, valid, 2);
  EXPECT_DOUBLE_EQ(rms.about_mean, 1.0);
  EXPECT_DOUBLE_EQ(rms.about_zero, std::sqrt(10.0));
}

TEST(GapLaws, AllanVarianceOfWhiteAndRandomWalkFollowTheirFormulas) {
  constexpr std::size_t kSize = 20'000;
  const std::vector<double> flat(kSize, 9.0);
  std::vector<double> walk(kSize, 0.0);
  for (std::size_t k = 1; k < kSize; ++k) {
    const double sine = std::sin(std::numbers::pi * static_cast<double>(k) / (2.0 * kSize));
    walk[k] = 1.0 / (4.0 * sine * sine);  // steps of variance 1
  }
  for (const std::size_t m : {1U, 10U, 100U}) {
    const auto tau = static_cast<double>(m);
    EXPECT_NEAR(allan_variance_of_noise(flat, m) * tau / 9.0, 1.0, 2.0 * tau / kSize + 1e-3);
    // Sampled random walk: (2 m² + 1) / (6 m), which is K² tau / 3 for long tau.
    EXPECT_NEAR(allan_variance_of_noise(walk, m) / ((2.0 * tau * tau + 1.0) / (6.0 * tau)), 1.0,
                2.0 * tau / kSize + 1e-3);
  }
}

TEST(GapScenario, ATwinThatHasTheWaveformIsCloserThanOneThatLacksIt) {
  constexpr std::size_t kSize = 18'000;
  auto measured = white(kSize, 1.0, 2);
  std::vector<double> drift(kSize);
  for (std::size_t i = 0; i < kSize; ++i) {
    drift[i] = 3.0 * std::sin(2.0 * std::numbers::pi * static_cast<double>(i) / 4000.0);
    measured[i] += drift[i];
  }
  const std::vector<double> nothing(kSize, 0.0);
  const std::vector<double> variances(kSize, 1.0);
  const std::vector<std::uint8_t> valid(kSize, 1);
  const auto curves = allan_curves(measured, valid, 1.0, {nothing, variances}, {drift, variances});
  const AllanDistance distance = allan_distance(curves);
  // The longest tau, 1024 s, has about 16 degrees of freedom: 18 % on its deviation; the mean over
  // the 11 taus lies well below that.
  EXPECT_LT(distance.after, 0.1);
  EXPECT_GT(distance.before, 0.5);
}

// Before: distance 0, so that any noise given to such a twin counted as worse.
TEST(GapScenario, ATwinWithoutAnyNoiseHasNoDistance) {
  constexpr std::size_t kSize = 6000;
  const auto measured = white(kSize, 1.0, 3);
  const std::vector<double> nothing(kSize, 0.0);
  const std::vector<double> variances(kSize, 1.0);
  const std::vector<std::uint8_t> valid(kSize, 1);
  const AllanDistance distance =
      allan_distance(allan_curves(measured, valid, 1.0, {nothing, nothing}, {nothing, variances}));
  EXPECT_TRUE(std::isnan(distance.before));
  EXPECT_LT(distance.after, 0.1);
}

TEST(GapAbuse, BlocksWithTooLittleInThemAreLeftOut) {
  const std::vector<double> values{1.0, 1.0, 5.0, 5.0, 9.0};
  const std::vector<std::uint8_t> valid{1, 1, 1, 0, 1};
  EXPECT_EQ(block_means(values, valid, 2).mean, (std::vector<double>{1.0, 5.0}));
  const std::vector<std::uint8_t> none(5, 0);
  EXPECT_EQ(rms_of_block_means(values, none, 2).about_zero, 0.0);
}

}  // namespace
}  // namespace zerodrift::diagnosis
