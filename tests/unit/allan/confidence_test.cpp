// SPDX-License-Identifier: Apache-2.0
#include "common/allan/confidence.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::allan {
namespace {

EstimateDesign overlapping(NoiseType noise, double m, double angles) {
  return {.noise = noise, .cluster_size = m, .terms = angles - 2.0 * m, .terms_per_tau = m};
}

// Greenhall & Riley's algorithm, white rate, 1001 angles; half a unit of the last printed digit.
TEST(DegreesOfFreedom, EqualTheReferenceForWhiteRate) {
  const struct {
    double m, edf;
  } expected[] = {{1, 782.03}, {2, 540.68}, {4, 306.09}, {8, 165.99},  {10, 135.07},
                  {16, 86.37}, {32, 43.35}, {64, 21.24}, {100, 12.81}, {128, 9.55}};
  for (const auto& e : expected) {
    EXPECT_NEAR(equivalent_degrees_of_freedom(overlapping(NoiseType::kAngleRandomWalk, e.m, 1001)),
                e.edf, 0.006)
        << "m = " << e.m;
  }
}

// M = 1 is one squared normal.
TEST(DegreesOfFreedomLaws, OneTermHasOne) {
  for (const auto noise : {NoiseType::kQuantization, NoiseType::kAngleRandomWalk,
                           NoiseType::kBiasInstability, NoiseType::kRateRandomWalk}) {
    EXPECT_NEAR(equivalent_degrees_of_freedom(
                    {.noise = noise, .cluster_size = 16, .terms = 1, .terms_per_tau = 16}),
                1.0, 1e-9);
  }
}

TEST(DegreesOfFreedomLaws, AreNeverMoreThanTheTermsAndGrowWithThem) {
  for (const auto noise : {NoiseType::kQuantization, NoiseType::kAngleRandomWalk,
                           NoiseType::kBiasInstability, NoiseType::kRateRandomWalk}) {
    for (const double m : {1.0, 4.0, 16.0, 27.0, 30.0, 1000.0}) {
      double before = 0.0;
      for (double terms = 1.0; terms < 1e6; terms = std::ceil(1.7 * terms)) {
        const double edf = equivalent_degrees_of_freedom(
            {.noise = noise, .cluster_size = m, .terms = terms, .terms_per_tau = m});
        EXPECT_LE(edf, terms * (1.0 + 1e-9));
        EXPECT_GE(edf, before * 0.97)
            << "m = " << m << ", terms = " << terms;  // pieces join within 3 %
        before = edf;
      }
    }
  }
}

// The design's claim for the cascade: a stride of tau/16 keeps 99.5 % of what full overlap gives.
TEST(DegreesOfFreedomLaws, AStrideOfASixteenthOfTauLosesNothingThatMatters) {
  for (const auto noise :
       {NoiseType::kAngleRandomWalk, NoiseType::kBiasInstability, NoiseType::kRateRandomWalk}) {
    const double m = 4096.0;
    const double r = 100.0;
    const double full = equivalent_degrees_of_freedom(
        {.noise = noise, .cluster_size = m, .terms = r * m, .terms_per_tau = m});
    const double cascade = equivalent_degrees_of_freedom(
        {.noise = noise, .cluster_size = m, .terms = r * 16, .terms_per_tau = 16});
    EXPECT_NEAR(cascade / full, 1.0, 0.005) << name(noise);
  }
}

// The six white-angle examples of the table: M / (35/18 - 1/r).
TEST(DegreesOfFreedomLaws, WhiteAngleHasItsClosedForm) {
  for (const double r : {3.0, 10.0, 500.0}) {
    const double edf = equivalent_degrees_of_freedom({.noise = NoiseType::kQuantization,
                                                      .cluster_size = 16,
                                                      .terms = 16 * r,
                                                      .terms_per_tau = 16});
    EXPECT_NEAR(edf, 16 * r / (35.0 / 18.0 - 1.0 / r), 1e-9 * edf);
  }
}

TEST(Bounds, EncloseTheDeviationAndNarrowWithTheDegreesOfFreedom) {
  double width = 1e300;
  for (const double edf : {1.0, 3.0, 10.0, 100.0, 1e4, 1e8}) {
    const Bounds b = deviation_bounds(2.0, edf, 0.95);
    EXPECT_LT(b.lower, 2.0);
    EXPECT_GT(b.upper, 2.0);
    EXPECT_LT(b.upper - b.lower, width);
    width = b.upper - b.lower;
  }
  EXPECT_NEAR(width, 2.0 * 2.0 * 1.96 / std::sqrt(2e8),
              1e-6);  // normal limit: s z / sqrt(2 edf) each side
}

}  // namespace
}  // namespace zerodrift::allan
