// SPDX-License-Identifier: Apache-2.0
#include "common/dds/ros2_imu.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <limits>

#include "common/core/axis.h"
#include "common/core/compensated_sample.h"
#include "common/dds/conversions.h"

namespace zerodrift::dds {
namespace {

using Imu = sensor_msgs::msg::dds_::Imu_;

msg::CompensatedRate sample() {
  msg::CompensatedRate message;
  message.validity(0b111);
  message.sensor_time_ns(1'234'567'890'123);
  message.rate_radps({0.1, 0.2, 0.3});
  message.rate_covariance_radps2({1.0, 0.5, 0.25, 0.5, 2.0, 0.125, 0.25, 0.125, 3.0});
  return message;
}

Imu converted(const msg::CompensatedRate& message, RosFrame frame = RosFrame::kAsMeasured) {
  Imu imu;
  to_ros_imu(message, frame, imu);
  return imu;
}

TEST(RosImu, CarriesRateStampAndCovarianceToTheBit) {
  const Imu imu = converted(sample());
  EXPECT_EQ(imu.angular_velocity_().x_(), 0.1);
  EXPECT_EQ(imu.angular_velocity_().y_(), 0.2);
  EXPECT_EQ(imu.angular_velocity_().z_(), 0.3);
  EXPECT_EQ(imu.angular_velocity_covariance_(), sample().rate_covariance_radps2());
  EXPECT_EQ(imu.header_().stamp_().sec_(), 1234);
  EXPECT_EQ(imu.header_().stamp_().nanosec_(), 567'890'123U);
}

// Rule: the two body frames differ by half a turn about x, R = diag(1, -1, -1): w -> R w,
// C -> R C R.
TEST(RosImu, TheOtherBodyFrameIsHalfATurnAboutX) {
  const Imu imu = converted(sample(), RosFrame::kYAndZReversed);
  EXPECT_EQ(imu.angular_velocity_().x_(), 0.1);
  EXPECT_EQ(imu.angular_velocity_().y_(), -0.2);
  EXPECT_EQ(imu.angular_velocity_().z_(), -0.3);
  const std::array<double, 9> expected{1.0, -0.5, -0.25, -0.5, 2.0, 0.125, -0.25, 0.125, 3.0};
  EXPECT_EQ(imu.angular_velocity_covariance_(), expected);
}

TEST(RosImu, ATimeBeforeItsEpochHasNanosecondsThatCountUp) {
  auto message = sample();
  message.sensor_time_ns(-1);
  const Imu imu = converted(message);
  EXPECT_EQ(imu.header_().stamp_().sec_(), -1);
  EXPECT_EQ(imu.header_().stamp_().nanosec_(), 999'999'999U);
}

TEST(RosImu, AnAxisThatWasNotMeasuredIsNoNumberThatAFilterWouldTrust) {
  auto message = sample();
  message.validity(0b101);
  message.rate_radps()[1] = std::numeric_limits<double>::quiet_NaN();
  const Imu imu = converted(message);
  EXPECT_EQ(imu.angular_velocity_().y_(), 0.0);
  const std::array<double, 9> expected{1.0, 0.0,  0.25, 0.0, core::kRosNotMeasuredVariance,
                                       0.0, 0.25, 0.0,  3.0};
  EXPECT_EQ(imu.angular_velocity_covariance_(), expected);
}

// Law: whichever axes are measured, those have their own variance and the others one that no filter
// trusts, from the compensated sample on, of which the others know nothing.
TEST(RosImu, EveryAxisThatIsMeasuredKeepsItsVarianceWhicheverAxesAre) {
  const core::PerAxis<double> variance{1.0, 2.0, 4.01e-10};
  for (unsigned valid = 0; valid < 8; ++valid) {
    core::CompensatedSample compensated;
    std::array<double, 9> expected{};
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      const bool is_valid = (valid >> i & 1U) != 0;
      compensated.raw.valid[i] = is_valid;
      compensated.sensor_variance[i] = is_valid ? variance[i] : -1.0;
      compensated.drift_variance[i] = is_valid ? 0.0 : -1.0;
      expected[4 * i] = is_valid ? variance[i] : core::kRosNotMeasuredVariance;
    }
    msg::CompensatedRate message;
    to_message(compensated, 1, 0, message);
    EXPECT_EQ(converted(message).angular_velocity_covariance_(), expected)
        << "valid axes " << valid;
  }
}

TEST(RosImu, AnUnknownCovarianceIsAllZero) {
  auto message = sample();
  message.rate_covariance_radps2()[0] = -1.0;
  EXPECT_EQ(converted(message).angular_velocity_covariance_(), (std::array<double, 9>{}));
}

TEST(RosImu, TakesRelativeTopicNamesOnly) {
  for (const char* good : {"imu", "imu/data", "front_imu/data_raw", "_x", "a1/b2"})
    EXPECT_FALSE((RosImuOptions{.name = good}.validate())) << good;
  for (const char* bad :
       {"", "/imu", "imu/", "imu//data", "1imu", "imu/2", "imu data", "imu-data", "~/imu", "rt\n"})
    EXPECT_TRUE((RosImuOptions{.name = bad}.validate())) << bad;
  EXPECT_TRUE((RosImuOptions{.name = std::string(201, 'a')}.validate()));
}

}  // namespace
}  // namespace zerodrift::dds
