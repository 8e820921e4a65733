// SPDX-License-Identifier: Apache-2.0
// Compensated rates as ROS 2 nodes expect them: sensor_msgs/msg/Imu on rt/<name>, without a bridge.
// A ROS 2 topic <name> is the DDS topic rt/<name> of the type sensor_msgs::msg::dds_::Imu_ (ROS 2
// design, "Topic and Service name mapping to DDS").
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/axis.h"
#include "common/core/ros2.h"
#include "common/dds/participant.h"

namespace zerodrift::dds {

enum class RosFrame : std::uint8_t {
  kAsMeasured,     // the gyro's body frame as it is
  kYAndZReversed,  // forward-left-up from forward-right-down, or the other way round
};

struct RosImuOptions {
  std::string name{};      // of the ROS 2 topic, e.g. "imu/data"
  std::string frame_id{};  // of the message's header; empty: gyro_<id>
  RosFrame frame = RosFrame::kAsMeasured;

  // One line where the name is no relative ROS 2 topic name.
  [[nodiscard]] std::optional<std::string> validate() const;
};

// Letters, digits and '_' between '/', no part beginning with a digit, at most 200 bytes: what ROS
// 2 takes for the name of a topic below a namespace.
[[nodiscard]] bool is_relative_ros_name(std::string_view name) noexcept;

// Of a time in nanoseconds, which may be before 0.
[[nodiscard]] builtin_interfaces::msg::dds_::Time_ stamp_of(std::int64_t time_ns) noexcept;

// Fills what differs from sample to sample; no memory. `stamp` is the sensor time. An axis that is
// not valid has rate 0 and core::kRosNotMeasuredVariance; an unknown covariance is all 0, as ROS 2
// says.
void to_ros_imu(const msg::CompensatedRate& sample, RosFrame frame,
                sensor_msgs::msg::dds_::Imu_& imu) noexcept;

// Writes each compensated sample of one gyro. As Writer: one thread at a time.
class RosImuWriter {
 public:
  // Throws std::invalid_argument with validate()'s line, DdsError.
  RosImuWriter(Participant& participant, const RosImuOptions& options, std::uint32_t gyro_id,
               EndpointObserver observer = {});

  // False: the middleware refused the sample.
  bool write(const msg::CompensatedRate& sample) noexcept;

  [[nodiscard]] int matched() const { return writer_.matched(); }
  [[nodiscard]] bool met_foreign() const { return writer_.met_foreign(); }

 private:
  RosFrame frame_;
  std::string topic_;
  TopicSpec spec_;
  sensor_msgs::msg::dds_::Imu_ imu_;
  Writer<sensor_msgs::msg::dds_::Imu_> writer_;
};

}  // namespace zerodrift::dds
