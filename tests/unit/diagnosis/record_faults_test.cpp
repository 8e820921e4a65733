// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/record_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kSize = 10'000;

MeasuredSeries white_series(std::uint64_t seed) {
  MeasuredSeries series;
  series.interval_s = 1.0;
  series.size = kSize;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1e-6);
  for (std::size_t i = 0; i < kSize; ++i) series.rate_radps[0].push_back(normal(random));
  series.valid[0].assign(kSize, 1);
  return series;
}

std::vector<std::string> names_of(const RecordFaults& faults) {
  std::vector<std::string> names;
  for (const NamedEffect& effect : faults.effects) names.push_back(effect.name);
  return names;
}

RecordFaults faults_of(const MeasuredSeries& series) {
  return find_record_faults(series, core::Axis::kX, series.rate_radps[0]);
}

TEST(RecordFaults, ASoundRecordHasNone) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    const MeasuredSeries series = white_series(seed);
    const RecordFaults faults = faults_of(series);
    EXPECT_TRUE(faults.effects.empty());
    EXPECT_EQ(faults.left_out, 0U);
    EXPECT_EQ(faults.sound, series.valid[0]);
  }
}

TEST(RecordFaults, SpikesAreCountedAndTakenOut) {
  MeasuredSeries series = white_series(1);
  for (const std::size_t i : {100U, 4000U, 9000U}) series.rate_radps[0][i] += 5e-5;
  const RecordFaults faults = faults_of(series);
  ASSERT_EQ(names_of(faults), (std::vector<std::string>{"spikes"}));
  EXPECT_NEAR(faults.effects[0].parameters.at("spikes_per_h"), 3.0 * 3600.0 / kSize, 1e-9);
  EXPECT_NEAR(faults.effects[0].parameters.at("deviation_deg_h"), 5e-5 * 206264.806, 0.6);
  EXPECT_EQ(std::count(faults.sound.begin(), faults.sound.end(), 0), 3);
}

TEST(RecordFaults, ASingleWildSampleIsLeftOutAndNoEffect) {
  for (const std::size_t place : {std::size_t{0}, std::size_t{5000}, kSize - 1}) {
    MeasuredSeries series = white_series(1);
    series.rate_radps[0][place] += 5e-5;
    const RecordFaults faults = faults_of(series);
    EXPECT_TRUE(faults.effects.empty());
    EXPECT_EQ(faults.left_out, 1U);
    EXPECT_EQ(faults.sound[place], 0);
    EXPECT_EQ(std::count(faults.sound.begin(), faults.sound.end(), 0), 1);
  }
}

// Before: spikes, P 1.00.
TEST(RecordFaults, NoiseThatGrowsIsNoSpikes) {
  for (const std::uint64_t seed : {6U, 7U, 8U}) {
    MeasuredSeries series = white_series(seed);
    for (std::size_t i = 0; i < kSize; ++i)
      series.rate_radps[0][i] *= std::exp(1.2 * std::sin(static_cast<double>(i) / 1500.0));
    EXPECT_TRUE(faults_of(series).effects.empty());
    series.rate_radps[0][3000] += 5e-5;
    series.rate_radps[0][8000] -= 5e-5;
    EXPECT_EQ(names_of(faults_of(series)), (std::vector<std::string>{"spikes"}));
  }
}

// Rule: one law with heavy tails thins out; a spike stands apart from it too. Before: spikes,
// P 1.00, of every record with Laplace's noise.
TEST(RecordFaults, NoiseWithHeavyTailsHasNoSpikesButThoseThatStandApart) {
  const auto laplace = [](std::mt19937_64& random) {
    const double size = std::exponential_distribution<double>(1.0)(random);
    return 1e-6 * (std::bernoulli_distribution(0.5)(random) ? size : -size);
  };
  const auto student = [](std::mt19937_64& random) {
    return 1e-6 * std::student_t_distribution<double>(6.0)(random);
  };
  const auto noise_that_swells = [](std::mt19937_64& random) {
    const double size = std::exp(std::normal_distribution<double>(0.0, 0.5)(random));
    return 1e-6 * size * std::normal_distribution<double>()(random);
  };
  int wild_records = 0;
  for (std::uint64_t seed = 20; seed < 40; ++seed) {
    for (const auto& law : {std::function<double(std::mt19937_64&)>(laplace),
                            std::function<double(std::mt19937_64&)>(student),
                            std::function<double(std::mt19937_64&)>(noise_that_swells)}) {
      MeasuredSeries series = white_series(seed);
      std::mt19937_64 random(seed);
      for (double& rate : series.rate_radps[0]) rate = law(random);
      if (!faults_of(series).effects.empty()) ++wild_records;
      for (const std::size_t i : {100U, 2500U, 4000U, 7000U, 9000U}) series.rate_radps[0][i] = 1e-4;
      EXPECT_EQ(names_of(faults_of(series)), (std::vector<std::string>{"spikes"})) << seed;
    }
  }
  // The largest two of 10 000 may stand apart by chance.
  EXPECT_LE(wild_records, 3) << "of 60";
}

// A coarse angle's rate is mostly right, and a step off, up or down, in a sample of eight.
TEST(RecordFaults, StepsOfACoarseAngleAreNoSpikes) {
  MeasuredSeries series = white_series(4);
  std::mt19937_64 random(4);
  std::bernoulli_distribution crosses(1.0 / 16.0);
  for (std::size_t i = 0; i + 1 < kSize; ++i) {
    if (!crosses(random)) continue;
    series.rate_radps[0][i] += 8e-6;
    series.rate_radps[0][i + 1] -= 8e-6;
  }
  EXPECT_TRUE(faults_of(series).effects.empty());
}

TEST(RecordFaults, ASlowHumpIsNoSpike) {
  MeasuredSeries series = white_series(1);
  for (std::size_t i = 0; i < kSize; ++i)
    series.rate_radps[0][i] +=
        1e-4 * std::exp(-std::pow((static_cast<double>(i) - 5000.0) / 500.0, 2.0));
  EXPECT_TRUE(faults_of(series).effects.empty());
}

TEST(RecordFaults, ClippingIsSeenAndAFewCoarseStepsAreNot) {
  MeasuredSeries series = white_series(1);
  for (double& rate : series.rate_radps[0]) rate = std::clamp(rate, -1e-6, 1e-6);
  const RecordFaults faults = faults_of(series);
  ASSERT_EQ(names_of(faults), (std::vector<std::string>{"saturation"}));
  EXPECT_NEAR(faults.effects[0].parameters.at("limit_deg_s"), 1e-6 * 57.29578, 1e-9);
  MeasuredSeries coarse = white_series(1);
  for (double& rate : coarse.rate_radps[0]) rate = 2e-6 * std::round(rate / 2e-6);
  EXPECT_TRUE(names_of(faults_of(coarse)).empty());
}

TEST(RecordFaults, ACoarseReadingHasNeitherSpikesNorLimits) {
  MeasuredSeries series = white_series(3);
  for (std::size_t i = 0; i < kSize; ++i) {  // many levels, most samples equal to their neighbours
    const double slow = 4e-5 * std::sin(static_cast<double>(i) / 700.0);
    series.rate_radps[0][i] = 3e-6 * std::round((slow + 0.5 * series.rate_radps[0][i]) / 3e-6);
  }
  EXPECT_TRUE(names_of(faults_of(series)).empty());
}

TEST(RecordFaults, AFineModelBesideACoarseReadingMakesNoSpikes) {
  constexpr double kStep = 1e-5;  // ten times the noise: most readings are equal
  MeasuredSeries series = white_series(5);
  std::vector<double> residual(kSize);
  for (std::size_t i = 0; i < kSize; ++i) {
    const double drift = 4e-5 * std::sin(static_cast<double>(i) / 700.0);
    double& rate = series.rate_radps[0][i];
    rate = kStep * std::round((drift + 0.1 * rate) / kStep);
    residual[i] =
        rate - kStep * std::round(drift / kStep) - 1e-9 * std::sin(0.1 * static_cast<double>(i));
  }
  EXPECT_TRUE(names_of(find_record_faults(series, core::Axis::kX, residual)).empty());
}

TEST(RecordFaults, AStepOfSomeSecondsIsNoSpike) {
  MeasuredSeries series = white_series(4);
  for (const std::size_t begin : {1000U, 5000U, 8000U}) {
    for (std::size_t i = begin; i < begin + 5; ++i) series.rate_radps[0][i] += 5e-5;
  }
  EXPECT_TRUE(names_of(faults_of(series)).empty());
}

TEST(RecordFaults, LostSamplesAreAnEffectAndAnOutageIsNot) {
  MeasuredSeries series = white_series(1);
  for (std::size_t i = 2000; i < 2600; ++i) series.valid[0][i] = 0;
  EXPECT_TRUE(faults_of(series).effects.empty());
  for (const std::size_t i : {10U, 500U, 3000U, 7000U}) series.valid[0][i] = 0;
  const RecordFaults faults = faults_of(series);
  ASSERT_EQ(names_of(faults), (std::vector<std::string>{"dropped_samples"}));
  EXPECT_NEAR(faults.effects[0].parameters.at("share"), 4.0 / kSize, 1e-12);
}

// A sample a second, stamped `jitter_s` off at most, on a grid of the period that a median of its
// spacings gives; `is_lost` tells which never came.
MeasuredSeries jittered(double jitter_s, const std::function<bool(std::size_t)>& is_lost) {
  SeriesBuilder builder({.sample_period_s = 0.988, .grid_interval_s = 0.988});
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> late_s(-jitter_s, jitter_s);
  std::normal_distribution<double> normal(0.0, 1e-6);
  for (std::size_t i = 0; i < kSize; ++i) {
    MeasuredRow row;
    row.time_s = static_cast<double>(i) + late_s(random);
    row.rate_radps[0] = normal(random);
    if (!is_lost(i)) builder.add(row);
  }
  return builder.finish();
}

// Rule: stamps that jitter leave intervals of a grid empty, and no sample is lost by that. Before:
// it was "certain" that samples were dropped.
TEST(RecordFaults, StampsThatJitterLoseNothing) {
  for (const double jitter_s : {0.0, 0.1, 0.2}) {
    const MeasuredSeries sound = jittered(jitter_s, [](std::size_t) { return false; });
    EXPECT_GT(std::count(sound.valid[0].begin(), sound.valid[0].end(), 0), 100);
    EXPECT_TRUE(names_of(faults_of(sound)).empty()) << jitter_s;
    const MeasuredSeries lossy = jittered(jitter_s, [](std::size_t i) { return i % 97 == 50; });
    const RecordFaults faults = faults_of(lossy);
    ASSERT_EQ(names_of(faults), (std::vector<std::string>{"dropped_samples"})) << jitter_s;
    EXPECT_NEAR(faults.effects[0].parameters.at("share"), 1.0 / 97, 0.3 / 97) << jitter_s;
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
