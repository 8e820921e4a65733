// SPDX-License-Identifier: Apache-2.0
#include "common/dds/repeat_filter.h"

#include <gtest/gtest.h>

namespace zerodrift::dds {
namespace {

using eprosima::fastrtps::rtps::GUID_t;

GUID_t writer(unsigned char number) {
  GUID_t guid;
  guid.guidPrefix.value[0] = number;
  return guid;
}

msg::CompensatedRate sample(std::uint64_t sequence, std::uint64_t run, std::uint32_t gyro_id = 1) {
  msg::CompensatedRate message;
  message.gyro_id(gyro_id);
  message.run_id(run);
  message.sequence_number(sequence);
  return message;
}

TEST(RepeatFilter, GivesASampleOutOnceWhoeverWritesItAgain) {
  RepeatFilter<msg::CompensatedRate> filter;
  EXPECT_FALSE(filter.is_repeat(sample(7, 1), writer(1)));
  EXPECT_TRUE(filter.is_repeat(sample(7, 1), writer(2)));
  EXPECT_FALSE(filter.is_repeat(sample(8, 1), writer(2)));
  EXPECT_TRUE(filter.is_repeat(sample(8, 1), writer(1)));
  EXPECT_FALSE(filter.is_repeat(sample(7, 2), writer(1))) << "of another run";
}

TEST(RepeatFilter, IsOfEachGyroItsOwn) {
  RepeatFilter<msg::CompensatedRate> filter;
  EXPECT_FALSE(filter.is_repeat(sample(7, 1, 1), writer(1)));
  EXPECT_FALSE(filter.is_repeat(sample(7, 1, 2), writer(2)));
}

TEST(RepeatFilter, TakesSamplesThatNameNoRunForTheirWritersOwn) {
  RepeatFilter<msg::CompensatedRate> filter;
  EXPECT_FALSE(filter.is_repeat(sample(7, 0), writer(1)));
  EXPECT_FALSE(filter.is_repeat(sample(7, 0), writer(2)));
  EXPECT_TRUE(filter.is_repeat(sample(7, 0), writer(2)));
}

TEST(RepeatFilter, OfTooManyGyrosKeepsThoseItKnewFirst) {
  using Filter = RepeatFilter<msg::CompensatedRate>;
  Filter filter;
  EXPECT_FALSE(filter.is_repeat(sample(7, 1, 1), writer(1)));
  for (std::uint32_t made_up = 0; made_up < 2 * Filter::kMostGyros; ++made_up)
    EXPECT_FALSE(filter.is_repeat(sample(7, 1, 1000 + made_up), writer(1)));
  EXPECT_TRUE(filter.is_repeat(sample(7, 1, 1), writer(2)));
  const std::uint32_t too_many = 1000 + 2 * Filter::kMostGyros - 1;
  EXPECT_FALSE(filter.is_repeat(sample(7, 1, too_many), writer(2))) << "given out as it comes";
}

TEST(RepeatFilter, OfOtherTopicsLetsEverythingThrough) {
  RepeatFilter<msg::AngularRate> filter;
  const msg::AngularRate rate;
  EXPECT_FALSE(filter.is_repeat(rate, writer(1)));
  EXPECT_FALSE(filter.is_repeat(rate, writer(2)));
}

TEST(RunOf, IsOfEachWriterItsOwn) {
  EXPECT_NE(run_of(writer(1)), run_of(writer(2)));
  EXPECT_NE(run_of(writer(1)), 0U);
  GUID_t other = writer(1);
  other.entityId.value[2] = 1;
  EXPECT_NE(run_of(other), run_of(writer(1)));
}

}  // namespace
}  // namespace zerodrift::dds
