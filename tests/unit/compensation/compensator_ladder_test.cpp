// SPDX-License-Identifier: Apache-2.0
// The fallback ladder: stack or SVR, stationary bias, factory polynomial, nothing; and why.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

// Ten minutes of ramp, in which the model comes to be trusted.
GyroSpec ramp() {
  return {.duration_s = 900.0, .low_degc = 20.0, .high_degc = 25.0};
}

template <typename Condition>
std::size_t count(const std::vector<core::CompensatedSample>& answers, double from_s, double to_s,
                  Condition&& holds) {
  return static_cast<std::size_t>(
      std::count_if(answers.begin(), answers.end(), [&](const auto& answer) {
        return answer.raw.time > from_seconds(from_s) && answer.raw.time <= from_seconds(to_s) &&
               holds(answer);
      }));
}

bool all_axes(const core::CompensatedSample& answer, core::Mode mode, core::Reason reason,
              core::Rung rung) {
  return std::all_of(kAxes.begin(), kAxes.end(), [&](Axis axis) {
    const std::size_t i = index(axis);
    return answer.mode[i] == mode && answer.reason[i] == reason && answer.rung[i] == rung;
  });
}

struct Climb {
  CompensationOptions options;
  core::Rung rung;
  double on_bias_until_s;  // of a run from its begin
  double reset_on_bias_until_s;
};

// The SVR comes into force with the initial set of six labels, the stack with the second label, if
// the temperature rate is there, which takes the better part of its window of 60 s.
std::vector<Climb> climbs() {
  return {{testing::svr_options(), core::Rung::kOnlineSvr, 80.0, 860.0},
          {testing::options(), core::Rung::kStack, 55.0, 825.0}};
}

// Rule: a healthy run climbs the ladder: nothing, then the bias, then the learned model. The first
// label: ten blocks, ten more of the label (the tenth block at rest is its first), 5 s
// confirmation; closed by the sample after it.
class LadderOfEachScheme : public ::testing::TestWithParam<Climb> {};
INSTANTIATE_TEST_SUITE_P(SvrAndStack, LadderOfEachScheme, ::testing::ValuesIn(climbs()));

TEST_P(LadderOfEachScheme, AHealthyRunClimbsToTheLearnedModel) {
  const Climb& climb = GetParam();
  Compensator compensator{climb.options};
  const auto answers = testing::run(compensator, make_record(ramp()));
  EXPECT_EQ(count(answers, 0, 24.0,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kPassthrough, a.reason[0], core::Rung::kNone) &&
                           a.applied_drift_radps[0] == 0.0;
                  }),
            480U);
  const double until_s = climb.on_bias_until_s;
  EXPECT_EQ(count(answers, 25.0, until_s,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kHolding, a.reason[0],
                                    core::Rung::kStationaryBias);
                  }),
            static_cast<std::size_t>((until_s - 25.0) * 20.0));
  EXPECT_TRUE(all_axes(answers.back(), core::Mode::kLearning, core::Reason::kNone, climb.rung));
  EXPECT_EQ(compensator.rest_state(), RestState::kRest);
  for (const auto axis : kAxes) {
    const TestThenTrain& record = compensator.test_then_train(axis);
    EXPECT_GT(record.labels, 20U);
    EXPECT_LT(record.applied_mse, record.held_mse);
    EXPECT_GT(compensator.support_vectors(axis), 0U);
  }
}

// Rule: when the temperature stream stops, the model compensates until its newest reading is
// temperature_stale_s old, then the experts that need none do, or the SVR's last bias, and say why.
class WithoutTemperatureOfEachScheme : public ::testing::TestWithParam<Climb> {
 protected:
  [[nodiscard]] static CompensationOptions options() { return GetParam().options; }
  [[nodiscard]] static core::Rung simpler() {
    return GetParam().rung == core::Rung::kStack ? core::Rung::kStack : core::Rung::kStationaryBias;
  }
};
INSTANTIATE_TEST_SUITE_P(SvrAndStack, WithoutTemperatureOfEachScheme,
                         ::testing::ValuesIn(climbs()));

TEST_P(WithoutTemperatureOfEachScheme, WhenTemperatureStopsWhatNeedsNoneTakesOver) {
  Record record = make_record(ramp());
  std::erase_if(record.temperatures,
                [](const auto& reading) { return reading.time > from_seconds(600.0); });
  Compensator compensator{options()};
  const auto answers = testing::run(compensator, record);
  ASSERT_EQ(answers.size(), record.rates.size());
  // An estimate is renewed with each block: a second of leeway.
  EXPECT_EQ(count(answers, 600.0, 630.0,
                  [](const auto& a) {
                    return a.rung[0] == GetParam().rung && a.mode[0] == core::Mode::kLearning;
                  }),
            600U);
  EXPECT_EQ(count(answers, 632.0, 900.0,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kFallback, core::Reason::kTemperatureStale,
                                    simpler());
                  }),
            268U * 20U);
  // The bias goes on being learned. Its labels are 50 s old in the mean at most (half a minute,
  // half a label, confirmation and one more label to come); the drift moves at most 0.5 * pi / 2 *
  // pi / 300 s = 0.0082 deg/h/s by Shupe and 0.05 * pi / 2 / 60 = 0.0013 deg/h/s by temperature.
  EXPECT_NEAR(answers.back().applied_drift_radps[0], record.drift_radps.back()[0], 0.5 * kDegH);
}

// Rule: a probe that doesn't move for probe_stuck_s while another does is not believed.
TEST(CompensatorLadder, AStuckProbeIsNotBelievedWhileAnotherMoves) {
  GyroSpec spec = ramp();
  spec.high_degc = 60.0;
  spec.probes = {"coil", "case"};
  Record record = make_record(spec);
  CompensationOptions options = testing::options();
  options.features.push_back({.kind = thermal::FeatureKind::kTemperature, .probe = "case"});
  options.probe_stuck_s = 180.0;
  double stuck_at = 0.0;
  for (auto& reading : record.temperatures) {
    if (reading.probe != "case") continue;
    if (reading.time <= from_seconds(500.0)) stuck_at = reading.temperature_degc;
    reading.temperature_degc = stuck_at;
  }
  Compensator compensator{options};
  const auto answers = testing::run(compensator, record);
  const auto is_stuck = [](const auto& a) {
    return all_axes(a, core::Mode::kFallback, core::Reason::kProbeStuck, core::Rung::kStack);
  };
  EXPECT_EQ(count(answers, 0.0, 679.0, is_stuck), 0U);
  EXPECT_EQ(count(answers, 682.0, 900.0, is_stuck), 218U * 20U);
}

// Rule: two probes that both stand still in a steady room are not stuck.
TEST(CompensatorLadder, ProbesThatStandStillTogetherAreNotStuck) {
  GyroSpec spec = ramp();
  spec.high_degc = spec.low_degc;
  spec.probes = {"coil", "case"};
  CompensationOptions options = testing::options();
  options.features.push_back({.kind = thermal::FeatureKind::kTemperature, .probe = "case"});
  options.probe_stuck_s = 180.0;
  Compensator compensator{options};
  const auto answers = testing::run(compensator, make_record(spec));
  EXPECT_EQ(count(answers, 0.0, 900.0,
                  [](const auto& a) { return a.reason[0] == core::Reason::kProbeStuck; }),
            0U);
}

// Rule: without any temperature what needs none compensates, from the first label on.
TEST_P(WithoutTemperatureOfEachScheme, FromTheFirstLabelOnWhatNeedsNoneCompensates) {
  GyroSpec spec = ramp();
  spec.high_degc = spec.low_degc;
  Record record = make_record(spec);
  record.temperatures.clear();
  Compensator compensator{options()};
  const auto answers = testing::run(compensator, record);
  ASSERT_EQ(answers.size(), record.rates.size());
  EXPECT_EQ(count(answers, 26.0, 900.0,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kFallback, core::Reason::kTemperatureMissing,
                                    simpler());
                  }),
            874U * 20U);
  if (const auto stack = compensator.stack_state(Axis::kX)) {
    double maps = 0.0;
    for (std::size_t k = experts::kFirstMap; k < experts::kExperts; ++k) maps += stack->shares[k];
    EXPECT_EQ(maps, 0.0);
  }
  // Mean of six labels: sigma 0.056 / sqrt(60) = 0.0072 deg/h; 5 sigma.
  EXPECT_NEAR(answers.back().applied_drift_radps[1], record.drift_radps.back()[1], 0.036 * kDegH);
  EXPECT_TRUE(std::isnan(compensator.temperature_degc()));
}

// Rule: without a thermometer, drift that goes on is followed as a filter of level and slope does
// it, and what is stated of the error holds at rest and through drives of ten minutes.
TEST(CompensatorLadder, WithoutAThermometerADriftThatGoesOnIsFollowed) {
  GyroSpec spec = ramp();
  spec.duration_s = 7200.0;
  spec.ramp_degc_per_min = 0.1;
  spec.high_degc = 30.0;
  spec.rate_hz = 10.0;
  spec.motion = [](double t, Axis axis) {
    const double phase = std::fmod(t, 900.0);
    return axis == Axis::kZ && phase > 300.0 ? 0.02 * std::sin(0.1 * t) : 0.0;
  };
  Record record = make_record(spec);
  record.temperatures.clear();
  CompensationOptions held = testing::svr_options();
  double squares[2] = {};
  double covered = 0.0, moving = 0.0;
  for (const bool by_stack : {false, true}) {
    Compensator compensator{by_stack ? testing::options() : held};
    const auto answers = testing::run(compensator, record);
    ASSERT_EQ(answers.size(), record.rates.size());
    for (std::size_t i = answers.size() / 4; i < answers.size(); ++i) {
      const double error = answers[i].applied_drift_radps[0] - record.drift_radps[i][0];
      squares[by_stack ? 1 : 0] += error * error;
      if (!by_stack || std::fmod(seconds(answers[i].raw.time), 900.0) < 320.0) continue;
      moving += 1.0;
      covered += error * error < 3.84 * answers[i].drift_variance[0] ? 1.0 : 0.0;
    }
  }
  EXPECT_LT(std::sqrt(squares[1] / squares[0]), 0.8);
  EXPECT_GT(covered / moving, 0.85);
}

// Rule: before anything is learned, a factory polynomial compensates by the newest temperature.
TEST(CompensatorLadder, BeforeAnythingIsLearnedTheFactoryPolynomialCompensates) {
  GyroSpec spec = ramp();
  spec.duration_s = 20.0;
  CompensationOptions options = testing::options();
  options.factory_polynomial_radps[0] = {1e-5, 2e-7, -3e-9};
  Compensator compensator{options};
  const auto answers = testing::run(compensator, make_record(spec));
  // The newest temperature up to 0.05 s before: at 18.95 s the reading of 18 s.
  const core::CompensatedSample& answer = answers[18 * 20 + 18];
  ASSERT_EQ(answer.raw.time, from_seconds(18.95));
  const double t = testing::Chamber(spec).temperature_degc(18.0);
  EXPECT_EQ(answer.rung[0], core::Rung::kFactoryPolynomial);
  EXPECT_EQ(answer.mode[0], core::Mode::kFallback);
  EXPECT_EQ(answer.reason[0], core::Reason::kNoEstimateYet);
  EXPECT_NEAR(answer.applied_drift_radps[0], 1e-5 + 2e-7 * t - 3e-9 * t * t, 1e-18);
  EXPECT_EQ(answer.rung[1], core::Rung::kNone);  // an axis without one
  EXPECT_EQ(answer.mode[1], core::Mode::kPassthrough);
}

// Rule: a factory polynomial goes by a temperature that is known; with a stale one it says nothing.
TEST(CompensatorLadder, AFactoryPolynomialIsNotAppliedToAStaleTemperature) {
  GyroSpec spec = ramp();
  spec.duration_s = 120.0;
  Record record = make_record(spec);
  std::erase_if(record.temperatures,
                [](const auto& reading) { return reading.time > from_seconds(60.0); });
  CompensationOptions options = testing::options();
  options.factory_polynomial_radps[0] = {1e-5};
  Compensator compensator{options};
  compensator.freeze();  // so that no bias is ever learned
  const auto answers = testing::run(compensator, record);
  EXPECT_EQ(answers[80 * 20].rung[0], core::Rung::kFactoryPolynomial);
  // Stale after 30 s without a reading; an estimate is renewed with each block.
  EXPECT_EQ(count(answers, 92.0, 120.0,
                  [](const auto& a) {
                    return a.rung[0] == core::Rung::kNone && a.mode[0] == core::Mode::kPassthrough;
                  }),
            28U * 20U);
}

// Rule: outside the learned temperatures the online SVR alone says so, goes from the last safe
// value to the bias with a time constant of 10 s, without a jump, and its variance grows.
TEST(CompensatorLadder, OutsideTheLearnedTemperaturesTheSvrReturnsToTheBiasAndSaysSo) {
  GyroSpec spec = ramp();
  spec.duration_s = 1800.0;
  Record record = make_record(spec);
  // From 1000 s on the coil heats 6 °C/min, far past all that was learned (25 °C, 1.6 °C/min), with
  // learning frozen.
  for (auto& reading : record.temperatures) {
    const double t = seconds(reading.time);
    if (t > 1000.0) reading.temperature_degc = 25.0 + (t - 1000.0) / 10.0;
  }
  Compensator compensator{testing::svr_options()};
  std::vector<core::CompensatedSample> answers;
  testing::run(compensator, record, [&](const core::CompensatedSample& answer) {
    answers.push_back(answer);
    if (answers.size() == 990U * 20U) compensator.freeze();
  });
  const auto is_outside = [](const core::CompensatedSample& a) {
    return a.mode[0] == core::Mode::kOutOfDomain && a.reason[0] == core::Reason::kOutsideLearned &&
           a.rung[0] == core::Rung::kStationaryBias;
  };
  // The temperature rate follows within its window of 60 s.
  EXPECT_EQ(count(answers, 1060.0, 1800.0, is_outside), 740U * 20U);
  const auto last_inside = std::find_if_not(answers.rbegin(), answers.rend(), is_outside);
  ASSERT_NE(last_inside, answers.rend());
  const core::CompensatedSample& inside = *last_inside;
  const core::CompensatedSample& first = *(last_inside - 1);
  const core::CompensatedSample& later = *(last_inside - 1 - 50 * 20);
  const double safe = inside.applied_drift_radps[0];
  const double bias =
      answers.back().applied_drift_radps[0];  // after 740 s / 10 s: exp(-74) is left
  ASSERT_EQ(inside.rung[0], core::Rung::kOnlineSvr);
  // Renewed once or twice a second: the first step goes at most 1 - exp(-0.2) of the way.
  EXPECT_LE(std::abs(first.applied_drift_radps[0] - safe), 0.19 * std::abs(bias - safe));
  // exp(-5) after 50 s, a step of one second early or late.
  EXPECT_LE(std::abs(later.applied_drift_radps[0] - bias), std::exp(-4.8) * std::abs(bias - safe));
  EXPECT_GE(std::abs(later.applied_drift_radps[0] - bias), std::exp(-5.2) * std::abs(bias - safe));
  EXPECT_GT(answers.back().drift_variance[0], 10.0 * inside.drift_variance[0]);
}

// Rule: of a real sensor whose attitude is unknown, Earth rate must not be learned as drift; a gyro
// noisier than Earth rate may learn.
TEST(CompensatorLadder, EarthRateOfUnknownAttitudeIsNotLearnedByAGyroThatSeesIt) {
  GyroSpec spec = ramp();
  spec.duration_s = 120.0;
  spec.clock = core::ClockSource::kHardware;
  Compensator compensator{testing::options()};
  const auto answers = testing::run(compensator, make_record(spec));
  EXPECT_EQ(count(answers, 11.0, 120.0,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kPassthrough, core::Reason::kEarthRateUnknown,
                                    core::Rung::kNone);
                  }),
            109U * 20U);
  EXPECT_EQ(compensator.counts().labels, 0U);

  spec.noise_deg_h_1s = 50.0;
  Compensator noisy{testing::options()};
  testing::run(noisy, make_record(spec));
  EXPECT_GT(noisy.counts().labels, 5U);
}

// Rule: a known Earth rate is taken off before anything is learned, so it is never applied as
// drift.
TEST(CompensatorLadder, AKnownEarthRateIsNotPartOfTheDrift) {
  GyroSpec spec = ramp();
  spec.duration_s = 120.0;
  spec.high_degc = spec.low_degc;
  spec.clock = core::ClockSource::kHardware;
  const core::PerAxis<double> earth{5e-5, 0.0, -4e-5};
  spec.motion = [&](double, Axis axis) { return earth[index(axis)]; };
  CompensationOptions options = testing::options();
  options.earth_rate = {.mode = EarthRateMode::kKnown, .rate_radps = earth};
  Compensator compensator{options};
  const Record record = make_record(spec);
  const auto answers = testing::run(compensator, record);
  for (const auto axis : kAxes) {
    const std::size_t i = index(axis);
    ASSERT_NE(answers.back().rung[i], core::Rung::kNone);
    // A label of 10 s: 0.018 deg/h; 5 sigma.
    EXPECT_NEAR(answers.back().applied_drift_radps[i], record.drift_radps.back()[i], 0.09 * kDegH);
  }
}

// Rule: a freeze stops learning and says so; the model goes on compensating; learn() undoes it.
TEST(CompensatorLadder, AFreezeStopsLearningUntilToldToLearn) {
  GyroSpec spec = ramp();
  spec.duration_s = 1200.0;
  Compensator compensator{testing::options()};
  std::vector<core::CompensatedSample> answers;
  std::uint64_t labels_frozen = 0, labels_thawed = 0;
  testing::run(compensator, make_record(spec), [&](const core::CompensatedSample& answer) {
    answers.push_back(answer);
    if (answers.size() == 800U * 20U) {
      compensator.freeze();
      labels_frozen = compensator.counts().labels;
    }
    if (answers.size() == 1000U * 20U) {
      labels_thawed = compensator.counts().labels;
      compensator.learn();
    }
  });
  EXPECT_EQ(labels_thawed, labels_frozen);
  EXPECT_GT(compensator.counts().labels, labels_thawed + 15);  // 200 s less 5 s of confirmation
  EXPECT_EQ(count(answers, 802.0, 1000.0,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kFrozen, core::Reason::kCommanded,
                                    core::Rung::kStack);
                  }),
            198U * 20U);
  // What was learned just before may take effect within the handover (1 s); then the epoch stands.
  EXPECT_EQ(answers[802U * 20U].model_epoch, answers[999U * 20U].model_epoch);
  EXPECT_TRUE(
      all_axes(answers.back(), core::Mode::kLearning, core::Reason::kNone, core::Rung::kStack));
}

// Before: a mean that was held went on waiting for a first set that nobody collected any more.
TEST(CompensatorLadder, AFreezeWhileAMeanIsHeldIsSaid) {
  GyroSpec spec = ramp();
  spec.duration_s = 200.0;
  Compensator compensator{testing::options()};
  std::vector<core::CompensatedSample> answers;
  bool was_held = false;
  testing::run(compensator, make_record(spec), [&](const core::CompensatedSample& answer) {
    answers.push_back(answer);
    if (was_held || answer.reason[0] != core::Reason::kInitialSet) return;
    was_held = true;
    compensator.freeze();
  });
  ASSERT_TRUE(was_held);
  EXPECT_TRUE(all_axes(answers.back(), core::Mode::kHolding, core::Reason::kCommanded,
                       core::Rung::kStationaryBias));
}

// Rule: a reset forgets everything learned at once, and learning begins anew.
TEST_P(LadderOfEachScheme, AResetForgetsAndLearningBeginsAnew) {
  GyroSpec spec = ramp();
  spec.duration_s = 1500.0;
  const Climb& climb = GetParam();
  Compensator compensator{climb.options};
  std::vector<core::CompensatedSample> answers;
  testing::run(compensator, make_record(spec), [&](const core::CompensatedSample& answer) {
    answers.push_back(answer);
    if (answers.size() == 800U * 20U) {
      ASSERT_GT(compensator.support_vectors(Axis::kX), 0U);
      ASSERT_TRUE(compensator.reset_models());
      EXPECT_EQ(compensator.test_then_train(Axis::kX).labels, 0U);
    }
    if (answers.size() == 805U * 20U) {
      EXPECT_EQ(compensator.support_vectors(Axis::kX), 0U);
    }
  });
  EXPECT_EQ(count(answers, 800.0, 814.0,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kPassthrough, core::Reason::kNoEstimateYet,
                                    core::Rung::kNone);
                  }),
            280U);
  const double until_s = climb.reset_on_bias_until_s;
  EXPECT_EQ(count(answers, 817.0, until_s,
                  [](const auto& a) {
                    return all_axes(a, core::Mode::kHolding, a.reason[0],
                                    core::Rung::kStationaryBias);
                  }),
            static_cast<std::size_t>((until_s - 817.0) * 20.0));
  EXPECT_TRUE(all_axes(answers.back(), core::Mode::kLearning, core::Reason::kNone, climb.rung));
}

// Rule: scheme none takes nothing off and learns nothing.
TEST(CompensatorLadder, SchemeNonePassesEverythingThrough) {
  CompensationOptions options = testing::options();
  options.scheme = Scheme::kNone;
  Compensator compensator{options};
  const auto answers = testing::run(compensator, make_record(ramp()));
  for (const auto& answer : answers) {
    ASSERT_TRUE(
        all_axes(answer, core::Mode::kPassthrough, core::Reason::kSchemeNone, core::Rung::kNone));
    ASSERT_EQ(answer.rate_radps, answer.raw.rate_radps);
  }
  EXPECT_FALSE(compensator.learner().run_one());
}

}  // namespace
}  // namespace zerodrift::compensation
