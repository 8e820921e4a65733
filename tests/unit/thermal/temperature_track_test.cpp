// SPDX-License-Identifier: Apache-2.0
#include "common/thermal/temperature_track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>

namespace zerodrift::thermal {
namespace {

using core::from_seconds;

core::TemperatureSample sample(double time_s, double temperature_degc, bool measured = true) {
  core::TemperatureSample s;
  s.probe = "coil";
  s.time = from_seconds(time_s);
  s.temperature_degc = temperature_degc;
  s.measured = measured;
  return s;
}

TemperatureTrackOptions ten_hertz(RateMethod method) {
  TemperatureTrackOptions options;
  options.rate_method = method;
  options.sliding_mean = {.window_samples = 600, .sample_rate_hz = 10.0, .max_gap_s = 10.0};
  return options;
}

TEST(TemperatureTrackLaws, TheRateIsThatOfTheChosenEstimatorToTheBit) {
  const auto sliding_options = ten_hertz(RateMethod::kSlidingMean);
  const auto polynomial_options = ten_hertz(RateMethod::kLocalPolynomial);
  TemperatureTrack sliding_track(sliding_options);
  TemperatureTrack polynomial_track(polynomial_options);
  SlidingMeanRate sliding(sliding_options.sliding_mean);
  LocalPolynomialRate polynomial(polynomial_options.local_polynomial);
  for (int i = 0; i < 1000; ++i) {
    const auto s = sample(0.1 * i, std::sin(0.01 * i));
    sliding_track.add(s);
    polynomial_track.add(s);
    sliding.add(s.time, s.temperature_degc);
    polynomial.add(s.time, s.temperature_degc);
    ASSERT_EQ(sliding_track.rate_degc_per_s(), sliding.rate_degc_per_s());
    ASSERT_EQ(polynomial_track.rate_degc_per_s(), polynomial.rate_degc_per_s());
  }
  EXPECT_TRUE(sliding_track.rate_degc_per_s());
  EXPECT_TRUE(polynomial_track.rate_degc_per_s());
}

TEST(TemperatureTrackScenario, LaggedTemperaturesComeOnceThereIsHistoryForThem) {
  TemperatureTrack track(ten_hertz(RateMethod::kSlidingMean));
  for (int i = 0; i <= 7000; ++i) {
    const double now_s = 0.1 * i;
    track.add(sample(now_s, 0.01 * now_s));
    for (const double lag_s : {300.0, 600.0}) {
      const auto lagged = track.temperature_degc_at(from_seconds(now_s) - from_seconds(lag_s));
      // The first kept point is the mean of the first second, 0.45 s after the start.
      if (now_s < lag_s + 0.44) {
        ASSERT_FALSE(lagged) << now_s;
      }
      if (now_s > lag_s + 0.46) {
        ASSERT_TRUE(lagged) << now_s;
        ASSERT_NEAR(*lagged, 0.01 * (now_s - lag_s),
                    1e-9);  // stamps of 1 ns on a ramp of 0.01 °C/s
      }
    }
  }
}

TEST(TemperatureTrackScenario, AgeAndUnchangedTimeTellAStoppedFromAStuckProbe) {
  TemperatureTrack track(ten_hertz(RateMethod::kSlidingMean));
  EXPECT_FALSE(track.age(from_seconds(1.0)));
  EXPECT_FALSE(track.unchanged_for(from_seconds(1.0)));
  EXPECT_FALSE(track.newest());
  track.add(sample(1.0, 20.0));
  track.add(sample(2.0, 20.5));
  for (int i = 3; i <= 100; ++i) track.add(sample(i, 20.5));
  EXPECT_EQ(track.age(from_seconds(101.0)), from_seconds(1.0));
  EXPECT_EQ(track.unchanged_for(from_seconds(101.0)), from_seconds(99.0));
  EXPECT_EQ(track.age(from_seconds(99.0)), from_seconds(-1.0));
  track.add(sample(102.0, std::nextafter(20.5, 21.0)));  // one bit is a change
  EXPECT_EQ(track.unchanged_for(from_seconds(102.0)), from_seconds(0.0));
}

TEST(TemperatureTrackAbuse, BadReadingsAreNamedCountedAndLeaveTheStateAsItWas) {
  TemperatureTrack clean(ten_hertz(RateMethod::kLocalPolynomial));
  TemperatureTrack abused(ten_hertz(RateMethod::kLocalPolynomial));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 700; ++i) {
    const auto good = sample(0.1 * i, 0.01 * i);
    ASSERT_EQ(clean.add(good), ReadingVerdict::kAccepted);
    ASSERT_EQ(abused.add(good), ReadingVerdict::kAccepted);
    ASSERT_EQ(abused.add(good), ReadingVerdict::kOutOfOrder);
    ASSERT_EQ(abused.add(sample(0.1 * i - 5.0, 3.0)), ReadingVerdict::kOutOfOrder);
    ASSERT_EQ(abused.add(sample(0.1 * i + 0.01, std::nan(""))), ReadingVerdict::kNotFinite);
    ASSERT_EQ(abused.add(sample(0.1 * i + 0.01, kInfinity)), ReadingVerdict::kNotFinite);
    ASSERT_EQ(abused.add(sample(0.1 * i + 0.01, 850.0)), ReadingVerdict::kOutOfRange);
    ASSERT_EQ(abused.add(sample(0.1 * i + 0.01, -127.0)), ReadingVerdict::kOutOfRange);
    ASSERT_EQ(abused.add(sample(0.1 * i + 0.01, 3.0, false)), ReadingVerdict::kNotMeasured);
    auto extreme = good;
    extreme.time = core::SensorTime::max();
    ASSERT_EQ(abused.add(extreme), ReadingVerdict::kOutOfRange);

    const auto now = from_seconds(0.1 * i + 0.05);
    ASSERT_EQ(clean.rate_degc_per_s(), abused.rate_degc_per_s());
    ASSERT_EQ(clean.age(now), abused.age(now));
    ASSERT_EQ(clean.unchanged_for(now), abused.unchanged_for(now));
    ASSERT_EQ(clean.temperature_degc_at(now - from_seconds(3.0)),
              abused.temperature_degc_at(now - from_seconds(3.0)));
  }
  EXPECT_EQ(clean.counts(), (ReadingCounts{.accepted = 700}));
  EXPECT_EQ(abused.counts(), (ReadingCounts{.accepted = 700,
                                            .not_measured = 700,
                                            .not_finite = 1400,
                                            .out_of_range = 2100,
                                            .out_of_order = 1400}));
}

// Law: single readings that no thermometer can have come to leave everything as it was, whatever
// they say and however often they come.
TEST(TemperatureTrackAbuse, SingleReadingsFarFromTheOthersAreDoubtedAndLeaveTheStateAsItWas) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> anywhere(-90.0, 240.0);
  TemperatureTrack clean(ten_hertz(RateMethod::kLocalPolynomial));
  TemperatureTrack abused(ten_hertz(RateMethod::kLocalPolynomial));
  std::uint64_t doubtful = 0;
  for (int i = 0; i < 2000; ++i) {
    const double here = 20.0 + 15.0 * std::sin(0.003 * i);
    const double far = anywhere(random);
    ASSERT_EQ(clean.add(sample(0.1 * i, here)), ReadingVerdict::kAccepted);
    ASSERT_EQ(abused.add(sample(0.1 * i, here)), ReadingVerdict::kAccepted);
    if (random() % 3 == 0 && std::abs(far - here) > 2.1) {
      ASSERT_EQ(abused.add(sample(0.1 * i + 0.05, far)), ReadingVerdict::kDoubtful) << far;
      ++doubtful;
    }
    ASSERT_EQ(clean.rate_degc_per_s(), abused.rate_degc_per_s());
    ASSERT_EQ(clean.newest()->temperature_degc, abused.newest()->temperature_degc);
  }
  EXPECT_EQ(abused.counts(), (ReadingCounts{.accepted = 2000, .doubtful = doubtful}));
}

// Rule: what the next reading says again is so, and begins anew: what lies across it is no rate.
TEST(TemperatureTrackScenario, AJumpIsBelievedWhenItIsReadAgain) {
  TemperatureTrack track(ten_hertz(RateMethod::kLocalPolynomial));
  for (int i = 0; i < 700; ++i) track.add(sample(0.1 * i, 85.0));
  ASSERT_TRUE(track.rate_degc_per_s());
  EXPECT_EQ(track.add(sample(70.0, 26.0)), ReadingVerdict::kDoubtful);
  EXPECT_EQ(track.newest()->temperature_degc, 85.0);
  EXPECT_EQ(track.add(sample(70.1, -40.0)), ReadingVerdict::kDoubtful) << "says something else";
  EXPECT_EQ(track.add(sample(70.15, 26.0)), ReadingVerdict::kDoubtful);
  EXPECT_EQ(track.add(sample(70.15, 26.0)), ReadingVerdict::kOutOfOrder) << "delivered twice";
  EXPECT_EQ(track.add(sample(70.2, 26.5)), ReadingVerdict::kJumped);
  EXPECT_EQ(track.newest()->temperature_degc, 26.5);
  EXPECT_FALSE(track.rate_degc_per_s());
  EXPECT_FALSE(track.temperature_degc_at(from_seconds(60.0)));
  for (int i = 3; i < 700; ++i) track.add(sample(70.0 + 0.1 * i, 26.5));
  ASSERT_TRUE(track.rate_degc_per_s());
  EXPECT_NEAR(*track.rate_degc_per_s(), 0.0, 1e-12);
}

// Rule: quick chambers, coarse readings and slow loggers are no jumps.
TEST(TemperatureTrackScenario, WhatAThermometerCanReadIsNotDoubted) {
  TemperatureTrack quick(ten_hertz(RateMethod::kLocalPolynomial));
  TemperatureTrack coarse(ten_hertz(RateMethod::kLocalPolynomial));
  TemperatureTrack slow(ten_hertz(RateMethod::kSlidingMean));
  for (int i = 0; i < 900; ++i) {
    EXPECT_EQ(quick.add(sample(0.1 * i, 0.1 * i)), ReadingVerdict::kAccepted);
    EXPECT_EQ(coarse.add(sample(0.1 * i, std::round(0.01 * i) + i % 2)), ReadingVerdict::kAccepted);
    EXPECT_EQ(slow.add(sample(60.0 * i, 40.0 * std::sin(1.0 * i))), ReadingVerdict::kAccepted);
  }
}

TEST(TemperatureTrackAbuse, AnyNowGivesADefinedAge) {
  TemperatureTrack track(ten_hertz(RateMethod::kSlidingMean));
  track.add(sample(1.0, 20.0));
  EXPECT_EQ(track.age(core::SensorTime::max()), core::SensorTime::max() - from_seconds(1.0));
  EXPECT_EQ(track.age(core::kNever), core::SensorTime::min());
  EXPECT_EQ(track.unchanged_for(core::kNever), core::SensorTime::min());
}

TEST(TemperatureTrackScenario, AfterAResetAnEarlierClockIsAcceptedAndCountsRemain) {
  TemperatureTrack track(ten_hertz(RateMethod::kLocalPolynomial));
  for (int i = 0; i < 700; ++i) track.add(sample(1e6 + 0.1 * i, 20.0));
  EXPECT_EQ(track.add(sample(0.0, 20.0)), ReadingVerdict::kOutOfOrder);
  track.reset();
  EXPECT_FALSE(track.newest());
  EXPECT_FALSE(track.rate_degc_per_s());
  EXPECT_FALSE(track.temperature_degc_at(from_seconds(1e6 + 60.0)));
  EXPECT_EQ(track.add(sample(0.0, 20.0)), ReadingVerdict::kAccepted);
  EXPECT_EQ(track.counts(), (ReadingCounts{.accepted = 701, .out_of_order = 1}));
}

TEST(TemperatureTrackAbuse, WrongOptionsAreRefusedWithTheirKey) {
  const auto key_of = [](auto change) {
    TemperatureTrackOptions options;
    change(options);
    EXPECT_THROW(TemperatureTrack{options}, std::invalid_argument);
    const auto problem = options.validate();
    return problem ? problem->substr(0, problem->find(' ')) : "";
  };
  using Options = TemperatureTrackOptions;
  EXPECT_EQ(key_of([](Options& o) { o.sliding_mean.window_samples = 0; }),
            "sliding_mean.window_samples");
  EXPECT_EQ(key_of([](Options& o) {
              o.rate_method = RateMethod::kLocalPolynomial;
              o.local_polynomial.bins = 0;
            }),
            "local_polynomial.bins");
  EXPECT_EQ(key_of([](Options& o) { o.history_step_s = 0.0; }), "history_step_s");
  EXPECT_EQ(key_of([](Options& o) { o.history_span_s = -1.0; }), "history_span_s");
  EXPECT_EQ(key_of([](Options& o) { o.history_span_s = 1e12; }), "history_span_s");
  EXPECT_EQ(key_of([](Options& o) { o.history_max_gap_s = 0.5; }), "history_max_gap_s");
  EXPECT_EQ(key_of([](Options& o) { o.min_temperature_degc = 300.0; }), "min_temperature_degc");
  EXPECT_EQ(key_of([](Options& o) { o.max_temperature_degc = std::nan(""); }),
            "min_temperature_degc");
}

}  // namespace
}  // namespace zerodrift::thermal
