// SPDX-License-Identifier: Apache-2.0
// The processes are made here, by other generators than the twin's.
#include "common/diagnosis/two_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kSamples = 18000;  // five hours, 1 Hz
constexpr double kWhite = 0.06;
constexpr double kWalk = 1.7e-4;  // a second
constexpr double kSigma = 0.05;
constexpr double kTauS = 300.0;

struct Made {
  std::vector<double> series = std::vector<double>(kSamples);
  std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(kSamples, 1);
  double time_up_s = 0.0;
  double switches = 0.0;  // as often up as down, but for one
};

void add_background(Made& made, std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  double bias = 0.3;
  for (double& value : made.series) {
    bias += kWalk * gauss(random);
    value += bias + kWhite * gauss(random);
  }
}

Made wandering(std::uint64_t seed, double often = 1.0, double seldom = 1.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  Made made;
  const double memory = std::exp(-1.0 / kTauS);
  double course = kSigma * gauss(random);
  for (double& value : made.series) {
    const auto i = static_cast<std::size_t>(&value - made.series.data());
    value = course * (i % 6000 < 2000 ? seldom : often);
    course = memory * course + kSigma * std::sqrt(1.0 - memory * memory) * gauss(random);
  }
  add_background(made, random);
  return made;
}

Made switching(std::uint64_t seed, double amplitude, double up_s, double down_s) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> dwell;
  Made made;
  bool up = seed % 2 == 0;
  double left_s = dwell(random) * (up ? up_s : down_s);
  for (double& value : made.series) {
    value = up ? 0.5 * amplitude : -0.5 * amplitude;
    made.time_up_s += up ? 1.0 : 0.0;
    left_s -= 1.0;
    if (left_s > 0.0) continue;
    up = !up;
    made.switches += 1.0;
    left_s = dwell(random) * (up ? up_s : down_s);
  }
  add_background(made, random);
  return made;
}

double nats_for_switching(const Made& made) {
  const auto blocks = course_blocks(made.series, made.valid, 1.0, kTauS);
  return fit_switching(blocks, kSigma, kTauS).log_likelihood -
         fit_wandering(blocks, kSigma, kTauS).log_likelihood;
}

TEST(TwoLevelsScenario, LikelihoodsTellSwitchingFromWanderingOfTheSameSpectrum) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EXPECT_GT(nats_for_switching(switching(seed, 2.0 * kSigma, 2.0 * kTauS, 2.0 * kTauS)), 20.0);
    EXPECT_LT(nats_for_switching(wandering(seed)), 0.0) << seed;
  }
}

TEST(TwoLevelsScenario, WanderingOfChangingStrengthIsNoSwitching) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    EXPECT_LT(nats_for_switching(wandering(seed, 0.3, 2.0)), 0.0) << seed;
}

TEST(TwoLevelsScenario, TheLevelsAndTheirTimesAreRecovered) {
  const Made made = switching(4, 0.1, 900.0, 450.0);
  const auto blocks = course_blocks(made.series, made.valid, 1.0, kTauS);
  const SwitchingFit fit = fit_switching(blocks, kSigma, kTauS);
  EXPECT_NEAR(fit.amplitude_radps, 0.1, 0.005);
  // Of the times that this record has, not of their expectation; one dwell of each kind may be cut.
  const double each = made.switches / 2.0;
  EXPECT_NEAR(std::log(fit.up_s * each / made.time_up_s), 0.0, 2.0 / each);
  EXPECT_NEAR(std::log(fit.down_s * each / (kSamples - made.time_up_s)), 0.0, 2.0 / each);
}

TEST(TwoLevelsScenario, WanderingIsRecoveredBesideAWalk) {
  double log_sigma = 0.0;
  constexpr int kSeeds = 6;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Made made = wandering(seed);
    const auto fit =
        fit_wandering(course_blocks(made.series, made.valid, 1.0, kTauS), kSigma, kTauS);
    log_sigma += std::log(fit.sigma_radps / kSigma) / kSeeds;
  }
  // 30 correlation times a record: 1/sqrt(2 30) each, three times that over six.
  EXPECT_NEAR(log_sigma, 0.0, 0.16);
}

TEST(TwoLevelsLaws, MissingSamplesAndOtherUnitsChangeNothingElse) {
  Made made = switching(2, 0.1, 600.0, 600.0);
  const double whole = nats_for_switching(made);
  for (std::size_t i = 0; i < kSamples; ++i) {
    const bool missing = i % 7 == 0 || (i > 9000 && i < 9500);
    if (missing) made.valid[i] = 0;
    if (missing) made.series[i] = std::nan("");
  }
  EXPECT_NEAR(nats_for_switching(made) / whole, 1.0, 0.2);
  Made other = switching(2, 0.1, 600.0, 600.0);
  for (double& value : other.series) value *= 1e-6;
  const auto blocks = course_blocks(other.series, other.valid, 1.0, kTauS);
  const double scaled = fit_switching(blocks, 1e-6 * kSigma, kTauS).log_likelihood -
                        fit_wandering(blocks, 1e-6 * kSigma, kTauS).log_likelihood;
  EXPECT_NEAR(scaled, whole, 1e-6 * std::abs(whole));
}

TEST(TwoLevelsAbuse, WhatHasNoSpreadOrNoSampleGivesNumbers) {
  for (const bool empty : {false, true}) {
    Made made;
    if (empty) made.valid.assign(kSamples, 0);
    const auto blocks = course_blocks(made.series, made.valid, 1.0, kTauS);
    EXPECT_FALSE(std::isnan(fit_switching(blocks, kSigma, kTauS).log_likelihood)) << empty;
    EXPECT_FALSE(std::isnan(fit_wandering(blocks, kSigma, kTauS).log_likelihood)) << empty;
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
