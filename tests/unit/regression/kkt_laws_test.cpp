// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/regression/online_svr.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

constexpr std::uint64_t kSeed = 11;

// f moves by about as much as the targets' jitter (1e-13 max(1, C)) times the condition of the
// margin set, below 1e3 here.
double model_tolerance(double c) {
  return 1e-10 * std::max(1.0, c);
}

double largest_difference(const OnlineSvr& a, const OnlineSvr& b, std::size_t dimension) {
  double largest = 0.0;
  RecordGenerator points(RecordKind::kSmooth, dimension, kSeed + 1);
  for (const Sample& point : points.take(200)) {
    largest = std::max(largest, std::fabs(a.predict(point.x) - b.predict(point.x)));
  }
  return largest;
}

TEST(KktLaws, EverySampleSatisfiesKktAfterAnyInsertOrder) {
  for (const RecordKind kind : kAllRecordKinds) {
    for (const double c : {0.5, 10.0, 1000.0}) {
      auto record = RecordGenerator(kind, 2, kSeed).take(60);
      std::mt19937_64 engine(kSeed);
      for (int order = 0; order < 5; ++order) {
        OnlineSvr svr(options_of(2, 60, c));
        for (const Sample& sample : record) {
          svr.add(sample.x, sample.y);
          ASSERT_LE(svr.max_kkt_violation(), svr.options().kkt_bound())
              << name(kind) << " C " << c << " order " << order << " seed " << kSeed;
          ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr));
        }
        const SetCounts counts = svr.set_counts();
        EXPECT_EQ(counts.remaining + counts.margin + counts.error, record.size());
        EXPECT_EQ(counts.pending, 0u);
        std::shuffle(record.begin(), record.end(), engine);
      }
    }
  }
}

TEST(KktLaws, TheModelDoesNotDependOnTheInsertOrder) {
  for (const KernelKind kernel : {KernelKind::kRbf, KernelKind::kMatern52}) {
    auto record = RecordGenerator(RecordKind::kSmooth, 2, kSeed).take(80);
    OnlineSvr forward(options_of(2, 80, 10.0, kernel)), backward(options_of(2, 80, 10.0, kernel));
    for (const Sample& sample : record) forward.add(sample.x, sample.y);
    std::reverse(record.begin(), record.end());
    for (const Sample& sample : record) backward.add(sample.x, sample.y);
    ASSERT_GT(forward.set_counts().margin, 0u);  // else the bias is not unique
    EXPECT_LE(largest_difference(forward, backward, 2), model_tolerance(10.0)) << name(kernel);
  }
}

TEST(KktLaws, AddThenForgetRestoresTheModel) {
  for (const double c : {1.0, 10.0, 100.0}) {
    OnlineSvr svr(options_of(2, 100, c)), before(options_of(2, 100, c));
    RecordGenerator record(RecordKind::kSmooth, 2, kSeed);
    for (const Sample& sample : record.take(60)) {
      svr.add(sample.x, sample.y);
      before.add(sample.x, sample.y);
    }
    std::vector<std::size_t> slots;
    for (const Sample& sample : record.take(40))
      slots.push_back(svr.add(sample.x, sample.y + 0.2).slot);
    EXPECT_GT(largest_difference(svr, before, 2), 0.01);
    for (const std::size_t slot : slots) {
      ASSERT_EQ(svr.forget(slot).outcome, UpdateOutcome::kForgotten);
      ASSERT_LE(svr.max_kkt_violation(), svr.options().kkt_bound());
    }
    ASSERT_EQ(svr.size(), 60u);
    EXPECT_LE(largest_difference(svr, before, 2), model_tolerance(c))
        << "C " << c << " seed " << kSeed;
  }
}

TEST(KktLaws, ForgettingEverySampleInAnyOrderKeepsKktDownToTheEmptyWindow) {
  for (const RecordKind kind : kAllRecordKinds) {
    OnlineSvr svr(options_of(2, 50, 10.0));
    std::vector<std::size_t> slots;
    for (const Sample& sample : RecordGenerator(kind, 2, kSeed).take(50)) {
      slots.push_back(svr.add(sample.x, sample.y).slot);
    }
    std::mt19937_64 engine(kSeed);
    std::shuffle(slots.begin(), slots.end(), engine);
    for (const std::size_t slot : slots) {
      ASSERT_EQ(svr.forget(slot).outcome, UpdateOutcome::kForgotten) << name(kind);
      ASSERT_LE(svr.max_kkt_violation(), svr.options().kkt_bound()) << name(kind);
      ASSERT_LE(std::fabs(svr.theta_sum()), theta_sum_bound(svr)) << name(kind);
    }
    EXPECT_EQ(svr.size(), 0u);
  }
}

TEST(KktLaws, ASampleInsideTheTubeLeavesTheModelToTheBit) {
  OnlineSvr svr(options_of(2, 100, 10.0));
  RecordGenerator record(RecordKind::kSmooth, 2, kSeed);
  for (const Sample& sample : record.take(60)) svr.add(sample.x, sample.y);
  const std::vector<double> probe{0.3, -0.2};
  const double before = svr.predict(probe);
  const double inside = before + 0.9 * svr.options().epsilon;
  const UpdateReport report = svr.add(probe, inside);
  EXPECT_EQ(report.outcome, UpdateOutcome::kFitsAlready);
  EXPECT_EQ(report.events, 0u);
  EXPECT_EQ(svr.set_of(report.slot), SampleSet::kRemaining);
  EXPECT_EQ(svr.predict(probe), before);
  // f at the sample is -0.9 epsilon from its target, up to rounding of the sum and the jitter.
  EXPECT_NEAR(report.prior_residual, -0.9 * svr.options().epsilon, 1e-11);
}

TEST(KktLaws, SlowUpkeepKeepsStoredResidualsTrueOverManyWindows) {
  OnlineSvr svr(options_of(2, 40, 10.0));
  RecordGenerator record(RecordKind::kSmooth, 2, kSeed);
  for (const Sample& sample : record.take(20000)) svr.add(sample.x, sample.y);
  for (std::size_t slot = 0; slot < svr.slot_count(); ++slot) {
    if (svr.set_of(slot) == SampleSet::kVacant) continue;
    const std::vector<double> x{svr.feature(slot, 0), svr.feature(slot, 1)};
    // One window of updates between two refreshes, 40 x 6 events of 1e-15 each.
    EXPECT_NEAR(svr.fitted(slot), svr.predict(x), 1e-12);
  }
}

}  // namespace
}  // namespace zerodrift::regression::testing
