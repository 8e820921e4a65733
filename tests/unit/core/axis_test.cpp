// SPDX-License-Identifier: Apache-2.0
#include "common/core/axis.h"

#include <gtest/gtest.h>

#include "common/core/samples.h"

namespace zerodrift::core {
namespace {

TEST(AxisLaws, IndexFollowsTheOrderOfTheListAndNamesDiffer) {
  ASSERT_EQ(kAxes.size(), kAxisCount);
  for (std::size_t i = 0; i < kAxisCount; ++i) EXPECT_EQ(index(kAxes[i]), i);
  EXPECT_EQ(name(Axis::kX), "x");
  EXPECT_EQ(name(Axis::kY), "y");
  EXPECT_EQ(name(Axis::kZ), "z");
}

TEST(SamplesLaws, OnlySourcesThatWaitForTheirConsumersArePaced) {
  EXPECT_TRUE(is_paced_by_consumers(ClockSource::kReplay));
  EXPECT_TRUE(is_paced_by_consumers(ClockSource::kSimulation));
  EXPECT_FALSE(is_paced_by_consumers(ClockSource::kHardware));
  EXPECT_FALSE(is_paced_by_consumers(ClockSource::kHost));
  EXPECT_FALSE(is_paced_by_consumers(ClockSource::kUnknown));
}

TEST(SamplesLaws, AnEmptyRateSampleClaimsNoValidAxis) {
  const AngularRateSample sample;
  for (const Axis axis : kAxes) EXPECT_FALSE(sample.valid[index(axis)]);
}

}  // namespace
}  // namespace zerodrift::core
