// SPDX-License-Identifier: Apache-2.0
#include "common/record/ros2_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/dds/raw_reader.h"
#include "tests/unit/record/ros2_bag_file.h"

namespace zerodrift::record {
namespace {

constexpr std::endian kOrders[] = {std::endian::little, std::endian::big};

// The frame's name is of any length: what follows is aligned anew each time.
TEST(Ros2MessageLaws, AnImuIsReadToTheBitInBothByteOrdersBehindAnyFrameName) {
  const core::RosImu imu = imu_at(7);
  for (const std::endian order : kOrders) {
    for (std::size_t length = 0; length < 20; ++length) {
      const auto found = decode_ros2_imu(imu_bytes(imu, order, std::string(length, 'f')));
      ASSERT_TRUE(found) << length;
      EXPECT_EQ(found->stamp.sec, imu.stamp.sec);
      EXPECT_EQ(found->stamp.nanosec, imu.stamp.nanosec);
      EXPECT_EQ(found->rate_radps, imu.rate_radps);
      EXPECT_EQ(found->covariance_radps2, imu.covariance_radps2);
    }
  }
}

// Rule: the middleware's own code of the same IDL is another's writing of the same bytes.
TEST(Ros2MessageLaws, AnImuOfTheGeneratedTypesIsReadToTheBit) {
  sensor_msgs::msg::dds_::Imu_ message;
  message.header_().stamp_().sec_(-5);
  message.header_().stamp_().nanosec_(999'999'999);
  message.header_().frame_id_("base_link");
  message.angular_velocity_().x_(-0.0);
  message.angular_velocity_().y_(1e-300);
  message.angular_velocity_().z_(0.3);
  message.angular_velocity_covariance_() = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  const auto found = decode_ros2_imu(dds::encode(message));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->stamp.sec, -5);
  EXPECT_EQ(found->stamp.nanosec, 999'999'999U);
  EXPECT_TRUE(std::signbit(found->rate_radps[0]));
  EXPECT_EQ(found->rate_radps, (core::PerAxis<double>{-0.0, 1e-300, 0.3}));
  EXPECT_EQ(found->covariance_radps2, (std::array<double, 9>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST(Ros2MessageLaws, ATemperatureIsReadToTheBitInBothByteOrders) {
  for (const std::endian order : kOrders) {
    const auto found = decode_ros2_temperature(temperature_bytes(temperature_at(3, -40.1), order));
    ASSERT_TRUE(found);
    EXPECT_EQ(found->temperature_degc, -40.1);
    EXPECT_EQ(core::sensor_time(found->stamp), core::sensor_time(imu_at(3).stamp));
  }
}

TEST(Ros2MessageAbuse, WhatIsCutOrOfAnotherEncodingIsNoMessage) {
  const std::string whole = imu_bytes(imu_at(1));
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(decode_ros2_imu(whole.substr(0, size))) << size;
  EXPECT_TRUE(decode_ros2_imu(whole + std::string(3, '\0'))) << "padding";
  for (const char encapsulation : {'\2', '\3', '\6', '\7', '\x0b'}) {
    std::string other = whole;
    other[1] = encapsulation;
    EXPECT_FALSE(decode_ros2_imu(other)) << int{encapsulation};
  }
  EXPECT_FALSE(decode_ros2_imu(temperature_bytes(temperature_at(1, 20.0))));
}

TEST(Ros2MessageAbuse, ALengthThatTheBytesDoNotHaveIsRefused) {
  for (const std::uint32_t length : {1000U, 0x7fffffffU, 0xffffffffU}) {
    const std::string bytes = CdrText(std::endian::little)
                                  .put(1)
                                  .put(2U)
                                  .put(length)
                                  .put_all(std::array<double, 40>{})
                                  .bytes();
    EXPECT_FALSE(decode_ros2_imu(bytes)) << length;
    EXPECT_FALSE(decode_ros2_temperature(bytes)) << length;
  }
}

TEST(RosStamp, ThatNobodySetOrThatIsNoTimeIsNone) {
  EXPECT_FALSE(core::sensor_time({0, 0}));
  EXPECT_FALSE(core::sensor_time({5, 1'000'000'000}));
  EXPECT_EQ(core::sensor_time({0, 1}), core::SensorTime{1});
  EXPECT_EQ(core::sensor_time({-1, 999'999'999}), core::SensorTime{-1});
  EXPECT_EQ(core::sensor_time({std::numeric_limits<std::int32_t>::max(), 999'999'999}),
            core::SensorTime{2'147'483'647'999'999'999});
}

TEST(RosRates, AnAxisWithoutAnAngularVelocityIsNotMeasured) {
  core::RosImu imu = imu_at(0);
  EXPECT_EQ(core::measured_axes(imu), (core::PerAxis<bool>{true, true, true}));
  imu.rate_radps[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(core::measured_axes(imu), (core::PerAxis<bool>{true, false, true}));
  imu.covariance_radps2[8] = core::kRosNotMeasuredVariance;
  EXPECT_EQ(core::measured_axes(imu), (core::PerAxis<bool>{true, false, true})) << "it has a rate";
  imu.rate_radps[2] = 0.0;
  EXPECT_EQ(core::measured_axes(imu), (core::PerAxis<bool>{true, false, false}));
  imu.covariance_radps2[0] = -1.0;
  EXPECT_EQ(core::measured_axes(imu), (core::PerAxis<bool>{}));
}

TEST(RosRates, CountWhatGaveNoSampleAndMeasureFromOneStampToTheNext) {
  core::RosRates rates(core::ClockSource::kHardware);
  const auto first = rates.take(imu_at(0));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->sequence, 0U);
  EXPECT_EQ(first->interval_s, 0.0);
  EXPECT_EQ(first->clock, core::ClockSource::kHardware);
  EXPECT_FALSE(rates.take({}));
  rates.skip(2);
  const auto next = rates.take(imu_at(1));
  ASSERT_TRUE(next);
  EXPECT_EQ(next->sequence, 4U);
  EXPECT_EQ(next->interval_s, 0.01);
  const auto back = rates.take(imu_at(0));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->sequence, 5U);
  EXPECT_EQ(back->interval_s, 0.0);
  ASSERT_TRUE(rates.take(imu_at(1)));
  EXPECT_EQ(rates.take(imu_at(80))->interval_s, 0.01) << "the gap before it is no part of it";
}

}  // namespace
}  // namespace zerodrift::record
