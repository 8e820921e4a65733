// SPDX-License-Identifier: Apache-2.0
#include "services/console/rate_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "common/core/mode.h"

namespace zerodrift::services {
namespace {

using core::Mode;
using Result = telemetry::RateComparison;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::uint8_t number(Mode mode) {
  return static_cast<std::uint8_t>(mode);
}

double ratio(const Result& result) {
  return result.raw_deg_h() / result.compensated_deg_h();
}

TEST(RateComparisonLaws, TheSpreadOfBlockMeansIsThatOfTheDriftWhateverTheNoiseWithin) {
  RateComparison comparison;
  for (int s = -300; s < 300; ++s) {  // seconds before zero are seconds too
    const double minute = std::floor(s / 60.0) + 5.0;
    comparison.add(
        {s, minute + (s % 2 == 0 ? 50 : -50), 0.01 * minute, kNaN, number(Mode::kLearning)});
  }
  const Result result = comparison.result(false);
  EXPECT_EQ(result.obstacle(), Result::NO_OBSTACLE);
  EXPECT_EQ(result.blocks(), 10U);
  double squares = 0.0;
  for (int minute = 0; minute < 10; ++minute) squares += (minute - 4.5) * (minute - 4.5);
  EXPECT_NEAR(result.raw_deg_h(), std::sqrt(squares / 9.0), 1e-9);
  EXPECT_NEAR(ratio(result), 100.0, 1e-6);
}

TEST(RateComparisonLaws, TwoBlocksAreTooFewAndAnUnfilledOneIsNone) {
  RateComparison comparison;
  for (int s = 0; s < 60 + 60 + 47; ++s)
    comparison.add({s, s * 1.0, s * 0.5, kNaN, number(Mode::kLearning)});
  EXPECT_EQ(comparison.result(false).obstacle(), Result::TOO_SHORT);
  comparison.add({167, 167.0, 83.5, kNaN, number(Mode::kLearning)});  // four fifths
  EXPECT_EQ(comparison.result(false).blocks(), 3U);
}

// Ten minutes, of which those in `moving` turn there and back.
RateComparison drive(const std::set<int>& moving, bool is_known) {
  RateComparison comparison;
  for (int s = 0; s < 600; ++s) {
    const int minute = s / 60;
    const bool moves = moving.contains(minute);
    const double turn = moves ? 3600.0 * std::sin(s / 7.0) : 0.0;
    const double noise = s % 2 == 0 ? 0.1 : -0.1;
    comparison.add({s, turn + minute + noise, turn + 0.01 * minute + noise, is_known ? turn : kNaN,
                    number(moves ? Mode::kFrozen : Mode::kLearning)});
  }
  return comparison;
}

const std::set<int> kAll{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};

TEST(RateComparisonLaws, MinutesOfMotionSayNothingOfDrift) {
  const Result result = drive({3, 4, 5, 6}, false).result(false);
  EXPECT_EQ(result.blocks(), 6U);
  EXPECT_FALSE(result.against_reference());
  EXPECT_NEAR(ratio(result), 100.0, 1e-6);
}

TEST(RateComparisonLaws, WhereItHasMovedAllTheTimeNothingIsCompared) {
  EXPECT_EQ(drive(kAll, false).result(true).obstacle(), Result::MOTION);
}

TEST(RateComparisonLaws, AKnownTrueRateIsTakenOffAndMotionIsAsGoodAsRest) {
  const Result result = drive(kAll, true).result(true);
  EXPECT_EQ(result.blocks(), 10U);
  EXPECT_TRUE(result.against_reference());
  EXPECT_NEAR(ratio(result), 100.0, 1e-3);
}

// Two hours of drift at rest, and in between twelve minutes of 1 deg/s, in which the rate within a
// minute is as quiet as at rest; the gate needs two seconds to find it out, and a minute to settle.
RateComparison steady_turn(bool is_known) {
  RateComparison comparison;
  for (int s = 0; s < 7200; ++s) {
    const bool turns = s >= 2400 && s < 3120;
    const bool is_told = s >= 2402 && s < 3180;
    const double turn = turns ? 3600.0 : 0.0;
    const double drift = std::sin(s / 600.0);
    const double noise = s % 2 == 0 ? 0.1 : -0.1;
    comparison.add({s, turn + drift + noise, turn + 0.01 * drift + noise, is_known ? turn : kNaN,
                    number(is_told ? Mode::kFrozen : Mode::kLearning), is_told});
  }
  return comparison;
}

TEST(RateComparisonLaws, ASteadyTurnIsMotionHoweverQuietItIs) {
  const Result result = steady_turn(false).result(false);
  EXPECT_EQ(result.blocks(), 120U - 13U);
  EXPECT_FALSE(result.against_reference());
  EXPECT_NEAR(ratio(result), 100.0, 1e-6);
  EXPECT_LT(result.raw_deg_h(), 1.0);
}

// Rule: that its temperature is outside what was learned is told before that it moves, so that a
// turn may lose its name, or never have one.
TEST(RateComparisonLaws, ASteadyTurnIsMotionUnderAnotherReasonToo) {
  for (const int named_until : {2700, 2400}) {
    RateComparison comparison;
    for (int s = 0; s < 7200; ++s) {
      const bool turns = s >= 2430 && s < 3120;
      const bool is_named = s >= 2430 && s < named_until;
      const double turn = turns ? 3600.0 : 0.0;
      const double drift = std::sin(s / 600.0);
      const Mode mode = is_named                ? Mode::kFrozen
                        : s >= 2400 && s < 3180 ? Mode::kOutOfDomain
                                                : Mode::kLearning;
      comparison.add({s, turn + drift + (s % 2 == 0 ? 0.1 : -0.1), turn + 0.01 * drift, kNaN,
                      number(mode), is_named});
    }
    const Result result = comparison.result(false);
    EXPECT_EQ(result.blocks(), 120U - 12U) << named_until;
    EXPECT_NEAR(ratio(result), 100.0, 1e-6) << named_until;
  }
}

// Frozen by command, driven for ten minutes, and parked again: neither is said.
TEST(RateComparisonLaws, WhoIsBackAtTheLevelOfBeforeIsAtRestAgain) {
  RateComparison comparison;
  for (int s = 0; s < 7200; ++s) {
    const double turn = s >= 3000 && s < 3600 ? 3600.0 * std::sin(s / 7.0) : 0.0;
    const double drift = std::sin(s / 600.0);
    comparison.add({s, turn + drift, turn + 0.01 * drift, kNaN,
                    number(s < 1800 ? Mode::kLearning : Mode::kFrozen)});
  }
  const Result result = comparison.result(false);
  EXPECT_EQ(result.blocks(), 120U - 10U);
  EXPECT_NEAR(ratio(result), 100.0, 1e-6);
}

// Before: a turn that nobody had called one counted as drift where no rest was known before it.
TEST(RateComparisonLaws, ATurnBeforeTheFirstKnownRestIsMotionToo) {
  for (const int until : {630, 600, 59}) {
    for (const int begins : {0, 200}) {
      RateComparison comparison;
      for (int s = 0; s < 7200; ++s) {
        const double turn = s >= begins && s < until ? 3600.0 : 0.0;
        const double drift = std::sin(s / 600.0);
        comparison.add({s, turn + drift + (s % 2 == 0 ? 0.1 : -0.1), turn + 0.01 * drift, kNaN,
                        number(s < 660 ? Mode::kOutOfDomain : Mode::kLearning)});
      }
      const Result result = comparison.result(false);
      EXPECT_NEAR(ratio(result), 100.0, 1.0) << until << ' ' << begins;
      EXPECT_LT(result.raw_deg_h(), 1.0) << until << ' ' << begins;
    }
  }
}

// Nor does it take a time at rest for motion.
TEST(RateComparisonLaws, ARestOutsideWhatWasLearnedCounts) {
  RateComparison comparison;
  for (int s = 0; s < 7200; ++s) {
    const double drift = std::sin(s / 600.0);
    comparison.add(
        {s, drift, 0.01 * drift, kNaN, number(s < 3600 ? Mode::kLearning : Mode::kOutOfDomain)});
  }
  EXPECT_EQ(comparison.result(false).blocks(), 120U);
}

TEST(RateComparisonLaws, ASteadyTurnOfAKnownRateCounts) {
  const Result result = steady_turn(true).result(false);
  EXPECT_EQ(result.blocks(), 120U);
  EXPECT_TRUE(result.against_reference());
  EXPECT_NEAR(ratio(result), 100.0, 1e-3);
}

TEST(RateComparisonLaws, WhereEveryMinuteIsSaidToMoveNothingIsCompared) {
  RateComparison comparison;
  for (int s = 0; s < 600; ++s)
    comparison.add({s, s * 1.0, s * 0.1, kNaN, number(Mode::kFrozen), s % 60 == 30});
  EXPECT_EQ(comparison.result(false).obstacle(), Result::MOTION);
}

// At rest on the Earth, 10 deg/h of it about the axis: the true rate is known where `is_known`.
RateComparison rest_on_earth(int length, bool (*is_known)(int)) {
  RateComparison comparison;
  for (int s = 0; s < length; ++s) {
    const double drift = std::sin(s / 600.0);
    comparison.add(
        {s, 10.0 + drift, 10.0 + 0.01 * drift, is_known(s) ? 10.0 : kNaN, number(Mode::kLearning)});
  }
  return comparison;
}

TEST(RateComparisonLaws, MinutesAgainstTheReferenceAndAtRestAreNotMixed) {
  const Result rest = rest_on_earth(4200, [](int s) { return s < 1800; }).result(false);
  EXPECT_EQ(rest.blocks(), 40U);  // of which there are more
  EXPECT_FALSE(rest.against_reference());
  EXPECT_NEAR(ratio(rest), 100.0, 1e-6);
  EXPECT_LT(rest.raw_deg_h(), 1.0);
  const Result known = rest_on_earth(2400, [](int s) { return s < 1800; }).result(false);
  EXPECT_EQ(known.blocks(), 30U);
  EXPECT_TRUE(known.against_reference());  // though nobody tells it now
  EXPECT_NEAR(ratio(known), 100.0, 1e-6);
}

TEST(RateComparisonLaws, AMinuteThatIsHalfOfEachKindIsOfNeither) {
  EXPECT_EQ(rest_on_earth(600, [](int s) { return s % 2 == 0; }).result(false).obstacle(),
            Result::TOO_SHORT);
  const auto known = rest_on_earth(600, [](int s) { return s % 6 != 0; }).result(false);
  EXPECT_EQ(known.blocks(), 10U);  // five sixths have it
  EXPECT_TRUE(known.against_reference());
  EXPECT_NEAR(ratio(known), 100.0, 1e-6);
}

// A start at a bias of 10 deg/h: half a minute of passthrough, half a minute held, then a model.
void add_start_second(RateComparison& comparison, int s, Mode mode) {
  const double raw = 10.0 + 0.01 * s;
  const double compensated = s < 30 ? raw : s < 60 ? raw - 9.0 : 0.0001 * s;
  comparison.add({s, raw, compensated, kNaN, number(mode)});
}

RateComparison start(int length) {
  RateComparison comparison;
  for (int s = 0; s < length; ++s) {
    add_start_second(comparison, s,
                     s < 30   ? Mode::kPassthrough
                     : s < 60 ? Mode::kHolding
                              : Mode::kLearning);
  }
  return comparison;
}

TEST(RateComparisonLaws, NoStepFromPassthroughOrAHeldMeanIsWithinTheComparedTime) {
  EXPECT_EQ(start(29).result(false).obstacle(), Result::NOTHING_TAKEN_OFF);
  EXPECT_EQ(start(59).result(false).obstacle(), Result::MEAN_HELD);
  EXPECT_EQ(start(200).result(false).obstacle(), Result::TOO_SHORT);
  const Result result = start(600).result(false);
  EXPECT_EQ(result.blocks(), 9U);
  EXPECT_NEAR(ratio(result), 100.0, 2.0);  // the first block lacks the step's second
}

TEST(RateComparisonLaws, WhoFallsBackToPassthroughIsComparedAnew) {
  RateComparison comparison = start(400);
  for (int s = 400; s < 600; ++s)
    add_start_second(comparison, s, s < 402 ? Mode::kPassthrough : Mode::kLearning);
  EXPECT_EQ(comparison.result(false).blocks(), 3U);
}

TEST(RateComparisonLaws, WhatIsNoLongerKeptIsNotCompared) {
  RateComparison comparison = start(600);
  comparison.forget_before(300);
  EXPECT_EQ(comparison.result(false).blocks(), 5U);
}

}  // namespace
}  // namespace zerodrift::services
