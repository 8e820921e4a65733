// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/held_out.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

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

// Before: a gap of 0.0299 deg/h was "repaired" to one of 0.0353.
TEST(Judging, InBlocksOfTheRecordItselfNoShapeMakesTheMeanWorse) {
  const Trial trial = trial_that_names("shupe");
  EXPECT_EQ(judge(trial, half_the_shape(3e-7), HeldOut::kBlocks), Acceptance::kReverted);
  EXPECT_EQ(judge(trial, half_the_shape(0.0), HeldOut::kBlocks), Acceptance::kAccepted);
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

}  // namespace
}  // namespace zerodrift::diagnosis
