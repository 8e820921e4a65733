// SPDX-License-Identifier: Apache-2.0
#include "common/record/ros2_messages.h"

#include <cstdint>

#include "common/record/cdr_reader.h"

namespace zerodrift::record {
namespace {

// std_msgs/msg/Header. Its frame_id, of any length, isn't needed.
core::RosStamp take_header(CdrReader& reader, std::string_view payload) noexcept {
  core::RosStamp stamp;
  stamp.sec = reader.take<std::int32_t>();
  stamp.nanosec = reader.take<std::uint32_t>();
  reader.take_text(payload.size());
  return stamp;
}

}  // namespace

std::optional<core::RosImu> decode_ros2_imu(std::string_view payload) noexcept {
  constexpr std::size_t kQuaternion = 4;
  constexpr std::size_t kMatrix = 9;
  CdrReader reader(payload);
  core::RosImu imu;
  imu.stamp = take_header(reader, payload);
  reader.take_doubles<kQuaternion>();  // orientation
  reader.take_doubles<kMatrix>();
  imu.rate_radps = reader.take_axes();
  imu.covariance_radps2 = reader.take_doubles<kMatrix>();
  reader.take_axes();  // linear acceleration
  reader.take_doubles<kMatrix>();
  if (!reader.good()) return std::nullopt;
  return imu;
}

std::optional<core::RosTemperature> decode_ros2_temperature(std::string_view payload) noexcept {
  CdrReader reader(payload);
  core::RosTemperature message;
  message.stamp = take_header(reader, payload);
  message.temperature_degc = reader.take<double>();
  reader.take<double>();  // variance
  if (!reader.good()) return std::nullopt;
  return message;
}

}  // namespace zerodrift::record
