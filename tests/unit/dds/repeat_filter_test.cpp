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

msg::CompensatedRate sample(std::uint64_t sequence, std::int64_t time_ns,
                            std::uint32_t gyro_id = 1) {
  msg::CompensatedRate message;
  message.gyro_id(gyro_id);
  message.sequence_number(sequence);
  message.sensor_time_ns(time_ns);
  return message;
}

TEST(RepeatFilter, GivesASampleOutOnceWhoeverWritesItAgain) {
  RepeatFilter<msg::CompensatedRate> filter;
  EXPECT_FALSE(filter.is_repeat(sample(7, 70), writer(1)));
  EXPECT_TRUE(filter.is_repeat(sample(7, 70), writer(2)));
  EXPECT_FALSE(filter.is_repeat(sample(8, 80), writer(2)));
  EXPECT_TRUE(filter.is_repeat(sample(8, 80), writer(1))) << "the one before goes on for a moment";
}

TEST(RepeatFilter, IsOfEachGyroItsOwn) {
  RepeatFilter<msg::CompensatedRate> filter;
  EXPECT_FALSE(filter.is_repeat(sample(7, 70, 1), writer(1)));
  EXPECT_FALSE(filter.is_repeat(sample(7, 70, 2), writer(2)));
}

TEST(RepeatFilter, LetsASourceStartAnew) {
  RepeatFilter<msg::CompensatedRate> filter;
  EXPECT_FALSE(filter.is_repeat(sample(1, 10), writer(1)));
  EXPECT_FALSE(filter.is_repeat(sample(1, 10), writer(1))) << "the same source, again";
  EXPECT_FALSE(filter.is_repeat(sample(1, 999), writer(2))) << "another sample of that number";
}

TEST(RepeatFilter, RemembersASecondAtTwoKilohertz) {
  RepeatFilter<msg::CompensatedRate> filter;
  for (std::uint64_t k = 1; k <= 2000; ++k)
    filter.is_repeat(sample(k, static_cast<std::int64_t>(k)), writer(1));
  for (std::uint64_t k = 1; k <= 2000; ++k)
    EXPECT_TRUE(filter.is_repeat(sample(k, static_cast<std::int64_t>(k)), writer(2))) << k;
}

TEST(RepeatFilter, OfOtherTopicsLetsEverythingThrough) {
  RepeatFilter<msg::AngularRate> filter;
  const msg::AngularRate rate;
  EXPECT_FALSE(filter.is_repeat(rate, writer(1)));
  EXPECT_FALSE(filter.is_repeat(rate, writer(2)));
}

}  // namespace
}  // namespace zerodrift::dds
