// SPDX-License-Identifier: Apache-2.0
#include "common/twin/disturbance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "common/core/units.h"

namespace zerodrift::twin {
namespace {

using core::SensorTime;

core::AngularRateSample sample(std::uint64_t sequence, double rate = 1.0) {
  core::AngularRateSample result;
  result.sequence = sequence;
  result.time = SensorTime{static_cast<std::int64_t>(sequence) * 1'000'000'000};
  result.rate_radps = {rate, rate, rate};
  result.valid = {true, true, true};
  return result;
}

core::AngularRateSample applied(Disturber& disturber, core::AngularRateSample given) {
  static_cast<void>(disturber.apply(given));
  return given;
}

TEST(ParseDisturbance, ReadsKindAxisMagnitudeAndSeconds) {
  const auto step = parse_disturbance("step:y:-5:2.5");
  EXPECT_EQ(step.kind, DisturbanceKind::kStep);
  EXPECT_EQ(step.axes, (core::PerAxis<bool>{false, true, false}));
  EXPECT_EQ(step.magnitude_radps, core::radps_from_deg_h(-5.0));
  EXPECT_EQ(step.duration_s, 2.5);
  EXPECT_EQ(parse_disturbance("step:y:-5:5min").duration_s, 300.0);
  EXPECT_EQ(parse_disturbance("gap:xyz:0:200ms").duration_s, 200.0 * 1e-3);
  EXPECT_EQ(parse_disturbance("gap:xyz:0").kind, DisturbanceKind::kGap);
  EXPECT_EQ(parse_disturbance("gap:xyz:0").duration_s, 60.0);
}

TEST(ParseDisturbance, RefusesTheRestInOneLineThatSaysWhatWouldBeRight) {
  for (const char* text : {"",
                           "step",
                           "step:x",
                           "step:x:",
                           "step:x:5:",
                           "step:x:5:0",
                           "step:x:5:60:1",
                           "jump:x:5",
                           "step:w:5",
                           "step:xy:5",
                           "step::5",
                           "step:x:nan",
                           "step:x:inf",
                           "step:x:1e7",
                           "noise:x:-1",
                           "stuck:x:5",
                           "gap:x:0",
                           "step:x:5:1e9",
                           "step:x:5:2d",
                           "step:x:5:0ms",
                           "step:x:5:60sec",
                           "step:x:5:nan",
                           "step:x:5 :60"}) {
    try {
      static_cast<void>(parse_disturbance(text));
      ADD_FAILURE() << text;
    } catch (const std::invalid_argument& error) {
      const std::string line = error.what();
      EXPECT_TRUE(line.starts_with("found '" + std::string(text) + "', expected ")) << line;
    }
  }
}

TEST(Disturber, AddsAStepToItsAxisForItsTimeAndNoLonger) {
  Disturber disturber(1);
  ASSERT_TRUE(
      disturber.begin({.axes = {false, true, false}, .magnitude_radps = 2.0, .duration_s = 3.0}));
  for (std::uint64_t i = 10; i < 13; ++i) {
    const auto out = applied(disturber, sample(i));
    EXPECT_EQ(out.rate_radps, (core::PerAxis<double>{1.0, 3.0, 1.0})) << i;
  }
  EXPECT_EQ(applied(disturber, sample(13)).rate_radps, sample(13).rate_radps);
  EXPECT_EQ(disturber.acting(), 0U);
}

TEST(Disturber, StepsAddUp) {
  Disturber disturber(1);
  for (int i = 0; i < 2; ++i)
    disturber.begin({.axes = {true, false, false}, .magnitude_radps = 2.0, .duration_s = 3.0});
  EXPECT_EQ(applied(disturber, sample(1)).rate_radps[0], 5.0);
}

// Rule: white noise of the standard deviation that was asked for, another one for each axis and
// each time it is asked for, the same for the same seed.
TEST(Disturber, NoiseIsWhiteRepeatableAndOfItsSize) {
  constexpr int kSamples = 10000;
  Disturber first(1);
  Disturber again(1);
  const Disturbance noise{.kind = DisturbanceKind::kNoise,
                          .axes = {true, true, false},
                          .magnitude_radps = 0.5,
                          .duration_s = 1e5};
  first.begin(noise);
  again.begin(noise);
  double square = 0.0;
  double product = 0.0;
  for (std::uint64_t i = 0; i < kSamples; ++i) {
    const auto out = applied(first, sample(i, 0.0));
    EXPECT_EQ(out.rate_radps, applied(again, sample(i, 0.0)).rate_radps);
    EXPECT_EQ(out.rate_radps[2], 0.0);
    square += out.rate_radps[0] * out.rate_radps[0];
    product += out.rate_radps[0] * out.rate_radps[1];
  }
  // 5 sigma of the sampling error of a variance and of a covariance, n = 1e4.
  EXPECT_NEAR(square / kSamples, 0.25, 5.0 * 0.25 * std::sqrt(2.0 / kSamples));
  EXPECT_NEAR(product / kSamples, 0.0, 5.0 * 0.25 / std::sqrt(1.0 * kSamples));
}

TEST(Disturber, AStuckAxisKeepsTheRateItHad) {
  Disturber disturber(1);
  disturber.begin(
      {.kind = DisturbanceKind::kStuck, .axes = {false, false, true}, .duration_s = 5.0});
  EXPECT_EQ(applied(disturber, sample(1, 7.0)).rate_radps[2], 7.0);
  EXPECT_EQ(applied(disturber, sample(2, 8.0)).rate_radps, (core::PerAxis<double>{8.0, 8.0, 7.0}));
}

TEST(Disturber, AGapWithholdsSamplesAndOthersGoOnAfterIt) {
  Disturber disturber(1);
  disturber.begin(parse_disturbance("gap:xyz:0:2"));
  auto given = sample(1);
  EXPECT_EQ(disturber.apply(given), Disturber::Delivery::kWithhold);
  given = sample(2);
  EXPECT_EQ(disturber.apply(given), Disturber::Delivery::kWithhold);
  given = sample(3);
  EXPECT_EQ(disturber.apply(given), Disturber::Delivery::kGive);
}

TEST(Disturber, TakesSoManyAndForgetsThemWhenTold) {
  Disturber disturber(1);
  for (std::size_t i = 0; i < Disturber::kMost; ++i) EXPECT_TRUE(disturber.begin({}));
  EXPECT_FALSE(disturber.begin({}));
  disturber.clear();
  EXPECT_EQ(applied(disturber, sample(1)).rate_radps, sample(1).rate_radps);
}

}  // namespace
}  // namespace zerodrift::twin
