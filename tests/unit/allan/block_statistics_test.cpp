// SPDX-License-Identifier: Apache-2.0
#include "common/allan/block_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace zerodrift::allan {
namespace {

struct Reference {
  std::vector<double> means;
  std::vector<double> steps;  // from a block to the one just after it

  [[nodiscard]] BlockMoments moments() const {
    BlockMoments m;
    m.blocks = means.size();
    for (const double x : means) m.mean += x / static_cast<double>(means.size());
    double squares = 0.0;
    for (const double x : means) squares += (x - m.mean) * (x - m.mean);
    if (means.size() > 1)
      m.standard_deviation = std::sqrt(squares / static_cast<double>(means.size() - 1));
    for (const double step : steps) m.step_rms += step * step / static_cast<double>(steps.size());
    m.step_rms = std::sqrt(m.step_rms);
    m.steps = steps.size();
    return m;
  }
};

// Means of the blocks of which four fifths of the samples are there; NaN is a missing sample.
Reference brute_force(const std::vector<double>& samples, std::size_t block,
                      std::size_t first_block) {
  Reference r;
  double last = NAN;
  for (std::size_t b = first_block; (b + 1) * block <= samples.size(); ++b) {
    double sum = 0.0;
    std::size_t there = 0;
    for (std::size_t i = 0; i < block; ++i) {
      if (!std::isfinite(samples[b * block + i])) continue;
      sum += samples[b * block + i];
      ++there;
    }
    if (static_cast<double>(there) < 0.8 * static_cast<double>(block)) {
      last = NAN;
      continue;
    }
    r.means.push_back(sum / static_cast<double>(there));
    if (!std::isnan(last)) r.steps.push_back(r.means.back() - last);
    last = r.means.back();
  }
  return r;
}

void expect_equal(const BlockMoments& got, const BlockMoments& expected) {
  EXPECT_EQ(got.blocks, expected.blocks);
  if (expected.blocks == 0) return;
  EXPECT_NEAR(got.mean, expected.mean, 1e-12);  // values of order 1: rounding only
  EXPECT_NEAR(got.standard_deviation, expected.standard_deviation, 1e-12);
}

TEST(BlockStatisticsLaws, EqualBruteForceOverRandomGaps) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const std::size_t block = 1 + random() % 20;
    const std::size_t window_blocks = 1 + random() % 12;
    BlockStatistics statistics({.sample_interval_s = 0.5,
                                .block_s = 0.5 * static_cast<double>(block),
                                .window_s = 0.5 * static_cast<double>(block * window_blocks)});
    std::vector<double> samples;
    std::uniform_real_distribution<double> value(-1.0, 1.0);
    while (samples.size() < 2000) {
      if (random() % 25 == 0) {
        const std::size_t missing = random() % (3 * block * (random() % 8 == 0 ? 10 : 1));
        statistics.gap(missing);
        samples.insert(samples.end(), missing, std::numeric_limits<double>::quiet_NaN());
      } else {
        samples.push_back(random() % 50 == 0 ? std::numeric_limits<double>::infinity()
                                             : value(random));
        statistics.add(samples.back());
      }
      const std::size_t complete = samples.size() / block;
      const std::size_t first = complete > window_blocks ? complete - window_blocks : 0;
      const BlockMoments all = brute_force(samples, block, 0).moments();
      expect_equal(statistics.moments(Span::kSinceStart), all);
      EXPECT_NEAR(statistics.moments(Span::kSinceStart).step_rms, all.step_rms, 1e-12);
      expect_equal(statistics.moments(Span::kRolling),
                   brute_force(samples, block, first).moments());
    }
  }
}

TEST(BlockStatisticsLaws, WhiteNoiseAveragesOut) {
  constexpr std::uint64_t kSeed = 5;
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> noise(3.0, 1.0);
  BlockStatistics statistics({.sample_interval_s = 0.01, .block_s = 1.0, .window_s = 1000.0});
  for (int i = 0; i < 100000; ++i) statistics.add(noise(random));
  const BlockMoments m = statistics.moments(Span::kRolling);
  EXPECT_EQ(m.blocks, 1000u);
  EXPECT_NEAR(m.mean, 3.0, 5.0 / std::sqrt(1e5)) << "seed " << kSeed;  // 5 sigma
  EXPECT_NEAR(m.standard_deviation, 0.1, 5.0 * 0.1 / std::sqrt(2000.0))
      << "seed " << kSeed;  // 5 sigma
}

TEST(BlockStatisticsAbuse, HugeGapsAreBounded) {
  BlockStatistics statistics({.sample_interval_s = 1.0, .block_s = 10.0, .window_s = 100.0});
  for (int i = 0; i < 105; ++i) statistics.add(1.0);
  statistics.gap(std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(statistics.moments(Span::kRolling).blocks, 0u);
  EXPECT_EQ(statistics.moments(Span::kSinceStart).blocks, 10u);
  for (int i = 0; i < 30; ++i) statistics.add(2.0);
  EXPECT_GE(statistics.moments(Span::kRolling).blocks, 2u);
  EXPECT_EQ(statistics.moments(Span::kRolling).mean, 2.0);
}

TEST(BlockStatisticsAbuse, WrongOptionsAreNamed) {
  EXPECT_NE(BlockStatisticsOptions{.sample_interval_s = 0.0}.validate()->find("sample_interval_s"),
            std::string::npos);
  EXPECT_NE(BlockStatisticsOptions{.block_s = 0.001}.validate()->find("block_s"),
            std::string::npos);
  EXPECT_NE(BlockStatisticsOptions{.window_s = 1.0}.validate()->find("window_s"),
            std::string::npos);
  EXPECT_FALSE(BlockStatisticsOptions{}.validate());
  EXPECT_THROW(BlockStatistics(BlockStatisticsOptions{.window_s = std::nan("")}),
               std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::allan
