// SPDX-License-Identifier: Apache-2.0
#include "common/allan/stream_timing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace zerodrift::allan {
namespace {

using core::from_seconds;
using core::SensorTime;

// `samples` in order, each one interval after the one before; returns the last placement.
Placement run(StreamTiming& timing, double from_s, double interval_s, int samples) {
  Placement last;
  for (int k = 0; k < samples; ++k)
    last = timing.place(from_seconds(from_s + k * interval_s), interval_s);
  return last;
}

TEST(StreamTiming, AnEvenStreamHasNoGaps) {
  StreamTiming timing;
  EXPECT_EQ(timing.place(from_seconds(5.0), 0.005).arrival, Arrival::kFirst);
  for (int k = 1; k < 1000; ++k) {
    const Placement p = timing.place(from_seconds(5.0 + 0.005 * k), 0.005);
    ASSERT_EQ(p.arrival, Arrival::kNext);
    ASSERT_EQ(p.missing, 0U);
  }
  EXPECT_EQ(timing.newest(), from_seconds(5.0 + 0.005 * 999));
}

TEST(StreamTiming, CountsWhatIsMissing) {
  for (const std::uint64_t missing : {1U, 7U, 120000U}) {
    StreamTiming timing;
    run(timing, 0.0, 0.005, 10);
    const double after_s = 0.045 + 0.005 * static_cast<double>(missing + 1);
    const Placement p = timing.place(from_seconds(after_s), 0.005);
    EXPECT_EQ(p.arrival, Arrival::kNext);
    EXPECT_EQ(p.missing, missing);
  }
}

// A record's interval is the time since the row before: after a gap, the gap.
TEST(StreamTiming, AnIntervalThatIsTheTimeSinceTheNewestIsItsStreams) {
  StreamTiming timing;
  run(timing, 0.0, 0.005, 10);
  const Placement p = timing.place(from_seconds(600.045), 600.0);
  EXPECT_EQ(p.arrival, Arrival::kNext);
  EXPECT_EQ(p.missing, 119999U);
}

TEST(StreamTiming, TimeStampsRoundedToAMillisecondAreNeitherGapsNorANewRate) {
  StreamTiming timing;
  double before_s = 0.0;
  for (int k = 1; k < 5000; ++k) {
    const double time_s = std::round(0.0048 * k * 1e3) * 1e-3;
    const double interval_s = k == 1 ? 0.0048 : time_s - before_s;
    const Placement p = timing.place(from_seconds(time_s), interval_s);
    if (k > 1) {
      ASSERT_EQ(p.arrival, Arrival::kNext) << k;
      ASSERT_EQ(p.missing, 0U) << k;
    }
    before_s = time_s;
  }
}

// The first interval of a live stream is a difference of two jittery stamps. Before: every tau went
// by it for good.
TEST(StreamTiming, TheMeanIntervalIsThatOfTheStepsWhateverTheFirstOne) {
  for (const double first_s : {0.00476, 0.00495, 0.005, 0.00505, 0.00524}) {
    StreamTiming timing;
    timing.place(from_seconds(0.0), first_s);
    EXPECT_EQ(timing.mean_interval_s(), first_s) << "nothing else is known";
    for (int k = 1; k < 1000; ++k) timing.place(from_seconds(0.005 * k), 0.005);
    EXPECT_EQ(timing.mean_interval_s(), 0.005);
    timing.place(from_seconds(60.0), 0.005);  // after a gap
    timing.place(from_seconds(60.0), 0.005);  // again
    timing.place(from_seconds(59.0), 0.005);
    EXPECT_EQ(timing.mean_interval_s(), 0.005);
  }
}

TEST(StreamTiming, TheMeanIntervalOfJitteryStampsIsTheTrueOne) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> jitter_s(-0.0005, 0.0005);
  StreamTiming timing;
  double before_s = -0.0052;
  constexpr int kSamples = 10000;
  for (int k = 0; k < kSamples; ++k) {
    const double time_s = 0.005 * k + jitter_s(random);
    timing.place(from_seconds(time_s), time_s - before_s);
    before_s = time_s;
  }
  // Off by the jitter of its two ends.
  EXPECT_NEAR(timing.mean_interval_s(), 0.005, 0.001 / (kSamples - 1));
}

TEST(StreamTiming, ANewRateHasItsOwnMeanInterval) {
  StreamTiming timing;
  run(timing, 0.0, 0.005, 500);
  run(timing, 2.5, 0.01, 500);
  EXPECT_EQ(timing.mean_interval_s(), 0.01);
}

TEST(StreamTiming, WhatDoesNotIncreaseHasNoPlaceAndLeavesNothingBehind) {
  StreamTiming timing;
  run(timing, 0.0, 0.005, 10);
  EXPECT_EQ(timing.place(from_seconds(0.045), 0.005).arrival, Arrival::kDuplicate);
  EXPECT_EQ(timing.place(from_seconds(0.020), 0.005).arrival, Arrival::kBehind);
  EXPECT_EQ(timing.place(SensorTime::min(), 0.005).arrival, Arrival::kBehind);
  const Placement next = timing.place(from_seconds(0.050), 0.005);
  EXPECT_EQ(next.arrival, Arrival::kNext);
  EXPECT_EQ(next.missing, 0U);
}

TEST(StreamTiming, ASourceThatBeginsAnewIsBelievedAfterThirtyTwoSamples) {
  StreamTiming timing;
  run(timing, 1000.0, 0.005, 100);
  const Placement last = run(timing, 0.0, 0.005, StreamTiming::kToBelieve - 1);
  EXPECT_EQ(last.arrival, Arrival::kBehind);
  const Placement believed = timing.place(from_seconds(0.005 * StreamTiming::kToBelieve), 0.005);
  EXPECT_EQ(believed.arrival, Arrival::kTimeRestarted);
  EXPECT_GT(believed.missing, 0U) << "a difference must not reach across";
  EXPECT_EQ(run(timing, 0.005 * (StreamTiming::kToBelieve + 1), 0.005, 10).arrival, Arrival::kNext);
}

// One stamp of the far future makes all that follow late; it is outvoted.
TEST(StreamTimingAbuse, AStampAtTheEndOfTimeDoesNotEndTheStream) {
  StreamTiming timing;
  run(timing, 0.0, 0.005, 10);
  const Placement far = timing.place(SensorTime::max(), 0.005);
  EXPECT_EQ(far.arrival, Arrival::kNext);
  EXPECT_GT(far.missing, 1000000000000U);
  const Placement last = run(timing, 0.05, 0.005, StreamTiming::kToBelieve);
  EXPECT_EQ(last.arrival, Arrival::kTimeRestarted);
}

// Records have up to half an hour from one sample to the next.
TEST(StreamTiming, TakesEverySpacingThatARecordMayHave) {
  for (const double interval_s : {1e-4, 0.005, 1.0, 100.0, 300.0, 1800.0}) {
    StreamTiming timing;
    EXPECT_EQ(timing.place(from_seconds(interval_s), interval_s).arrival, Arrival::kFirst);
    EXPECT_EQ(timing.place(from_seconds(2.0 * interval_s), interval_s).arrival, Arrival::kNext);
  }
}

TEST(StreamTiming, AnotherRateIsANewStreamAfterAtMostThreeBlocks) {
  for (const double rate_hz : {50.0, 100.0, 190.0, 220.0, 400.0}) {
    SCOPED_TRACE(rate_hz);
    StreamTiming timing;
    run(timing, 0.0, 0.005, 117);  // not at the border of a block
    int news = 0;
    int at = 0;
    for (int k = 1; k <= 200; ++k) {
      const Placement p = timing.place(from_seconds(0.58 + k / rate_hz), 1.0 / rate_hz);
      if (p.arrival != Arrival::kNewRate) continue;
      ++news;
      at = k;
    }
    EXPECT_EQ(news, 1);
    EXPECT_LE(at, 3 * StreamTiming::kToBelieve);
    EXPECT_NEAR(timing.interval_s() * rate_hz, 1.0, 1e-12);  // a sum of 32 equal numbers
  }
}

TEST(StreamTiming, ASampleOfAnotherIntervalIsLeftOutAndTheStreamStays) {
  StreamTiming timing;
  run(timing, 0.0, 0.005, 10);
  EXPECT_EQ(timing.place(from_seconds(0.050), 0.5).arrival, Arrival::kOtherInterval);
  const Placement next = timing.place(from_seconds(0.055), 0.005);
  EXPECT_EQ(next.arrival, Arrival::kNext);
  EXPECT_EQ(next.missing, 1U);
  EXPECT_EQ(timing.interval_s(), 0.005);
}

TEST(StreamTimingAbuse, AFirstIntervalThatIsNoneIsRefused) {
  StreamTiming timing;
  for (const double bad :
       {0.0, -0.005, 1e-300, 9e-5, 2000.0, 1e300, std::numeric_limits<double>::quiet_NaN(),
        std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(timing.place(from_seconds(1.0), bad).arrival, Arrival::kRefused) << bad;
  }
  EXPECT_EQ(timing.interval_s(), 0.0);
}

TEST(StreamTimingAbuse, AnyTimesAndIntervalsGiveAPlacement) {
  std::mt19937_64 random(7);
  StreamTiming timing;
  for (int k = 0; k < 100000; ++k) {
    const SensorTime time{static_cast<std::int64_t>(random())};
    const double interval_s = std::ldexp(1.0, static_cast<int>(random() % 40) - 25);
    const Placement p = timing.place(time, interval_s);
    // 2^64 ns over 1e-4 s
    ASSERT_LT(p.missing, 200000000000000U);
  }
}

}  // namespace
}  // namespace zerodrift::allan
