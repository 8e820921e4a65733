// SPDX-License-Identifier: Apache-2.0
#include "common/twin/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace zerodrift::twin {
namespace {

TEST(InverseNormalGolden, MatchesTabulatedQuantiles) {
  // Quantiles of the standard normal to 15 digits; the algorithm claims 1e-16 relative.
  EXPECT_NEAR(inverse_normal(0.975), 1.959963984540054, 1e-14);
  EXPECT_NEAR(inverse_normal(0.001), -3.090232306167813, 1e-14);
  EXPECT_DOUBLE_EQ(inverse_normal(0.5), 0.0);
  // Far tail (r > 5), against the distribution function itself.
  const double far = inverse_normal(1e-15);
  EXPECT_NEAR(0.5 * std::erfc(-far / std::sqrt(2.0)) / 1e-15, 1.0, 1e-12);
}

TEST(NoiseStreamLaws, MomentsAreThoseOfTheStandardNormal) {
  constexpr std::uint64_t kCount = 1'000'000;
  const NoiseStream stream(42, "moments");
  double sum = 0.0;
  double squares = 0.0;
  double fourth = 0.0;
  double neighbours = 0.0;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const double g = stream.gaussian(i);
    sum += g;
    squares += g * g;
    fourth += g * g * g * g;
    neighbours += g * stream.gaussian(i + 1);
  }
  const double n = kCount;
  // 5 sigma of the sampling errors 1/√n, √(2/n), √(96/n), 1/√n.
  EXPECT_NEAR(sum / n, 0.0, 5.0 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1.0, 5.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(fourth / n, 3.0, 5.0 * std::sqrt(96.0 / n));
  EXPECT_NEAR(neighbours / n, 0.0, 5.0 / std::sqrt(n));
}

TEST(NoiseStreamLaws, StreamsOfOtherSeedNameOrNumberAreUncorrelated) {
  constexpr std::uint64_t kCount = 200'000;
  const NoiseStream base(1, "a");
  const NoiseStream others[] = {NoiseStream(2, "a"), NoiseStream(1, "b"), base.substream(0),
                                base.substream(1)};
  for (const NoiseStream& other : others) {
    double product = 0.0;
    for (std::uint64_t i = 0; i < kCount; ++i) product += base.gaussian(i) * other.gaussian(i);
    // 5 sigma of the sampling error 1/√n.
    EXPECT_NEAR(product / kCount, 0.0, 5.0 / std::sqrt(static_cast<double>(kCount)));
  }
}

}  // namespace
}  // namespace zerodrift::twin
