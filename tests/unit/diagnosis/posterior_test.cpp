// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/posterior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace zerodrift::diagnosis {
namespace {

constexpr double kOut = -std::numeric_limits<double>::infinity();

TEST(PosteriorLaws, SumToWhatTheListedExplanationsShareAndKeepTheirOrder) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> evidence(-50.0, 3000.0);
  const SearchOptions options;
  for (int round = 0; round < 200; ++round) {
    std::vector<double> nats(1 + random() % 40);
    for (double& value : nats) value = random() % 5 == 0 ? kOut : evidence(random);
    nats.front() = evidence(random);
    double best = evidence(random);
    for (const double value : nats) best = std::max(best, value);
    const auto p = probabilities(nats, best, options);
    ASSERT_EQ(p.size(), nats.size());
    EXPECT_NEAR(std::accumulate(p.begin(), p.end(), 0.0), 1.0 - options.unlisted_share, 1e-12);
    for (std::size_t i = 0; i < p.size(); ++i) {
      EXPECT_GE(p[i], 0.0);
      EXPECT_TRUE(nats[i] != kOut || p[i] == 0.0);
      for (std::size_t j = 0; j < p.size(); ++j) EXPECT_TRUE(nats[i] <= nats[j] || p[i] >= p[j]);
    }
  }
}

TEST(PosteriorLaws, NothingIsSurerThanThatItIsListedAtAll) {
  const SearchOptions options;
  EXPECT_EQ(probabilities(std::vector{1e6}, 1e6, options).front(), 1.0 - options.unlisted_share);
  EXPECT_EQ(probabilities(std::vector{kOut, kOut}, 3.0, options), (std::vector{0.0, 0.0}));
  EXPECT_TRUE(probabilities({}, kOut, options).empty());
}

// Two explanations, one of which leaves r of what the other explains: by the formula of the header.
TEST(PosteriorOracle, ARemainderIsAForm) {
  SearchOptions options;
  options.mismatch_freedom = 4.0;
  options.unlisted_share = 0.05;
  const auto p = probabilities(std::vector{100.0, 92.0}, 100.0, options);
  EXPECT_NEAR(p[1] / p[0], std::pow(1.0 + 16.0 / 4.0, -2.5), 1e-12);
  // Where both leave much of what a function of no name explains, they differ by less.
  const auto both = probabilities(std::vector{100.0, 92.0}, 200.0, options);
  EXPECT_NEAR(both[1] / both[0], std::pow((1.0 + 216.0 / 4.0) / (1.0 + 200.0 / 4.0), -2.5), 1e-12);
}

}  // namespace
}  // namespace zerodrift::diagnosis
