// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/held_out.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace zerodrift::diagnosis {
namespace {

Trial trial_that_names(const std::string& kind) {
  Trial trial;
  trial.effects.push_back({.name = kind});
  return trial;
}

// Held-out data that a name explains half of.
Comparison half_the_shape(double mean_radps) {
  Comparison held_out;
  held_out.shape_before_radps = 2e-7;
  held_out.shape_after_radps = 1e-7;
  held_out.gap.before_rms_radps = 2e-7;
  held_out.gap.after_rms_radps = std::hypot(1e-7, mean_radps);
  held_out.gain_nats = 95.0;
  held_out.allan = {0.1, 0.1};
  return held_out;
}

// Before: reverted, though half of the shape was gone.
TEST(Judging, AShapeThatIsClearlyProvedNeedNotHaveTheMeanOfAnotherSwitchOn) {
  const Trial trial = trial_that_names("shupe");
  EXPECT_EQ(judge(trial, half_the_shape(3e-7), HeldOut::kRecords), Acceptance::kAccepted);
  EXPECT_EQ(judge(trial, half_the_shape(0.0), HeldOut::kRecords), Acceptance::kAccepted);
}

// Before: a gap of 0.0299 deg/h was "repaired" to one of 0.0353; and a scale factor was refused
// that blocks spoke for, since a random walk had taken their mean elsewhere.
TEST(Judging, InBlocksOfTheRecordItselfAShapeMustOutweighTheirMean) {
  const Trial trial = trial_that_names("shupe");
  Comparison held_out = half_the_shape(3e-7);
  held_out.mean_gain_nats = -held_out.gain_nats - 1.0;
  EXPECT_EQ(judge(trial, held_out, HeldOut::kBlocks), Acceptance::kReverted);
  held_out.mean_gain_nats += 2.0;
  EXPECT_EQ(judge(trial, held_out, HeldOut::kBlocks), Acceptance::kAccepted);
  EXPECT_EQ(judge(trial, half_the_shape(0.0), HeldOut::kBlocks), Acceptance::kAccepted);
}

// Before: refused, since its shape alone said nothing in the two blocks.
TEST(Judging, TheMeanOfBlocksSpeaksForAShapeToo) {
  const Trial trial = trial_that_names("shupe");
  Comparison held_out = half_the_shape(0.0);
  held_out.gain_nats = -0.5;
  EXPECT_EQ(judge(trial, held_out, HeldOut::kBlocks), Acceptance::kReverted);
  held_out.mean_gain_nats = 130.0;
  EXPECT_EQ(judge(trial, held_out, HeldOut::kBlocks), Acceptance::kAccepted);
  held_out.mean_gain_nats = 5.0;  // as much as a bias that is a little off makes
  EXPECT_EQ(judge(trial, held_out, HeldOut::kBlocks), Acceptance::kReverted);
}

// Before: a thermometer's lag that another record made 505 nats likelier was refused, since the
// Allan curve's distance rose by 0.023.
TEST(Judging, AnAllanCurveIsNoObjectionToAClearShapeUnlessTheNoiseChanged) {
  Comparison held_out = half_the_shape(0.0);
  held_out.allan = {0.01, 0.04};
  Trial trial = trial_that_names("sensor_lag");
  EXPECT_EQ(judge(trial, held_out, HeldOut::kRecords), Acceptance::kAccepted);
  trial.effects.push_back({.name = "markov"});
  EXPECT_EQ(judge(trial, held_out, HeldOut::kRecords), Acceptance::kReverted);
  held_out.gain_nats = 2.0;
  trial.effects.pop_back();
  EXPECT_EQ(judge(trial, held_out, HeldOut::kRecords), Acceptance::kReverted);
}

TEST(Judging, AShapeThatIsHardlyProvedDoesNotMakeTheMeanWorse) {
  Comparison held_out = half_the_shape(3e-7);
  held_out.gain_nats = 2.0;
  EXPECT_EQ(judge(trial_that_names("shupe"), held_out, HeldOut::kRecords), Acceptance::kReverted);
}

TEST(Judging, AShapeThatHeldOutDataContradictIsReverted) {
  Comparison held_out = half_the_shape(0.0);
  std::swap(held_out.shape_before_radps, held_out.shape_after_radps);
  held_out.gain_nats = -95.0;
  EXPECT_EQ(judge(trial_that_names("shupe"), held_out, HeldOut::kRecords), Acceptance::kReverted);
}

ProbeSeries probe(const std::string& name, std::vector<double> temperatures) {
  return {.name = name, .temperature_degc = std::move(temperatures)};
}

TEST(Reach, IsWhatTheFittedSamplesHaveSeenAndATenthMore) {
  MeasuredSeries fitted;
  fitted.probes = {probe("coil", {10.0, 20.0, 90.0}), probe("board", {0.0, 0.0, 0.0})};
  MeasuredSeries other;
  other.probes = {probe("coil", {8.9, 9.0, 15.0, 21.0, 21.1, 15.0}),
                  probe("case", {90.0, 90.0, 90.0, 90.0, 90.0, 90.0})};
  HeldOutPart part{&other, nullptr, {1, 1, 1, 1, 1, 0}};
  EXPECT_EQ(keep_in_reach(part, fitted, std::vector<std::uint8_t>{1, 1, 0}), 2U);
  EXPECT_EQ(part.valid, (std::vector<std::uint8_t>{0, 1, 1, 1, 0, 0}));
}

}  // namespace
}  // namespace zerodrift::diagnosis
