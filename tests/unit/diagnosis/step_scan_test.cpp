// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/step_scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/diagnosis/cosine_transform.h"
#include "common/diagnosis/noise_weight.h"
#include "common/twin/random.h"

namespace zerodrift::diagnosis {
namespace {

using Values = std::vector<double>;

Values white(std::size_t n) {
  return Values(n, 4.0);
}

Values white_and_walk(std::size_t n) {
  Values variances(n, 1.0);
  for (std::size_t k = 1; k < n; ++k) variances[k] += 0.01 / laplacian_eigenvalue(k, n);
  return variances;
}

Values step(std::size_t n, std::size_t first_after, double height) {
  Values series(n, 0.0);
  std::fill(series.begin() + static_cast<std::ptrdiff_t>(first_after), series.end(), height);
  return series;
}

// r' C^-1 s, both about their mean, without the scan's sums.
double product(const Values& r, const Values& s, const Values& variances) {
  const Eigen::VectorXd a = CosineTransform(r.size()).forward(r);
  const Eigen::VectorXd b = CosineTransform(s.size()).forward(s);
  double sum = 0.0;
  for (std::size_t k = 1; k < r.size(); ++k)
    sum += a(static_cast<Eigen::Index>(k)) * b(static_cast<Eigen::Index>(k)) / variances[k];
  return sum;
}

TEST(StepScanLaws, ThePlaceIsTheOneThatGainsMostOfAllThatAreEvaluatedOneByOne) {
  constexpr std::size_t kSize = 600;
  for (const Values& variances : {white(kSize), white_and_walk(kSize)}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const twin::NoiseStream noise(seed, "step scan");
      Values series(kSize);
      for (std::size_t i = 0; i < kSize; ++i) series[i] = noise.gaussian(i);
      const StepPlaces found = step_places(divided_by_noise(series, variances), variances, 1);
      std::size_t best = 0;
      double most = 0.0;
      for (std::size_t k = kSize / 50; k < kSize - kSize / 50; ++k) {
        const Values unit = step(kSize, k, 1.0);
        const double along = product(series, unit, variances);
        const double gain = along * along / product(unit, unit, variances);
        if (gain > most) {
          most = gain;
          best = k;
        }
      }
      ASSERT_EQ(found.first_after.size(), 1U);
      EXPECT_EQ(found.first_after[0], best) << seed;
    }
  }
}

TEST(StepScanScenario, AStepAloneIsFoundExactlyInEachKindOfNoise) {
  constexpr std::size_t kSize = 5000;
  for (const Values& variances : {white(kSize), white_and_walk(kSize)}) {
    for (const std::size_t place : {101U, 2500U, 4890U}) {
      const StepPlaces found =
          step_places(divided_by_noise(step(kSize, place, -0.7), variances), variances, 6);
      ASSERT_FALSE(found.first_after.empty());
      EXPECT_EQ(found.first_after[0], place);
    }
  }
}

TEST(StepScanScenario, PlacesAreApartAndAwayFromTheEnds) {
  constexpr std::size_t kSize = 1000;
  Values series = step(kSize, 300, 1.0);
  for (std::size_t i = 700; i < kSize; ++i) series[i] -= 2.0;
  const auto places =
      step_places(divided_by_noise(series, white(kSize)), white(kSize), 6).first_after;
  EXPECT_EQ(places.size(), 6U);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_GE(places[i], kSize / 50);
    EXPECT_LT(places[i], kSize - kSize / 50);
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT(std::max(places[i], places[j]) - std::min(places[i], places[j]), kSize / 50);
  }
  EXPECT_EQ(places[0], 700U);
}

TEST(StepScanAbuse, NothingIsFoundWhereNothingIs) {
  EXPECT_TRUE(step_places({}, {}, 6).first_after.empty());
  EXPECT_TRUE(step_places(Values(99, 1.0), white(99), 6).first_after.empty());
  EXPECT_TRUE(step_places(Values(500, 0.0), white(500), 6).first_after.empty());
  EXPECT_TRUE(step_places(Values(500, 0.0), Values(500, 0.0), 6).first_after.empty());
}

}  // namespace
}  // namespace zerodrift::diagnosis
