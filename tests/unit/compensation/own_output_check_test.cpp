// SPDX-License-Identifier: Apache-2.0
// The compensation notices that it is given its own output, and takes nothing else for it.
#include "common/compensation/own_output_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <functional>
#include <vector>

#include "common/compensation/compensator.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

constexpr double kSigma = 0.05;
constexpr core::PerAxis<double> kSigmas{kSigma, kSigma, kSigma};

// Axis z with noise, one sample a block; the applied drift is `taken`.
std::uint64_t found_of(const std::function<double(int)>& rate,
                       const std::function<double(int)>& taken, int blocks = 2000) {
  OwnOutputCheck check;
  Random random(5);
  for (int t = 0; t < blocks; ++t) {
    check.add(core::Axis::kZ, rate(t) + kSigma * random.gaussian(), taken(t));
    check.close(kSigmas);
  }
  return check.found();
}

double steps(int t) {
  return t / 20 % 2 == 0 ? 0.0 : 20.0 * kSigma;
}

TEST(OwnOutputCheck, StepsThatComeBackWithTheOppositeSignAreFoundOnce) {
  EXPECT_EQ(found_of([](int t) { return 1.0 - steps(t); }, steps), 1U);
  EXPECT_EQ(found_of([](int t) { return 1.0 - steps(t - 1); }, steps), 1U) << "a second later";
}

TEST(OwnOutputCheck, AStepThatStaysWithoutAnAnswerTakesItBack) {
  OwnOutputCheck check;
  const auto run = [&](int from, int to, double answer) {
    for (int t = from; t < to; ++t) {
      check.add(core::Axis::kZ, 1.0 - answer * steps(t), steps(t));
      check.close(kSigmas);
    }
    return check.is_own(core::Axis::kZ);
  };
  EXPECT_TRUE(run(0, 1000, 1.0));
  EXPECT_FALSE(check.is_own(core::Axis::kX));
  EXPECT_FALSE(run(1000, 1100, 0.0));
}

// Rule: a raw rate that doesn't answer, answers with the same sign (the drift itself steps), by
// another amount, or turns, and steps that are no larger than the noise, are no such thing.
TEST(OwnOutputCheck, WhatDoesNotAnswerIsRaw) {
  EXPECT_EQ(found_of([](int) { return 1.0; }, steps), 0U);
  EXPECT_EQ(found_of([](int t) { return steps(t); }, steps), 0U) << "the drift steps";
  EXPECT_EQ(found_of([](int t) { return -2.0 * steps(t); }, steps), 0U) << "by twice";
  EXPECT_EQ(found_of([](int t) { return t / 33 % 2 == 0 ? 0.0 : 3.0; }, steps), 0U) << "turns";
  EXPECT_EQ(found_of([](int t) { return -0.1 * steps(t); }, [](int t) { return 0.1 * steps(t); }),
            0U)
      << "small steps";
}

// Rule: where the loop closes in mid-run, the rate falls by all that is taken off; it takes one
// answer more. The axis of a gyro that is turned over may fall as far, and doesn't answer.
TEST(OwnOutputCheck, ALoopThatClosesInMidRunTakesOneAnswer) {
  constexpr double kDrift = 400.0 * kSigma;
  const auto taken = [](int t) { return t > 20 && t < 700 ? kDrift : 0.0; };
  const auto closes = [&](int t) { return t < 300 ? kDrift : kDrift - taken(t - 1); };
  EXPECT_EQ(found_of(closes, taken, 1000), 1U);
  EXPECT_EQ(found_of([](int t) { return t < 300 ? kDrift : 0.0; }, taken), 0U) << "turned over";
  EXPECT_EQ(found_of(closes, taken, 690), 0U) << "nothing was asked yet";
}

// Rule: a drift that moves on, or that steps by as much while nothing steps in what is taken off,
// doesn't answer where it happens to go the other way. Labels of 60 s beside cycles of 150 s of a
// chamber, and a telegraph noise, were such drifts.
TEST(OwnOutputCheck, ADriftThatMovesByItselfIsNoAnswer) {
  const auto half = [](int t) { return t % 60 < 30 ? 21.0 * kSigma : kSigma; };
  const auto ramps = [](int t) { return 20.0 * kSigma * std::abs((t + 12) % 60 - 30) / 6.0; };
  EXPECT_EQ(found_of(ramps, half), 0U);
  const auto telegraph = [](int t) {
    return t % 60 < 10 || t % 60 / 10 == 2 ? 0.0 : 20.0 * kSigma;
  };
  EXPECT_EQ(found_of(telegraph, half), 0U);
}

// Rule: a drift that is large beside the noise, first taken off and gone as exactly, is answer
// enough; the rest gate takes what it left behind for motion, for hours. A turn isn't as exact.
TEST(OwnOutputCheck, AFirstStepThatIsAnsweredExactlyIsFoundAtOnce) {
  const auto taken = [](int t) { return t < 20 ? 0.0 : 300.0 * kSigma; };
  EXPECT_EQ(found_of([&](int t) { return 300.0 * kSigma - taken(t - 1); }, taken, 40), 1U);
  EXPECT_EQ(found_of([&](int t) { return 300.0 * kSigma - 1.05 * taken(t - 1); }, taken, 40), 0U);
  const auto later = [&](int t) { return kSigma + taken(t); };
  EXPECT_EQ(found_of([&](int t) { return 300.0 * kSigma - taken(t - 1); }, later, 40), 0U)
      << "not the first";
}

// As a subscriber would that publishes the corrected rate as a raw one, so many samples later.
std::vector<core::CompensatedSample> run_on_own_output(Compensator& compensator,
                                                       const Record& record, std::size_t later) {
  std::vector<core::CompensatedSample> answers;
  std::size_t t = 0;
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    core::AngularRateSample sample = record.rates[k];
    if (k >= later) {
      for (std::size_t i = 0; i < core::kAxisCount; ++i)
        sample.rate_radps[i] -= answers[k - later].applied_drift_radps[i];
    }
    for (; t < record.temperatures.size() && record.temperatures[t].time <= sample.time; ++t)
      compensator.push(record.temperatures[t]);
    compensator.push(sample);
    for (;;) {
      while (compensator.learner().run_one()) {
      }
      if (compensator.readiness() != Readiness::kReady) compensator.give_up_waiting();
      if (compensator.readiness() != Readiness::kReady) break;
      answers.push_back(compensator.answer_next());
    }
  }
  return answers;
}

GyroSpec warming() {
  return {.duration_s = 900.0, .low_degc = 20.0, .high_degc = 40.0};
}

TEST(OwnOutput, IsFoundInTheLoopAndNotWithoutIt) {
  const Record record = make_record(warming());
  for (const std::size_t later : {1U, 10U, 20U}) {  // 50 ms to a second
    Compensator compensator{testing::options()};
    run_on_own_output(compensator, record, later);
    EXPECT_GT(compensator.counts().own_outputs, 0U) << later;
    EXPECT_TRUE(std::any_of(core::kAxes.begin(), core::kAxes.end(), [&](core::Axis axis) {
      return compensator.is_given_own_output(axis);
    })) << later;
  }
  Compensator compensator{testing::options()};
  testing::run(compensator, record);
  EXPECT_EQ(compensator.counts().own_outputs, 0U);
  for (const auto axis : core::kAxes) EXPECT_FALSE(compensator.is_given_own_output(axis));
}

TEST(OwnOutput, OfALargeDriftIsFoundInTheFirstMinute) {
  GyroSpec spec = warming();
  spec.duration_s = 60.0;
  spec.offset_deg_h = 300.0;
  const Record record = make_record(spec);
  Compensator compensator{testing::options()};
  run_on_own_output(compensator, record, 2);
  EXPECT_EQ(compensator.counts().own_outputs, core::kAxisCount);
}

}  // namespace
}  // namespace zerodrift::compensation
