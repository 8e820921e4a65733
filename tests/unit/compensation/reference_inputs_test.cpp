// SPDX-License-Identifier: Apache-2.0
#include "common/compensation/reference_inputs.h"

#include <gtest/gtest.h>

#include <chrono>

namespace zerodrift::compensation {
namespace {

using core::ReferenceKind;
using core::SensorTime;

constexpr SensorTime kSecond{1'000'000'000};

core::RateReferenceSample reference(ReferenceKind kind, SensorTime time, double rate_radps) {
  core::RateReferenceSample sample;
  sample.kind = kind;
  sample.time = time;
  sample.rate_radps = {rate_radps, 0.0, 0.0};
  sample.valid = {true, true, true};
  return sample;
}

core::AngularRateSample rate_at(SensorTime time, double interval_s = 0.01) {
  core::AngularRateSample sample;
  sample.time = time;
  sample.interval_s = interval_s;
  return sample;
}

std::uint64_t counted(const ReferenceInputs& references, ReferenceVerdict verdict) {
  return references.counts()[static_cast<std::size_t>(verdict)];
}

// Law: the true rate of a sample is the newest said for its time or before, if not too old.
TEST(ReferenceInputsLaws, TheTrueRateIsTheNewestThatIsNotTooOld) {
  ReferenceInputs references{ReferenceOptions{}};
  references.push(reference(ReferenceKind::kRecord, kSecond, 0.1));
  references.push(reference(ReferenceKind::kRecord, 2 * kSecond, 0.2));
  EXPECT_EQ(references.true_rate(kSecond - SensorTime{1}), nullptr);
  ASSERT_NE(references.true_rate(kSecond), nullptr);
  EXPECT_EQ(references.true_rate(kSecond)->rate_radps[0], 0.1);
  EXPECT_EQ(references.true_rate(2 * kSecond)->rate_radps[0], 0.2);
  EXPECT_NE(references.true_rate(2 * kSecond + kOldestReference), nullptr);
  EXPECT_EQ(references.true_rate(2 * kSecond + kOldestReference + SensorTime{1}), nullptr);
  EXPECT_EQ(counted(references, ReferenceVerdict::kTaken), 2U);
}

// Rule: where the Earth's rate counts as drift, rest is no true rate; it is refused once each.
TEST(ReferenceInputsLaws, RestIsRefusedOnceWhereTheEarthsRateCountsAsDrift) {
  ReferenceInputs references{ReferenceOptions{}};
  references.push(reference(ReferenceKind::kRest, kSecond, 0.0));
  const SensorTime due = kSecond + kFeedbackDelay;
  EXPECT_EQ(references.rest(due - SensorTime{1}, EarthRateMode::kKnown), nullptr) << "not due yet";
  EXPECT_EQ(references.rest(due, EarthRateMode::kIncluded), nullptr);
  EXPECT_EQ(references.rest(due, EarthRateMode::kIncluded), nullptr);
  EXPECT_EQ(counted(references, ReferenceVerdict::kEarthRateIncluded), 1U);
  EXPECT_NE(references.rest(due, EarthRateMode::kKnown), nullptr);
}

// Law: a filter's feedback is waited for from half a second after the first sample on, of gyros
// that are fast enough for it to be there by then.
TEST(ReferenceInputsLaws, FeedbackIsWaitedForWhereItCanHaveCome) {
  ReferenceOptions options;
  options.await_feedback = true;
  ReferenceInputs references(options);
  EXPECT_TRUE(references.complete_for(rate_at(kSecond), core::kNever)) << "before the first sample";
  EXPECT_TRUE(references.complete_for(rate_at(kSecond), kSecond));
  EXPECT_FALSE(references.complete_for(rate_at(3 * kSecond), kSecond));
  EXPECT_TRUE(references.complete_for(rate_at(3 * kSecond, 10.0), kSecond)) << "a slow gyro's";
  references.push(reference(ReferenceKind::kRest, 4 * kSecond, 0.0));
  EXPECT_TRUE(references.complete_for(rate_at(3 * kSecond), kSecond));
  references.give_up_waiting();
  EXPECT_TRUE(references.complete_for(rate_at(9 * kSecond), kSecond));
}

// Rule: of a gap in the rates no filter has anything to say, so nobody waits for it, and the sample
// behind it goes without what was said before, whether that has come yet or not. Before: all waited
// for the rest of the record.
TEST(ReferenceInputsLaws, BehindAGapNothingIsWaitedForOrUsed) {
  ReferenceOptions options;
  options.await_feedback = true;
  for (const int gap_ms : {200, 260, 400, 500, 600, 8000}) {
    const SensorTime gap = std::chrono::milliseconds(gap_ms);
    const bool is_gap = gap_ms > 250;
    for (const bool has_come : {false, true}) {
      ReferenceInputs references(options);
      references.begin(rate_at(kSecond));
      references.begin(rate_at(4 * kSecond));
      if (has_come || !is_gap)
        references.push(reference(ReferenceKind::kRest, 4 * kSecond - kSecond / 10, 0.0));
      const auto behind = rate_at(4 * kSecond + gap);
      EXPECT_TRUE(references.complete_for(behind, kSecond)) << gap_ms;
      references.begin(behind);
      EXPECT_EQ(references.rest(behind.time, EarthRateMode::kKnown) == nullptr,
                is_gap || gap - kFeedbackDelay < -kSecond / 10)
          << gap_ms;
      // What is said of the sample behind it is waited for again.
      const auto later = rate_at(behind.time + kFeedbackDelay + kSecond / 100);
      references.begin(rate_at(later.time - kSecond / 100));
      EXPECT_FALSE(references.complete_for(later, kSecond)) << gap_ms;
    }
  }
}

TEST(ReferenceInputsLaws, EachKindHasBeenHeardToItsOwnTime) {
  ReferenceInputs references{ReferenceOptions{}};
  references.push(reference(ReferenceKind::kRecord, 5 * kSecond, 0.0));
  EXPECT_TRUE(references.has_received(reference(ReferenceKind::kRecord, 5 * kSecond, 0.0)));
  EXPECT_FALSE(references.has_received(reference(ReferenceKind::kRecord, 6 * kSecond, 0.0)));
  EXPECT_FALSE(references.has_received(reference(ReferenceKind::kRest, 5 * kSecond, 0.0)));
  references.restart();
  EXPECT_FALSE(references.has_received(reference(ReferenceKind::kRecord, 5 * kSecond, 0.0)));
}

// A residual moves nothing where the options refuse it.
TEST(ReferenceInputsLaws, ARefusedResidualCorrectsNothing) {
  ReferenceInputs references{ReferenceOptions{}};
  references.push(reference(ReferenceKind::kNavigationResidual, kSecond, 1e-4));
  references.correct(kSecond + kFeedbackDelay, 0, false, {});
  EXPECT_EQ(references.correction_radps(0), 0.0);
  EXPECT_EQ(counted(references, ReferenceVerdict::kNotAccepted), 1U);
}

}  // namespace
}  // namespace zerodrift::compensation
