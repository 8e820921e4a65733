// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/core/units.h"
#include "common/diagnosis/diagnosis.h"
#include "tests/unit/diagnosis/simulated_series.h"

namespace zerodrift::diagnosis {
namespace {

constexpr core::Axis kX = core::Axis::kX;
constexpr double kDegS = core::kRadPerDeg;

MeasuredSeries still(std::size_t size, double sigma_radps, std::uint64_t seed) {
  MeasuredSeries series;
  series.interval_s = series.sample_period_s = 1.0;
  series.size = size;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, sigma_radps);
  for (std::size_t i = 0; i < size; ++i) series.rate_radps[0].push_back(normal(random));
  series.valid[0].assign(size, 1);
  for (auto& reference : series.reference_radps) reference.assign(size, 0.0);
  series.since_power_on_s.assign(size, 1.0);
  return series;
}

void turn(MeasuredSeries& series, std::size_t begin, std::size_t end, double rate_radps) {
  for (std::size_t i = begin; i < end; ++i) series.rate_radps[0][i] += rate_radps;
}

// 1 s noise: a fibre-optic gyro's, a MEMS one's of the worst published record (2.7 deg/sqrt(h)).
TEST(MotionLaws, NoiseOfAnyGyroDriftStepsAndSpikesAreNoMotion) {
  for (const double sigma_deg_h : {0.05, 10.0, 165.0}) {
    SCOPED_TRACE(sigma_deg_h);
    MeasuredSeries series = still(6000, core::radps_from_deg_h(sigma_deg_h), 3);
    for (std::size_t i = 0; i < series.size; ++i) {
      const double hours = static_cast<double>(i) / core::kSecondsPerHour;
      series.rate_radps[0][i] += core::radps_from_deg_h(5000.0 * std::sin(2.0 * hours));
      if (i >= 2000) series.rate_radps[0][i] += core::radps_from_deg_h(100.0);
      if (i % 600 == 0) series.rate_radps[0][i] += 2.0 * kDegS;
    }
    EXPECT_FALSE(motion_without_reference(series, kX).has_value());
  }
}

// A MEMS gyro in a chamber: its bias wanders by 1.5 deg/s and once jumps for good by 470 deg/h.
TEST(MotionLaws, AJumpOfAWanderingBiasIsNoTurn) {
  MeasuredSeries series = still(8000, core::radps_from_deg_h(50.0), 3);
  for (std::size_t i = 0; i < series.size; ++i) {
    const double hours = static_cast<double>(i) / core::kSecondsPerHour;
    series.rate_radps[0][i] += core::radps_from_deg_h(5400.0 * std::sin(3.0 * hours));
    if (i >= 2020) series.rate_radps[0][i] += core::radps_from_deg_h(470.0);
  }
  const auto motion = motion_without_reference(series, kX);
  if (!motion) return;
  EXPECT_LT(motion->moving_share, 0.002);
  EXPECT_EQ(motion->at_rest.size(), series.size);
}

TEST(MotionLaws, ACoarseReadingIsNoMotion) {
  constexpr double kStep = 0.05 * kDegS;
  MeasuredSeries series = still(4000, 0.4 * kStep, 5);
  for (double& rate : series.rate_radps[0]) rate = kStep * std::round(rate / kStep);
  EXPECT_FALSE(motion_without_reference(series, kX).has_value());
}

TEST(MotionLaws, TurnsAreFoundAndTheLongestStretchInOneOrientationIsLeft) {
  MeasuredSeries series = still(10'000, core::radps_from_deg_h(10.0), 7);
  turn(series, 2000, 2400, 0.2 * kDegS);  // slow and steady: only its ends change
  turn(series, 8000, 8009, 10.0 * kDegS);
  const auto motion = motion_without_reference(series, kX);
  ASSERT_TRUE(motion.has_value());
  // Up to five intervals each side of a turn stand in windows with it.
  EXPECT_NEAR(motion->moving_share, 0.0409, 0.003);
  EXPECT_NEAR(static_cast<double>(motion->at_rest.begin), 2400.0, 6.0);
  EXPECT_NEAR(static_cast<double>(motion->at_rest.end), 8000.0, 6.0);
}

// A rate table's steps are of any size; a bias of this gyro never jumped by a thousand times its
// noise and back.
TEST(MotionLaws, InARecordThatTurnsASlowTurnIsOneToo) {
  for (const double slow_deg_h : {-170.0, -30.0, 25.0, 110.0}) {
    SCOPED_TRACE(slow_deg_h);
    MeasuredSeries series = still(10'000, core::radps_from_deg_h(0.2), 7);
    turn(series, 3000, 3200, core::radps_from_deg_h(slow_deg_h));
    EXPECT_FALSE(motion_without_reference(series, kX).has_value()) << "nothing says that it turns";
    turn(series, 9000, 9100, 2.0 * kDegS);
    const auto motion = motion_without_reference(series, kX);
    ASSERT_TRUE(motion.has_value());
    EXPECT_NEAR(static_cast<double>(motion->at_rest.begin), 3200.0, 6.0);
    EXPECT_NEAR(static_cast<double>(motion->at_rest.end), 9000.0, 6.0);
    EXPECT_EQ(std::count(motion->moving.begin() + 3006, motion->moving.begin() + 3194, 1), 188);
  }
}

TEST(MotionLaws, ATurnThatEndsWhereItBeganDoesNotCutTheRecord) {
  MeasuredSeries series = still(10'000, core::radps_from_deg_h(0.1), 7);
  turn(series, 4000, 4010, 5.0 * kDegS);
  turn(series, 4010, 4020, -5.0 * kDegS);
  const auto motion = motion_without_reference(series, kX);
  ASSERT_TRUE(motion.has_value());
  EXPECT_EQ(motion->at_rest.size(), series.size);
  const MeasuredSeries part = part_at_rest(series, *motion);
  EXPECT_EQ(part.valid[0][4005], 0);
  EXPECT_EQ(part.valid[0][4100], 1);
}

TEST(MotionLaws, AGyroThatAlwaysTurnsHasNoRest) {
  MeasuredSeries series = still(5000, core::radps_from_deg_h(1.0), 9);
  for (std::size_t i = 0; i < series.size; ++i)
    series.rate_radps[0][i] += 5.0 * kDegS * std::sin(static_cast<double>(i) / 3.0);
  const auto sway = motion_without_reference(series, kX);
  ASSERT_TRUE(sway.has_value());
  EXPECT_LT(sway->at_rest.size(), 60U);
  MeasuredSeries steady = still(5000, core::radps_from_deg_h(1.0), 9);
  turn(steady, 0, steady.size, 30.0 * kDegS);
  ASSERT_TRUE(motion_without_reference(steady, kX).has_value());
  EXPECT_EQ(motion_without_reference(steady, kX)->at_rest.size(), 0U);
}

TEST(MotionLaws, WhereTheTrueRateIsGivenATurnIsNoMatter) {
  MeasuredSeries series = still(5000, core::radps_from_deg_h(1.0), 9);
  turn(series, 2000, 2400, 5.0 * kDegS);
  for (std::size_t i = 2000; i < 2400; ++i) series.reference_radps[0][i] = 5.0 * kDegS;
  EXPECT_FALSE(motion_without_reference(series, kX).has_value());
}

TEST(MotionLaws, APartOfARecordHasAsMuchOfEveryChannel) {
  const MeasuredSeries whole = test::simulated(test::lab_model(), test::chamber_profile(), 3);
  const MeasuredSeries part = part_of(whole, 1000, 4000);
  ASSERT_EQ(part.size, 3000U);
  EXPECT_EQ(part.time_s(0), whole.time_s(1000));
  EXPECT_EQ(part.rate_radps[0].size(), part.size);
  EXPECT_EQ(part.rate_radps[0].front(), whole.rate_radps[0][1000]);
  EXPECT_TRUE(part.rate_radps[1].empty());
  ASSERT_EQ(part.probes.size(), whole.probes.size());
  EXPECT_EQ(part.probes[0].temperature_degc.back(), whole.probes[0].temperature_degc[3999]);
  EXPECT_EQ(part.supply_v.size(), part.size);
  EXPECT_EQ(part.since_power_on_s.front(), whole.since_power_on_s[1000]);
}

// The shipped laboratory gyro on the shipped profile, whose turns nobody tells.
MeasuredSeries without_reference(MeasuredSeries series) {
  series.has_reference = false;
  for (auto& reference : series.reference_radps) reference.assign(series.size, 0.0);
  return series;
}

// Before: an unknown effect of thousands of deg/h.
TEST(MotionScenario, ARecordOfTurnsWithoutAReferenceCanNotBeDecided) {
  const twin::Model model = test::lab_model();
  MeasuredSeries record = without_reference(test::simulated(model, test::chamber_profile(), 11));
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> rates(-20.0 * kDegS, 20.0 * kDegS);
  for (std::size_t begin = 0; begin < record.size; begin += 120)  // a drive
    turn(record, begin, std::min(begin + 90, record.size), rates(random));
  const AxisDiagnosis axis = *diagnose(model, record, {}, {}).axes[0];
  EXPECT_EQ(axis.verdict, Verdict::kUndecidable) << axis.sentence;
  EXPECT_FALSE(axis.examined);
  EXPECT_FALSE(axis.unknown.has_value());
  EXPECT_NE(axis.sentence.find("true rate is not given"), std::string::npos) << axis.sentence;
  EXPECT_NE(axis.sentence.find("rate_reference"), std::string::npos) << axis.sentence;
  EXPECT_NE(axis.sentence.find("stands still, decides it"), std::string::npos) << axis.sentence;
}

TEST(MotionScenario, TheStretchAtRestIsDiagnosedAlone) {
  const twin::Model truth = test::lab_model();
  const twin::Model given = test::without(truth, "shupe");
  const auto with_turns_at_the_end = [&](std::uint64_t seed) {
    twin::Profile profile = test::chamber_profile();
    profile.turns.clear();
    MeasuredSeries record = without_reference(test::simulated(truth, profile, seed));
    for (std::size_t begin = record.size - 3000; begin + 200 < record.size; begin += 300)
      turn(record, begin, begin + 100, 7.0 * kDegS);
    return record;
  };
  const MeasuredSeries record = with_turns_at_the_end(11);
  for (const bool has_other : {false, true}) {
    SCOPED_TRACE(has_other);
    std::vector<MeasuredSeries> others;
    if (has_other) others.push_back(with_turns_at_the_end(12));
    const AxisDiagnosis axis = *diagnose(given, record, others, {}).axes[0];
    ASSERT_EQ(axis.effects.size(), 1U) << axis.sentence;
    EXPECT_EQ(axis.effects[0].name, "shupe");
    EXPECT_EQ(axis.held_out_kind, has_other ? HeldOut::kRecords : HeldOut::kBlocks);
    EXPECT_NE(axis.sentence.find("only the longest stretch at rest"), std::string::npos)
        << axis.sentence;
  }
}

}  // namespace
}  // namespace zerodrift::diagnosis
