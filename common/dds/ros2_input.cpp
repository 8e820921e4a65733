// SPDX-License-Identifier: Apache-2.0
#include "common/dds/ros2_input.h"

#include <stdexcept>

#include "common/dds/ros2_imu.h"

namespace zerodrift::dds {
namespace {

core::RosStamp stamp_of(const std_msgs::msg::dds_::Header_& header) noexcept {
  return {header.stamp_().sec_(), header.stamp_().nanosec_()};
}

}  // namespace

std::optional<std::string> dds_name_of_ros_topic(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  if (!is_relative_ros_name(name)) return std::nullopt;
  return "rt/" + std::string(name);
}

core::RosImu from_message(const sensor_msgs::msg::dds_::Imu_& message) noexcept {
  const auto& rate = message.angular_velocity_();
  return {.stamp = stamp_of(message.header_()),
          .rate_radps = {rate.x_(), rate.y_(), rate.z_()},
          .covariance_radps2 = message.angular_velocity_covariance_()};
}

core::RosTemperature from_message(const sensor_msgs::msg::dds_::Temperature_& message) noexcept {
  return {.stamp = stamp_of(message.header_()), .temperature_degc = message.temperature_()};
}

std::uint64_t MissingSamples::before(const SampleOrigin& origin) noexcept {
  const bool is_known = last_.number != 0 && last_.writer == origin.writer;
  const std::uint64_t missing =
      is_known && origin.number > last_.number + 1 ? origin.number - last_.number - 1 : 0;
  last_ = origin;
  return missing;
}

namespace detail {

void refuse_ros_topic(const std::string& name) {
  throw std::invalid_argument("ros2: found the topic '" + core::one_line(name) +
                              "', expected the name of a ROS 2 topic such as /imu/data_raw");
}

}  // namespace detail

}  // namespace zerodrift::dds
