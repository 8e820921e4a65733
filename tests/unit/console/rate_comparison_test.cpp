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
