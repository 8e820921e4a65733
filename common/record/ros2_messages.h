// SPDX-License-Identifier: Apache-2.0
// The messages of ROS 2 that a record is made of, read from their bytes as a bag keeps them: plain
// CDR behind an encapsulation header, either byte order. Definitions: ROS 2 common_interfaces
// (sensor_msgs, std_msgs), rcl_interfaces (builtin_interfaces).
#pragma once

#include <optional>
#include <string_view>

#include "common/core/ros2.h"

namespace zerodrift::record {

// Nothing where the bytes are no such message, too few, or in another encoding than plain CDR; what
// lies behind the message is padding. O(1): no length in the bytes makes it allocate.
[[nodiscard]] std::optional<core::RosImu> decode_ros2_imu(std::string_view payload) noexcept;
[[nodiscard]] std::optional<core::RosTemperature> decode_ros2_temperature(
    std::string_view payload) noexcept;

}  // namespace zerodrift::record
