// SPDX-License-Identifier: Apache-2.0
// The stack of experts on the data path: what is subtracted is what the experts together say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/experts/expert.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

using testing::LearnerTiming;

GyroSpec chamber(double duration_s) {
  return {.duration_s = duration_s, .low_degc = 20.0, .high_degc = 40.0};
}

// Of the drift that is left from `from_s` on, deg/h.
double rms_left(const Record& record, const std::vector<core::CompensatedSample>& answers,
                double from_s, core::Axis axis) {
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t k = 0; k < answers.size(); ++k) {
    if (core::seconds(answers[k].raw.time) < from_s) continue;
    const double left =
        answers[k].applied_drift_radps[index(axis)] - record.drift_radps[k][index(axis)];
    squares += left * left;
    count += 1.0;
  }
  return std::sqrt(squares / count) / kDegH;
}

// Rule: it compensates from the first labels on, says so, and is no worse than the online SVR
// alone.
TEST(CompensatorStack, AHealthyRunClimbsToTheStackAndIsAsGoodAsTheSvrAlone) {
  const Record record = make_record(chamber(1800.0));
  Compensator with_stack{testing::options()};
  Compensator with_svr{testing::svr_options()};
  const auto by_stack = testing::run(with_stack, record);
  const auto by_svr = testing::run(with_svr, record);
  std::size_t first = 0;
  while (by_stack[first].rung[0] != core::Rung::kStack) ++first;
  // A temperature rate takes a minute, a label ten seconds, its way into force six.
  EXPECT_LT(core::seconds(by_stack[first].raw.time), 100.0);
  for (const auto axis : core::kAxes) {
    const std::size_t i = index(axis);
    EXPECT_EQ(by_stack.back().rung[i], core::Rung::kStack);
    EXPECT_EQ(by_stack.back().mode[i], core::Mode::kLearning);
    EXPECT_EQ(by_stack.back().reason[i], core::Reason::kNone);
    EXPECT_GT(by_stack.back().drift_variance[i], 0.0);
    const double stack = rms_left(record, by_stack, 900.0, axis);
    const double svr = rms_left(record, by_svr, 900.0, axis);
    std::printf("axis %zu: stack %.4f, online SVR %.4f deg/h\n", i, stack, svr);
    EXPECT_LE(stack, svr);
    const auto told = with_stack.stack_state(axis);
    ASSERT_TRUE(told);
    EXPECT_NEAR(std::accumulate(told->shares.begin(), told->shares.end(), 0.0), 1.0, 1e-9);
    EXPECT_EQ(told->longest_judged_s, 900.0);
    EXPECT_FALSE(with_svr.stack_state(axis));
  }
}

// Rule: what a thermometer says once, and can't be, changes nothing: the drift that is taken off is
// to the bit what it is without that reading. Before: 50 deg/h at 85 °C, stated as known to .007.
TEST(CompensatorStackAbuse, OneReadingThatCanNotBeIsNotCompensatedFor) {
  const Record record = make_record(chamber(1200.0));
  Compensator clean{testing::options()};
  const auto expected = testing::run(clean, record);
  for (const double far_degc : {85.0, -55.0, 43.0}) {
    Record abused = record;
    abused.temperatures.clear();
    testing::Random random(static_cast<std::uint64_t>(far_degc + 100.0));
    for (const core::TemperatureSample& reading : record.temperatures) {
      const bool is_far = std::abs(far_degc - reading.temperature_degc) > 3.0;
      if (is_far && !abused.temperatures.empty() && random.below(10) == 0) {
        core::TemperatureSample wrong = reading;
        wrong.time -= from_seconds(0.3);
        wrong.temperature_degc = far_degc;
        abused.temperatures.push_back(wrong);
      }
      abused.temperatures.push_back(reading);
    }
    ASSERT_GT(abused.temperatures.size(), record.temperatures.size() + 10);
    Compensator compensator{testing::options()};
    const auto answers = testing::run(compensator, abused);
    ASSERT_EQ(answers.size(), expected.size());
    for (std::size_t k = 0; k < answers.size(); ++k)
      ASSERT_EQ(answers[k].applied_drift_radps, expected[k].applied_drift_radps) << k;
  }
}

// Rule: two readings a nanosecond apart, as frames of one read of a serial line have them, leave it
// whole. Before: no number in its memory, held for ever, and nothing that it saved could be loaded.
TEST(CompensatorStackAbuse, ReadingsOfNearlyTheSameInstantLeaveItWhole) {
  Record record = make_record(chamber(1200.0));
  const core::SensorTime epoch{1'795'900'000'000'000'000};
  for (auto& rate : record.rates) rate.time += epoch;
  std::vector<core::TemperatureSample> twice;
  for (core::TemperatureSample reading : record.temperatures) {
    reading.time += epoch;
    twice.push_back(reading);
    reading.time += core::SensorTime{1};
    reading.temperature_degc += 0.01;
    twice.push_back(reading);
  }
  record.temperatures = std::move(twice);
  Compensator compensator{testing::options()};
  const auto answers = testing::run(compensator, record);
  EXPECT_EQ(answers.back().rung[0], core::Rung::kStack);
  EXPECT_TRUE(compensator.learner().export_state().is_whole);
}

// Rule: samples further apart than a label, as far as half an hour, are learned from all the same;
// what is left is then below what the drift does on the whole.
TEST(CompensatorStack, SamplesFurtherApartThanALabelAreLearnedFrom) {
  for (const double interval_s : {6.0, 10.0, 12.0, 61.0, 300.0, 1800.0}) {
    GyroSpec spec = chamber(240.0 * interval_s);
    spec.rate_hz = 1.0 / interval_s;
    spec.temperature_interval_s = interval_s;
    spec.ramp_degc_per_min = 20.0 / interval_s;  // a leg of 60 samples
    const Record record = make_record(spec);
    Compensator compensator{CompensationOptions{}.for_samples_every(interval_s)};
    const auto answers = testing::run(compensator, record);
    const double half_s = 120.0 * interval_s;
    double mean = 0.0;
    double squares = 0.0;
    for (const auto& drift : record.drift_radps) mean += drift[0] / 240.0;
    for (const auto& drift : record.drift_radps)
      squares += (drift[0] - mean) * (drift[0] - mean) / 240.0;
    const double left = rms_left(record, answers, half_s, core::Axis::kX);
    std::printf("every %g s: %.4f left of %.4f deg/h\n", interval_s, left,
                std::sqrt(squares) / kDegH);
    EXPECT_EQ(answers.back().rung[0], core::Rung::kStack) << interval_s;
    EXPECT_LT(left, 0.5 * std::sqrt(squares) / kDegH) << interval_s;
  }
}

// Rule: whatever stream comes first and whenever the learner works, the bits are the same.
TEST(CompensatorStackLaws, LearnerTimingNeverChangesABit) {
  GyroSpec spec = chamber(900.0);
  spec.motion = testing::turn(400.0, 30.0, 0.01);
  const Record record = make_record(spec);
  Compensator at_once{testing::options()}, awaited{testing::options()};
  const auto a = testing::run(at_once, record, LearnerTiming::kAtOnce);
  const auto b = testing::run(awaited, record, LearnerTiming::kOnlyWhenAwaited);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].rate_radps, b[k].rate_radps) << k;
    ASSERT_EQ(a[k].drift_variance, b[k].drift_variance) << k;
  }
}

// Rule: in a turn the labels get older and with them the stated variance, and the mode says that
// nothing is learned.
TEST(CompensatorStack, InATurnItForecastsOnAndStatesMoreVariance) {
  GyroSpec spec = chamber(1500.0);
  spec.high_degc = 26.0;  // six minutes up, six down: the turn leads to nothing new
  spec.motion = testing::turn(900.0, 400.0, 0.01);
  const Record record = make_record(spec);
  Compensator compensator{testing::options()};
  const auto answers = testing::run(compensator, record);
  const auto at = [&](double time_s) -> const core::CompensatedSample& {
    return answers[static_cast<std::size_t>(time_s * spec.rate_hz)];
  };
  EXPECT_EQ(at(1250.0).mode[2], core::Mode::kFrozen);
  EXPECT_EQ(at(1250.0).reason[2], core::Reason::kMotion);
  EXPECT_EQ(at(1250.0).rung[2], core::Rung::kStack);
  for (std::size_t i = 0; i < core::kAxisCount; ++i) {
    EXPECT_GT(at(1000.0).drift_variance[i], at(890.0).drift_variance[i]);
    EXPECT_GT(at(1250.0).drift_variance[i], at(1000.0).drift_variance[i]);
  }
}

// Rule: without temperatures the stack isn't believed; they come again, and so does it.
TEST(CompensatorStack, WhenTemperatureStopsTheBiasTakesOverUntilItIsBack) {
  const GyroSpec spec = chamber(1200.0);
  Record record = make_record(spec);
  std::erase_if(record.temperatures, [](const auto& reading) {
    return reading.time > core::from_seconds(600.0) && reading.time < core::from_seconds(800.0);
  });
  CompensationOptions options = testing::options();
  Compensator compensator{options};
  std::vector<core::CompensatedSample> answers;
  std::size_t t = 0;
  for (const auto& sample : record.rates) {
    for (; t < record.temperatures.size() && record.temperatures[t].time <= sample.time; ++t)
      compensator.push(record.temperatures[t]);
    compensator.push(sample);
    compensator.give_up_waiting();
    testing::answer_ready(compensator, LearnerTiming::kAtOnce,
                          [&](const auto& answer) { answers.push_back(answer); });
  }
  const auto at = [&](double time_s) -> const core::CompensatedSample& {
    return answers[static_cast<std::size_t>(time_s * spec.rate_hz)];
  };
  EXPECT_EQ(at(590.0).rung[0], core::Rung::kStack);
  EXPECT_EQ(at(700.0).mode[0], core::Mode::kFallback);
  EXPECT_EQ(at(700.0).reason[0], core::Reason::kTemperatureStale);
  EXPECT_EQ(at(1100.0).rung[0], core::Rung::kStack);
  EXPECT_NE(at(1100.0).mode[0], core::Mode::kFallback);
}

// Rule: after the clock was set back it goes on with what it knows of temperature.
TEST(CompensatorStack, AfterTheClockWasSetBackItGoesOn) {
  const Record record = make_record(chamber(900.0));
  Compensator compensator{testing::options()};
  testing::run(compensator, record);
  compensator.restart_stream();
  const auto answers = testing::run(compensator, record);
  for (const auto axis : core::kAxes) {
    EXPECT_EQ(answers.back().rung[index(axis)], core::Rung::kStack);
    EXPECT_LT(rms_left(record, answers, 120.0, axis), 0.1) << index(axis);  // of two deg/h
  }
  for (const auto& answer : answers) {
    for (const double drift : answer.applied_drift_radps) ASSERT_TRUE(std::isfinite(drift));
  }
}

TEST(CompensatorStack, ARecordWithoutNoiseLeavesNumbers) {
  GyroSpec spec = chamber(600.0);
  spec.noise_deg_h_1s = 0.0;
  Compensator compensator{testing::options()};
  for (const auto& answer : testing::run(compensator, make_record(spec))) {
    for (const double drift : answer.applied_drift_radps) ASSERT_TRUE(std::isfinite(drift));
    for (const double variance : answer.drift_variance) ASSERT_TRUE(std::isfinite(variance));
  }
}

// Rule: features that are made of no temperature leave the experts that need none.
TEST(CompensatorStack, WithoutAnyProbeTheExpertsWithoutTemperatureAreLeft) {
  CompensationOptions options = testing::options();
  options.features = {{.kind = thermal::FeatureKind::kPulseMean}};
  Compensator compensator{options};
  const auto answers = testing::run(compensator, make_record(chamber(600.0)));
  EXPECT_EQ(answers.back().rung[0], core::Rung::kStack);
  EXPECT_TRUE(std::isfinite(answers.back().applied_drift_radps[0]));
}

}  // namespace
}  // namespace zerodrift::compensation
