// SPDX-License-Identifier: Apache-2.0
// The scale factor learned in motion: nothing is learned of a perfect gyro, a known error is
// recovered with its change over temperature, drift is kept apart, and no reference does more harm
// than the bound.
#include "common/compensation/scale_factor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

constexpr double kDegS = core::kRadPerDeg;
constexpr double kPpm = 1e-6;
constexpr double kSigma = 0.1 * kDegH;  // of a block's mean

using Course = std::function<double(double time_s)>;

double weave(double time_s) {
  return 10.0 * kDegS * std::sin(2.0 * std::numbers::pi * time_s / 40.0);
}
// 30 s each way, with rests between.
double turn_table(double time_s) {
  const double phase = std::fmod(time_s, 120.0);
  if (phase < 30.0 || (phase >= 60.0 && phase < 90.0)) return 0.0;
  return phase < 60.0 ? 20.0 * kDegS : -20.0 * kDegS;
}
double ramp(double time_s) {
  return (0.02 * std::fmod(time_s, 1000.0) - 5.0) * kDegS;
}
double carousel(double) {
  return 30.0 * kDegS;
}

struct Trial {
  Course rate = weave;
  Course temperature_degc = [](double time_s) { return 20.0 + 15.0 * std::sin(time_s / 1200.0); };
  double error = 0.0;  // at 25 °C
  double per_degc = 0.0;
  double drift_radps = 0.0;
  double reference_offset_radps = 0.0;
  double reference_late_s = 0.0;
  double reference_scale = 1.0;
  double reference_sigma_radps = 0.0;  // stated
  double reference_noise_radps = 0.0;  // true
  std::uint64_t seed = 1;
  double begin_s = 0.0;
  double end_s = 3600.0;
};

core::PerAxis<ScaleFactor::Noise> known_noise(double sigma_radps = kSigma) {
  core::PerAxis<ScaleFactor::Noise> noise;
  noise.fill({sigma_radps, sigma_radps * sigma_radps});
  return noise;
}

// A sample a second, about x.
void drive(ScaleFactor& scale, const Trial& trial, const std::function<void(double)>& look = {}) {
  Random random(trial.seed);
  for (double time_s = trial.begin_s; time_s < trial.end_s; time_s += 1.0) {
    const double rate = trial.rate(time_s);
    const double temperature_degc = trial.temperature_degc(time_s);
    const double error = trial.error + trial.per_degc * (temperature_degc - 25.0);
    const double measured = (1.0 + error) * rate + trial.drift_radps + kSigma * random.gaussian();
    const double known = trial.reference_scale * trial.rate(time_s - trial.reference_late_s) +
                         trial.reference_offset_radps +
                         trial.reference_noise_radps * random.gaussian();
    scale.add(Axis::kX, measured, known, trial.reference_sigma_radps * trial.reference_sigma_radps);
    scale.close(core::from_seconds(time_s), temperature_degc, known_noise(), true);
    if (look) look(time_s);
  }
}

ScaleFactorState state_at(const ScaleFactor& scale, double temperature_degc) {
  return scale.state(Axis::kX, temperature_degc);
}

class AnyMotion : public ::testing::TestWithParam<Course> {};

// Rule: whatever the motion, what is taken for a perfect gyro's error stays within 4 of its own
// sigmas of nothing, at each temperature and at every moment: 5 seeds of 3600 blocks each.
TEST_P(AnyMotion, OfAPerfectGyroTeachesNothing) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    ScaleFactor scale{RestGateOptions{}};
    drive(scale, {.rate = GetParam(), .drift_radps = 3.0 * kDegH, .seed = seed},
          [&](double time_s) {
            for (const double temperature_degc : {-15.0, 20.0, 50.0}) {
              const ScaleFactorState state = state_at(scale, temperature_degc);
              ASSERT_LE(std::abs(state.error), 4.0 * state.sigma)
                  << "seed " << seed << ", " << time_s;
              ASSERT_LE(std::abs(state.per_degc), 4.0 * state.per_degc_sigma);
            }
          });
    EXPECT_GT(state_at(scale, 20.0).windows, 10U);
    EXPECT_EQ(state_at(scale, 20.0).refused, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(Motions, AnyMotion, ::testing::Values(weave, turn_table, ramp, carousel));

// Rule: 300 ppm and 5 ppm/°C come back within 4 of the stated sigmas, which have become small: 100
// blocks at 7 deg/s rms and 50 ppm of it each leave 5 ppm, and ageing leaves some ppm of an hour.
TEST(ScaleFactorScenario, AKnownErrorAndItsChangeOverTemperatureAreRecovered) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const double error : {300.0 * kPpm, -2000.0 * kPpm, 8000.0 * kPpm}) {
      ScaleFactor scale{RestGateOptions{}};
      drive(scale, {.error = error,
                    .per_degc = 5.0 * kPpm,
                    .drift_radps = 2.0 * kDegH,
                    .seed = seed,
                    .end_s = 7200.0});
      for (const double temperature_degc : {8.0, 20.0, 32.0}) {
        const ScaleFactorState state = state_at(scale, temperature_degc);
        const double truth = error + 5.0 * kPpm * (temperature_degc - 25.0);
        EXPECT_NEAR(state.error, truth, 4.0 * state.sigma) << "seed " << seed;
        EXPECT_LT(state.sigma, 20.0 * kPpm);
        EXPECT_NEAR(state.per_degc, 5.0 * kPpm, 4.0 * state.per_degc_sigma);
        EXPECT_LT(state.per_degc_sigma, 1.0 * kPpm);
      }
    }
  }
}

// Rule: a drift, or what a reference is constantly off, is no scale factor: with an offset of 10
// deg/h the same error is learned to a hundredth of its sigma, but for the 10 deg/h that are part
// of the measured rate (1e-4 of it).
TEST(ScaleFactorLaws, AConstantOffsetIsNoScaleFactor) {
  ScaleFactor without{RestGateOptions{}};
  ScaleFactor drifting{RestGateOptions{}};
  ScaleFactor against{RestGateOptions{}};
  drive(without, {.error = 300.0 * kPpm});
  drive(drifting, {.error = 300.0 * kPpm, .drift_radps = 10.0 * kDegH});
  drive(against, {.error = 300.0 * kPpm, .reference_offset_radps = 10.0 * kDegH});
  const ScaleFactorState expected = state_at(without, 20.0);
  ASSERT_TRUE(expected.is_known);
  for (const ScaleFactor* scale : {&drifting, &against})
    EXPECT_NEAR(state_at(*scale, 20.0).error, expected.error, 0.01 * expected.sigma);
}

// Rule: at one rate alone error and drift can't be told apart, and the sigma says so: it stays what
// is known at first, a third of the bound.
TEST(ScaleFactorLaws, OneRateAloneTellsNothing) {
  ScaleFactor scale{RestGateOptions{}};
  drive(scale, {.rate = carousel, .error = 300.0 * kPpm});
  EXPECT_GT(state_at(scale, 25.0).sigma, 0.9 * ScaleFactor::kLargest / 3.0);
  EXPECT_LT(std::abs(state_at(scale, 25.0).error), 100.0 * kPpm);
}

struct WrongReference {
  std::string name;
  Trial trial;
};

class PoorReference : public ::testing::TestWithParam<WrongReference> {};

// Rule: a reference that disagrees with the gyro, or with itself, beyond what it states teaches
// nothing, from the first block on as well as after an hour of a right one.
TEST_P(PoorReference, IsRefusedAndChangesNothing) {
  ScaleFactor scale{RestGateOptions{}};
  drive(scale, GetParam().trial);
  EXPECT_EQ(state_at(scale, 20.0).windows, 0U);
  EXPECT_GT(state_at(scale, 20.0).refused, 10U);
  EXPECT_EQ(scale.error_radps(Axis::kX, kDegS, 20.0), 0.0);

  ScaleFactor taught{RestGateOptions{}};
  drive(taught, {.error = 300.0 * kPpm});
  const ScaleFactorState before = state_at(taught, 20.0);
  Trial later = GetParam().trial;
  later.error = 300.0 * kPpm;
  later.begin_s = 3600.0;
  later.end_s = 7200.0;
  drive(taught, later);
  const ScaleFactorState after = state_at(taught, 20.0);
  EXPECT_NEAR(after.error, 300.0 * kPpm, 4.0 * after.sigma);
  // The window that was open began with the right one.
  EXPECT_NEAR(after.error, before.error, before.sigma);
  EXPECT_GT(after.sigma, before.sigma) << "one of both is wrong: less is known";
}

INSTANTIATE_TEST_SUITE_P(Each, PoorReference,
                         ::testing::Values(WrongReference{"late", {.reference_late_s = 0.05}},
                                           WrongReference{"noisier_than_stated",
                                                          {.reference_noise_radps = 20.0 * kDegH}},
                                           WrongReference{"reversed", {.reference_scale = -1.0}},
                                           WrongReference{"still", {.reference_scale = 0.0}},
                                           WrongReference{"of_another_scale",
                                                          {.reference_scale = 1.05}}),
                         [](const auto& wrong) { return wrong.param.name; });

// Rule: whatever proportional error a reference has, at most the bound is taken off.
TEST(ScaleFactorLaws, NoReferenceTakesMoreThanTheBoundOffTheRate) {
  for (double scale_error = -0.03; scale_error < 0.0305; scale_error += 0.001) {
    ScaleFactor scale{RestGateOptions{}};
    drive(scale, {.per_degc = 40.0 * kPpm, .reference_scale = 1.0 + scale_error});
    for (const double temperature_degc : {-55.0, 20.0, 85.0}) {
      EXPECT_LE(std::abs(scale.error_radps(Axis::kX, kDegS, temperature_degc)),
                ScaleFactor::kLargest * kDegS);
    }
  }
}

// Rule: a reference of another scale that agreed with itself for an hour is unlearned by a right
// one within the next: its windows are refused until so little is left of the old certainty that
// they are taken.
TEST(ScaleFactorScenario, WhatAWrongReferenceTaughtIsUnlearned) {
  ScaleFactor scale{RestGateOptions{}};
  drive(scale, {.reference_scale = 0.995});
  EXPECT_NEAR(state_at(scale, 20.0).error, 0.005, 0.0005);
  drive(scale, {.seed = 2, .begin_s = 3600.0, .end_s = 7200.0});
  const ScaleFactorState state = state_at(scale, 20.0);
  EXPECT_GT(state.refused, 0U);
  EXPECT_NEAR(state.error, 0.0, std::min(4.0 * state.sigma, 50.0 * kPpm));
}

// Rule: a reference whose stated sigma is above a hundredth of the rate, a gyro whose noise isn't
// known yet, and a command to learn nothing leave everything as it is.
TEST(ScaleFactorLaws, NothingIsLearnedWithoutCertaintyNoiseOrLeave) {
  ScaleFactor uncertain{RestGateOptions{}};
  drive(uncertain, {.error = 300.0 * kPpm, .reference_sigma_radps = 0.2 * kDegS});
  EXPECT_FALSE(state_at(uncertain, 20.0).is_known);

  for (const bool knows_noise : {false, true}) {
    ScaleFactor scale{RestGateOptions{}};
    for (double time_s = 0.0; time_s < 600.0; time_s += 1.0) {
      scale.add(Axis::kX, 1.0003 * weave(time_s), weave(time_s), 0.0);
      scale.close(core::from_seconds(time_s), 20.0, known_noise(knows_noise ? kSigma : 0.0),
                  !knows_noise);
    }
    EXPECT_FALSE(state_at(scale, 20.0).is_known);
    EXPECT_EQ(state_at(scale, 20.0).refused, 0U);
  }
}

// Rule: a reference that states its noise rightly is used, and the error it leaves is within the
// stated sigma.
TEST(ScaleFactorScenario, AReferenceThatStatesItsNoiseIsUsed) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    ScaleFactor scale{RestGateOptions{}};
    drive(scale, {.error = 300.0 * kPpm,
                  .reference_sigma_radps = 10.0 * kDegH,
                  .reference_noise_radps = 10.0 * kDegH,
                  .seed = seed,
                  .end_s = 7200.0});
    const ScaleFactorState state = state_at(scale, 20.0);
    EXPECT_EQ(state.refused, 0U);
    EXPECT_NEAR(state.error, 300.0 * kPpm, 4.0 * state.sigma);
    EXPECT_LT(state.sigma, 30.0 * kPpm);
  }
}

// Rule: without a thermometer one error is learned, for whatever temperature there was.
TEST(ScaleFactorScenario, WithoutAThermometerOneErrorIsLearned) {
  ScaleFactor scale{RestGateOptions{}};
  Random random(1);
  for (double time_s = 0.0; time_s < 3600.0; time_s += 1.0) {
    scale.add(Axis::kX, 1.0003 * weave(time_s) + kSigma * random.gaussian(), weave(time_s), 0.0);
    scale.close(core::from_seconds(time_s), std::nullopt, known_noise(), true);
  }
  const ScaleFactorState state = scale.state(Axis::kX, std::nullopt);
  EXPECT_NEAR(state.error, 300.0 * kPpm, 4.0 * state.sigma);
  EXPECT_LT(state.sigma, 20.0 * kPpm);
}

// Rule: what came into force outlives a time that begins anew, and the drift before it doesn't
// count: 100 deg/h more of it teach no scale factor.
TEST(ScaleFactorScenario, ANewBeginningKeepsWhatIsKnownAndForgetsTheDrift) {
  ScaleFactor scale{RestGateOptions{}};
  drive(scale, {.error = 300.0 * kPpm});
  const ScaleFactorState before = state_at(scale, 20.0);
  scale.restart();
  EXPECT_EQ(state_at(scale, 20.0).error, before.error);
  drive(scale, {.error = 300.0 * kPpm, .drift_radps = 100.0 * kDegH, .seed = 2});
  const ScaleFactorState after = state_at(scale, 20.0);
  EXPECT_EQ(after.refused, 0U);
  EXPECT_NEAR(after.error, 300.0 * kPpm, 4.0 * after.sigma);
}

}  // namespace
}  // namespace zerodrift::compensation
