// SPDX-License-Identifier: Apache-2.0
// A sample's weight scales its box constraint: C_i = weight_i C.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "common/regression/online_svr.h"
#include "tests/support/state_bytes.h"
#include "tests/unit/regression/qp_oracle.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

using zerodrift::testing::read_state;
using zerodrift::testing::state_of;

constexpr std::uint64_t kSeed = 41;

// Weights over four decades, and every fourth exactly 1.
std::vector<double> draw_weights(std::size_t count) {
  std::mt19937_64 engine(kSeed);
  std::uniform_real_distribution<double> decades(-4.0, 0.0);
  std::vector<double> weights;
  for (std::size_t i = 0; i < count; ++i) {
    weights.push_back(i % 4 == 0 ? 1.0 : std::pow(10.0, decades(engine)));
  }
  return weights;
}

TEST(WeightLaws, WeightsOfOneGiveTheModelWithoutWeightsToTheBit) {
  for (const RecordKind kind : kAllRecordKinds) {
    OnlineSvr given(options_of(2, 50, 10.0)), omitted(options_of(2, 50, 10.0));
    for (const Sample& sample : RecordGenerator(kind, 2, kSeed).take(200)) {
      const UpdateReport a = given.add(sample.x, sample.y, 1.0);
      const UpdateReport b = omitted.add(sample.x, sample.y);
      ASSERT_EQ(a.events, b.events) << name(kind);
      ASSERT_EQ(a.prior_residual, b.prior_residual) << name(kind);
    }
    EXPECT_EQ(state_of(given), state_of(omitted)) << name(kind);
  }
}

// One weight for all is another C. The weights are powers of two, so that both have the same box
// constraints to the bit.
TEST(WeightLaws, OneWeightForAllIsTheModelOfASmallerC) {
  for (const double weight : {0.5, 0.125}) {
    // C of 1 at most: the bound on KKT violations, and with it the targets' jitter, is the same.
    OnlineSvr weighted(options_of(2, 50, 1.0)), smaller(options_of(2, 50, weight));
    for (const Sample& sample : RecordGenerator(RecordKind::kJumps, 2, kSeed).take(200)) {
      weighted.add(sample.x, sample.y, weight);
      smaller.add(sample.x, sample.y);
      ASSERT_EQ(weighted.predict(sample.x), smaller.predict(sample.x)) << weight;
    }
  }
}

TEST(WeightLaws, EverySampleSatisfiesKktWhileLearningAndForgettingInAnyOrder) {
  for (const RecordKind kind : kAllRecordKinds) {
    for (const double c : {0.5, 10.0, 1000.0}) {
      const auto record = RecordGenerator(kind, 2, kSeed).take(60);
      const auto weights = draw_weights(60);
      std::vector<std::size_t> slots;
      OnlineSvr svr(options_of(2, 60, c));
      const auto expect_optimal = [&](const char* doing, std::size_t step) {
        ASSERT_LE(svr.max_kkt_violation(), svr.options().kkt_bound())
            << doing << " " << name(kind) << " C " << c << " step " << step << " seed " << kSeed;
        ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr));
      };
      for (std::size_t i = 0; i < record.size(); ++i) {
        slots.push_back(svr.add(record[i].x, record[i].y, weights[i]).slot);
        ASSERT_NO_FATAL_FAILURE(expect_optimal("learning", i));
        ASSERT_LE(std::fabs(svr.theta(slots.back())), weights[i] * c);
      }
      std::mt19937_64 engine(kSeed);
      std::shuffle(slots.begin(), slots.end(), engine);
      for (std::size_t i = 0; i < slots.size(); ++i) {
        ASSERT_EQ(svr.forget(slots[i]).outcome, UpdateOutcome::kForgotten);
        ASSERT_NO_FATAL_FAILURE(expect_optimal("forgetting", i));
      }
    }
  }
}

TEST(WeightLaws, AnOutlierPullsWithItsWeightTimesC) {
  for (const double weight : {1.0, 0.3, 0.01}) {
    OnlineSvr svr(options_of(1, 30, 10.0));
    for (int i = 0; i < 20; ++i) svr.add(std::vector<double>{0.1 * i - 1.0}, 0.0);
    const UpdateReport report = svr.add(std::vector<double>{0.0}, 50.0, weight);
    EXPECT_EQ(svr.set_of(report.slot), SampleSet::kError);
    EXPECT_EQ(svr.theta(report.slot), weight * 10.0);
    EXPECT_EQ(svr.weight(report.slot), weight);
  }
}

// The price of both together is that of one.
TEST(WeightLaws, TwoIdenticalSamplesOfHalfTheWeightAreOne) {
  OnlineSvr whole(options_of(2, 80, 10.0)), halves(options_of(2, 80, 10.0));
  RecordGenerator record(RecordKind::kJumps, 2, kSeed);
  for (const Sample& sample : record.take(40)) {
    whole.add(sample.x, sample.y);
    halves.add(sample.x, sample.y, 0.5);
    halves.add(sample.x, sample.y, 0.5);
  }
  for (const Sample& probe : record.take(100)) {
    // The jitter of the targets (1e-12 at C = 10) times the condition of the margin set, below 1e2.
    ASSERT_NEAR(whole.predict(probe.x), halves.predict(probe.x), 1e-10) << "seed " << kSeed;
  }
}

struct Case {
  KernelKind kernel;
  RecordKind record;
  double c;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << name(c.kernel) << " " << name(c.record) << " C " << c.c << " seed " << kSeed;
}

class WeightOracleTest : public ::testing::TestWithParam<Case> {};

TEST_P(WeightOracleTest, OnlineModelEqualsTheWeightedBatchOptimumOfItsWindow) {
  constexpr std::size_t kCapacity = 50;
  constexpr double kTolerance = 1e-9;  // the promise; where it comes from: oracle_test.cpp
  const Case& c = GetParam();
  const OnlineSvrOptions options = options_of(2, kCapacity, c.c, c.kernel);
  const auto record = RecordGenerator(c.record, 2, kSeed).take(3 * kCapacity);
  const auto weights = draw_weights(record.size());
  OnlineSvr svr(options);
  for (std::size_t i = 0; i < record.size(); ++i) svr.add(record[i].x, record[i].y, weights[i]);

  const auto first = static_cast<std::ptrdiff_t>(record.size() - kCapacity);
  const std::vector<Sample> window(record.begin() + first, record.end());
  const std::vector<double> window_weights(weights.begin() + first, weights.end());
  const OracleModel oracle = solve_batch(options, window, 1e-12, window_weights);
  ASSERT_TRUE(oracle.converged);
  EXPECT_GE(svr.bias(), oracle.lowest_bias - kTolerance);
  EXPECT_LE(svr.bias(), oracle.highest_bias + kTolerance);
  double largest = 0.0;
  RecordGenerator probes(RecordKind::kSmooth, 2, kSeed + 1);
  for (const Sample& probe : probes.take(300)) {
    const double expansion = svr.predict(probe.x) - svr.bias();
    largest = std::max(largest, std::fabs(expansion - oracle.expansion(probe.x)));
  }
  EXPECT_LE(largest, kTolerance);
  EXPECT_LE(svr.max_kkt_violation(), options.kkt_bound());
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const KernelKind kernel : kAllKernelKinds) {
    for (const RecordKind record : kAllRecordKinds) {
      for (const double c : {1.0, 10.0, 100.0}) all.push_back({kernel, record, c});
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(KernelsAndRecords, WeightOracleTest, ::testing::ValuesIn(cases()));

TEST(WeightLaws, AResumedLearnerContinuesToTheBit) {
  for (const RecordKind kind : kAllRecordKinds) {
    const OnlineSvrOptions options = options_of(2, 40, 10.0);
    const auto record = RecordGenerator(kind, 2, kSeed).take(200);
    const auto weights = draw_weights(record.size());
    OnlineSvr original(options);
    for (std::size_t i = 0; i < 100; ++i) original.add(record[i].x, record[i].y, weights[i]);
    OnlineSvr resumed(options);
    ASSERT_TRUE(read_state(resumed, state_of(original)));
    for (std::size_t i = 100; i < record.size(); ++i) {
      const UpdateReport a = original.add(record[i].x, record[i].y, weights[i]);
      const UpdateReport b = resumed.add(record[i].x, record[i].y, weights[i]);
      ASSERT_EQ(a.events, b.events) << name(kind);
      ASSERT_EQ(original.predict(record[i].x), resumed.predict(record[i].x)) << name(kind);
    }
    EXPECT_EQ(state_of(original), state_of(resumed)) << name(kind);
  }
}

TEST(WeightAbuse, WeightsOutsideZeroToOneAreRefusedAndChangeNothing) {
  OnlineSvr svr(options_of(1, 10, 10.0));
  svr.add(std::vector<double>{0.1}, 1.0);
  const std::string before = state_of(svr);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double weight :
       {0.0, -0.5, 1.0 + 1e-15, 2.0, 5e-324, std::nan(""), kInfinity, -kInfinity}) {
    EXPECT_EQ(svr.add(std::vector<double>{0.2}, 2.0, weight).outcome, UpdateOutcome::kRefused)
        << weight;
  }
  EXPECT_EQ(state_of(svr), before);
}

// Down to where weight x C leaves the range of normal numbers.
TEST(WeightAbuse, TheSmallestWeightsLeaveTheModelSound) {
  for (const double weight : {1e-12, 1e-18, 1e-100, 1e-300}) {
    for (const double c : {0.1, 10.0}) {
      const OnlineSvrOptions options = options_of(2, 40, c);
      OnlineSvr svr(options);
      int i = 0;
      for (const Sample& sample : RecordGenerator(RecordKind::kJumps, 2, kSeed).take(300)) {
        const UpdateReport report = svr.add(sample.x, sample.y, i++ % 3 == 0 ? weight : 1.0);
        ASSERT_TRUE(report.outcome == UpdateOutcome::kLearned ||
                    report.outcome == UpdateOutcome::kFitsAlready)
            << weight << " C " << c << " step " << i;
        ASSERT_LE(svr.max_kkt_violation(), options.kkt_bound()) << weight << " step " << i;
        ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr));
      }
    }
  }
}

}  // namespace
}  // namespace zerodrift::regression::testing
