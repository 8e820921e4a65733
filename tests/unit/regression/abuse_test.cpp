// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "common/regression/online_svr.h"
#include "tests/support/state_bytes.h"
#include "tests/unit/regression/test_records.h"

namespace zerodrift::regression::testing {
namespace {

using zerodrift::testing::state_of;

constexpr std::uint64_t kSeed = 33;

static_assert(!std::is_copy_constructible_v<OnlineSvr> &&
              std::is_nothrow_move_constructible_v<OnlineSvr>);

TEST(Abuse, NonFiniteOutOfRangeAndMisshapenSamplesAreRefusedAndChangeNothing) {
  OnlineSvr svr(options_of(2, 50, 10.0));
  for (const Sample& sample : RecordGenerator(RecordKind::kSmooth, 2, kSeed).take(50))
    svr.add(sample.x, sample.y);
  const std::string before = state_of(svr);
  const auto expect_refused = [&](const std::vector<double>& x, double y) {
    EXPECT_EQ(svr.add(x, y).outcome, UpdateOutcome::kRefused);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const double bad : {kNan, kInf, -kInf, 1e7, -1e300}) {
    expect_refused({bad, 0.0}, 0.0);
    expect_refused({0.0, bad}, 0.0);
    expect_refused({0.0, 0.0}, bad);
  }
  expect_refused({0.0}, 0.0);
  expect_refused({0.0, 0.0, 0.0}, 0.0);
  EXPECT_EQ(svr.forget(svr.slot_count()).outcome, UpdateOutcome::kRefused);
  EXPECT_EQ(svr.forget(50).outcome, UpdateOutcome::kRefused);  // the spare slot is vacant
  EXPECT_EQ(state_of(svr), before);
}

TEST(Abuse, APolynomialKernelThatWouldOverflowIsRefused) {
  OnlineSvr svr(options_of(2, 50, 10.0, KernelKind::kPolynomial));
  EXPECT_EQ(svr.add(std::vector<double>{1e4, 1e4}, 0.0).outcome, UpdateOutcome::kRefused);
  EXPECT_EQ(svr.size(), 0u);
}

TEST(Abuse, ValidateNamesTheWrongKey) {
  const auto key_of = [](const std::function<void(OnlineSvrOptions&)>& spoil) {
    OnlineSvrOptions options = options_of(2, 50, 10.0);
    spoil(options);
    EXPECT_THROW(OnlineSvr{options}, std::invalid_argument);
    const std::string error = options.validate().value_or("");
    return error.substr(0, error.find(':'));
  };
  EXPECT_FALSE(OnlineSvrOptions{}.validate());
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.dimension = 0; }), "dimension");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.dimension = kMaxDimension + 1; }), "dimension");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.capacity = 1; }), "capacity");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.kernel.gamma = -1.0; }), "kernel.gamma");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.epsilon = 0.0; }), "epsilon");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.epsilon = 1e-9; }), "epsilon");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.box_constraint = NAN; }), "box_constraint");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.kkt_tolerance = 0.0; }), "kkt_tolerance");
  EXPECT_EQ(key_of([](OnlineSvrOptions& o) { o.event_budget = 0; }), "event_budget");
  const auto two_tier = [](OnlineSvrOptions& o) {
    o.window = WindowPolicy::kTwoTier;
    o.recent_capacity = 50;
  };
  EXPECT_EQ(key_of(two_tier), "recent_capacity");
}

TEST(Abuse, AWindowOfTwoAndOneOfOneSampleWork) {
  OnlineSvr svr(options_of(1, 2, 10.0));
  EXPECT_EQ(svr.predict(std::vector<double>{0.0}), 0.0);
  EXPECT_EQ(svr.add(std::vector<double>{0.5}, 3.0).outcome, UpdateOutcome::kFitsAlready);
  EXPECT_NEAR(svr.predict(std::vector<double>{-4.0}), 3.0, 1e-11);  // a constant, up to the jitter
  for (int i = 0; i < 100; ++i) {
    svr.add(std::vector<double>{std::sin(i)}, std::cos(3.0 * i));
    ASSERT_EQ(svr.size(), 2u);
    ASSERT_LE(svr.max_kkt_violation(), svr.options().kkt_bound());
  }
}

TEST(Abuse, ClearGivesTheLearnerOfANewConstruction) {
  const OnlineSvrOptions options = options_of(2, 40, 10.0);
  OnlineSvr used(options), fresh(options);
  RecordGenerator record(RecordKind::kJumps, 2, kSeed);
  for (const Sample& sample : record.take(100)) used.add(sample.x, sample.y);
  used.clear();
  EXPECT_EQ(used.size(), 0u);
  for (const Sample& sample : record.take(100)) {
    used.add(sample.x, sample.y);
    fresh.add(sample.x, sample.y);
    ASSERT_EQ(used.predict(sample.x), fresh.predict(sample.x));
  }
}

// The budget is met in mid-update: the model stays a bounded, balanced one that keeps the settled
// samples' KKT conditions, and enough further calls reach the same optimum as a learner without a
// budget.
TEST(EventBudget, AnInterruptedUpdateLeavesAUsableModelAndIsFinishedLater) {
  OnlineSvrOptions options = options_of(2, 80, 10.0);
  OnlineSvr patient(options);
  options.event_budget = 3;
  OnlineSvr hurried(options);
  RecordGenerator record(RecordKind::kJumps, 2, kSeed);
  int unfinished = 0, busy = 0;
  for (int i = 0; i < 400; ++i) {
    const Sample sample = record.next();
    UpdateReport report = hurried.add(sample.x, sample.y);
    while (report.outcome == UpdateOutcome::kBusy) {
      ++busy;
      EXPECT_EQ(report.events, 3u);
      report = hurried.add(sample.x, sample.y);
    }
    ASSERT_LE(report.events, 3u);
    unfinished += report.outcome == UpdateOutcome::kUnfinished;
    ASSERT_LE(hurried.max_kkt_violation(), options.kkt_bound())
        << "step " << i << " seed " << kSeed;
    ASSERT_LE(std::fabs(hurried.theta_sum()), theta_sum_bound(hurried));
    ASSERT_LE(std::fabs(hurried.predict(sample.x)), 100.0);
    patient.add(sample.x, sample.y);
  }
  EXPECT_GT(unfinished, 50);
  EXPECT_GT(busy, 5);
  while (!hurried.finish_pending()) {
  }
  ASSERT_EQ(hurried.size(), patient.size());
  for (const Sample& probe : record.take(100)) {
    // Both are the optimum of the same window; see model_tolerance in kkt_laws_test.cpp.
    EXPECT_NEAR(hurried.predict(probe.x), patient.predict(probe.x), 1e-9);
  }
}

}  // namespace
}  // namespace zerodrift::regression::testing
