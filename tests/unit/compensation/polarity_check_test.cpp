// SPDX-License-Identifier: Apache-2.0
// A sign is told wrong where nothing else explains it, and nowhere else.
#include "common/compensation/polarity_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "common/compensation/compensator.h"
#include "tests/unit/compensation/synthetic_gyro.h"

namespace zerodrift::compensation {
namespace {

constexpr double kNoLimit = 1e30;
using Source = PolarityCheck::Source;
using Function = std::function<double(int second)>;

// One block a second: what axis z measures and what is known of it.
void feed(PolarityCheck& check, int seconds, const Function& rate, const Function& known,
          Source source = Source::kTrueRate) {
  for (int t = 0; t < seconds; ++t) {
    check.add(Axis::kZ, rate(t), known(t), source);
    check.close(core::from_seconds(t + 1.0));
  }
}
// At rest and turning by turns, so many seconds each.
Function turns(double rate_radps, int period_s = 10) {
  return [=](int t) { return t / period_s % 2 == 0 ? 0.0 : rate_radps; };
}

TEST(PolarityCheck, TheOppositeSignAgainstTurnsIsFoundAndTheRightOneTakesItBack) {
  const Function known = turns(0.1);
  const Function drift = [](int t) { return 1e-3 + 1e-6 * t; };  // 200 deg/h and more
  PolarityCheck check(kNoLimit);
  feed(
      check, 25, [&](int t) { return drift(t) - known(t); }, known);
  EXPECT_FALSE(check.is_reversed(Axis::kZ)) << "after two changes";
  feed(
      check, 60, [&](int t) { return drift(t) - known(t); }, known);
  EXPECT_TRUE(check.is_reversed(Axis::kZ));
  EXPECT_FALSE(check.is_reversed(Axis::kX));
  EXPECT_EQ(check.found(), 1U);
  feed(
      check, 60, [&](int t) { return drift(t) + known(t); }, known);
  EXPECT_FALSE(check.is_reversed(Axis::kZ));
}

// Rule: neither noise, nor a drift larger than any turn, nor a reference that is late, of another
// scale, always the same, or of somebody else is a sign.
TEST(PolarityCheck, WhatElseCanDifferIsNoSign) {
  Random random(7);
  const Function known = turns(0.05);
  const auto check_of = [&](const Function& rate, const Function& reference) {
    PolarityCheck check(kNoLimit);
    feed(check, 5000, rate, reference);
    return check.found();
  };
  EXPECT_EQ(check_of([&](int t) { return known(t) + 1e-3 * random.gaussian(); }, known), 0U);
  EXPECT_EQ(check_of([&](int t) { return known(t) - 0.06 - 1e-6 * t; }, known), 0U) << "drift";
  for (const int late_s : {1, 2, 3})
    EXPECT_EQ(check_of([&](int t) { return known(t + late_s); }, known), 0U) << late_s;
  const Function swing = [](int t) { return 0.2 * std::sin(std::numbers::pi * t); };
  EXPECT_EQ(check_of([&](int t) { return swing(t + 1); }, swing), 0U) << "swings, late by half";
  EXPECT_EQ(check_of([&](int t) { return 3.0 * known(t); }, known), 0U) << "scale";
  EXPECT_EQ(check_of([](int) { return -0.05; }, [](int) { return 0.05; }), 0U) << "constant";
  EXPECT_EQ(check_of([&](int) { return 0.05 * random.gaussian(); }, known), 0U) << "other";
}

// What a table does from a rest of so many seconds on: levels of so many seconds each, in a circle.
Function table(int rest_s, std::vector<double> levels, int level_s) {
  return [=](int t) {
    if (t < rest_s) return 0.0;
    return levels[static_cast<std::size_t>((t - rest_s) / level_s) % levels.size()];
  };
}

// Rule: a reference that is late by half a period shows the opposite of what the axis does, and is
// no sign; the axis moved before it, or nothing tells the two from each other.
TEST(PolarityCheck, AReferenceThatIsLateByHalfAPeriodIsNoSign) {
  Random random(11);
  const std::vector<std::vector<double>> programs{
      {0.05, -0.05}, {0.05, 0.0}, {0.05, 0.0, -0.05, 0.0}, {0.02, 0.05, -0.02, -0.05}};
  for (const int rest_s : {0, 5, 10, 60, 900}) {
    for (const int level_s : {5, 10, 30, 45}) {
      for (std::size_t p = 0; p < programs.size(); ++p) {
        const int late_s = level_s * static_cast<int>(programs[p].size()) / 2;
        const Function known = table(rest_s + late_s, programs[p], level_s);
        PolarityCheck check(kNoLimit);
        feed(
            check, 5000, [&](int t) { return known(t + late_s) + 1e-3 + 1e-4 * random.gaussian(); },
            known);
        EXPECT_EQ(check.found(), 0U) << rest_s << " s, then levels of " << level_s << " s of " << p;
      }
    }
  }
}

// Rule: the opposite sign is found where the table began to turn behind a longer rest, or stands
// still between, since no reference that is late shows that.
TEST(PolarityCheck, ASignIsFoundWhereNoLatenessExplainsIt) {
  const std::vector<std::vector<double>> programs{
      {0.05, -0.05}, {0.05, 0.0}, {0.05, 0.0, -0.05, 0.0}, {0.02, 0.05, -0.02, -0.05}};
  for (const int rest_s : {60, 900}) {
    for (const int level_s : {5, 10, 30}) {
      for (const auto& program : programs) {
        const Function known = table(rest_s, program, level_s);
        PolarityCheck check(kNoLimit);
        feed(
            check, rest_s + 6 * level_s, [&](int t) { return 1e-3 - known(t); }, known);
        EXPECT_TRUE(check.is_reversed(Axis::kZ)) << rest_s << " s, then levels of " << level_s;
      }
    }
  }
  const Function swings = table(0, {0.05, -0.05}, 10);
  const Function stops = [&](int t) { return t < 600 ? swings(t) : 0.0; };
  PolarityCheck check(kNoLimit);
  feed(
      check, 600, [&](int t) { return -stops(t); }, stops);
  EXPECT_FALSE(check.is_reversed(Axis::kZ)) << "may be late";
  for (int t = 600; t < 620; ++t) {
    check.add(Axis::kZ, -stops(t), stops(t), Source::kTrueRate);
    check.close(core::from_seconds(t + 1.0));
  }
  EXPECT_TRUE(check.is_reversed(Axis::kZ)) << "stands still";
}

// Rule: the Earth decides where drift is known to be smaller than it, and only there.
TEST(PolarityCheck, AgainstTheEarthASignNeedsTheLargestDrift) {
  Random random(3);
  const double earth = 10.0 * kDegH;
  const auto found = [&](double largest_drift, double sign, double drift, double sigma) {
    PolarityCheck check(largest_drift);
    feed(
        check, 3600, [&](int) { return sign * earth + drift + sigma * random.gaussian(); },
        [&](int) { return earth; }, Source::kEarth);
    return check.is_reversed(Axis::kZ);
  };
  const double noise = kDegH;
  EXPECT_TRUE(found(2.0 * kDegH, -1.0, 1.0 * kDegH, noise));
  EXPECT_FALSE(found(2.0 * kDegH, 1.0, -2.0 * kDegH, noise));
  EXPECT_FALSE(found(kNoLimit, -1.0, 0.0, noise)) << "any drift is possible";
  EXPECT_FALSE(found(25.0 * kDegH, 1.0, -20.0 * kDegH, noise)) << "drift as large as twice";
  EXPECT_FALSE(found(2.0 * kDegH, -1.0, 0.0, 1000.0 * kDegH)) << "noise hides it";
  EXPECT_FALSE(found(2.0 * kDegH, 1.0, 0.0, 1000.0 * kDegH)) << "noise hides it";
}

// Rule: nothing is learned from an axis that turns the other way round, and its answers say why;
// the other axes go on.
TEST(PolarityCheck, AReversedAxisSaysSoAndIsNotLearnedFrom) {
  testing::GyroSpec spec;
  spec.duration_s = 300.0;
  spec.motion = [](double time_s, Axis) { return std::fmod(time_s, 20.0) < 10.0 ? 0.0 : 0.05; };
  testing::Record record = testing::make_record(spec);
  testing::add_true_rates(record, core::ReferenceKind::kRateTable);
  for (std::size_t k = 0; k < record.rates.size(); ++k) {
    record.rates[k].rate_radps[2] -= 2.0 * record.true_radps[k][2];
  }
  Compensator compensator{testing::options()};
  const auto answers = testing::run(compensator, record);
  EXPECT_EQ(answers.back().reason[2], core::Reason::kPolarityReversed);
  EXPECT_NE(answers.back().reason[0], core::Reason::kPolarityReversed);
  EXPECT_TRUE(compensator.is_reversed(Axis::kZ));
  EXPECT_EQ(compensator.counts().reversed_axes, 1U);

  CompensationOptions mounted = testing::options();
  mounted.mounting.axes = {"x", "y", "-z"};
  Compensator right{mounted};
  EXPECT_NE(testing::run(right, record).back().reason[2], core::Reason::kPolarityReversed);
  EXPECT_EQ(right.counts().reversed_axes, 0U);
}

// Rule: as above where the Earth says so, whose rate the wrong way round is more than any drift.
TEST(PolarityCheck, AnAxisThatShowsTheEarthReversedKeepsNoOtherFromLearning) {
  testing::GyroSpec spec;
  spec.duration_s = 900.0;
  const testing::Record record = testing::make_record(spec);
  CompensationOptions options = testing::options();
  options.earth_rate.mode = EarthRateMode::kKnown;
  options.earth_rate.rate_radps = {0.0, 0.0, -10.0 * kDegH};  // z measures the opposite and drift
  options.learning.rest.max_level_radps = 6.0 * kDegH;
  testing::Record reversed = record;
  for (auto& rate : reversed.rates) rate.rate_radps[2] += 10.0 * kDegH;
  Compensator compensator{options};
  const auto answers = testing::run(compensator, reversed);
  EXPECT_EQ(answers.at(400).reason[0], core::Reason::kLevelImplausible) << "until it is known";
  EXPECT_TRUE(compensator.is_reversed(Axis::kZ));
  EXPECT_EQ(answers.back().reason[2], core::Reason::kPolarityReversed);
  EXPECT_EQ(answers.back().mode[0], core::Mode::kLearning);
  EXPECT_EQ(answers.back().mode[1], core::Mode::kLearning);
  EXPECT_EQ(answers.back().applied_drift_radps[2], 0.0);
}

}  // namespace
}  // namespace zerodrift::compensation
