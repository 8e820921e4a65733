// SPDX-License-Identifier: Apache-2.0
#include "common/dds/ros2_diagnostics.h"

#include <algorithm>
#include <cstddef>

#include "common/dds/ros2_imu.h"

namespace zerodrift::dds {
namespace {

constexpr std::size_t kMostStatuses = 256;  // the IDL's
constexpr std::size_t kMostValues = 8;

diagnostic_msgs::msg::dds_::DiagnosticStatus_ to_message(const RosStatus& status) {
  diagnostic_msgs::msg::dds_::DiagnosticStatus_ message;
  message.level_(static_cast<std::uint8_t>(status.level));
  message.name_(status.name.c_str());
  message.message_(status.message.c_str());
  message.hardware_id_(status.hardware_id.c_str());
  for (const auto& [key, value] : status.values) {
    if (message.values_().size() == kMostValues) break;
    auto& pair = message.values_().emplace_back();
    pair.key_(key.c_str());
    pair.value_(value.c_str());
  }
  return message;
}

}  // namespace

void to_ros_diagnostics(const std::vector<RosStatus>& statuses, std::int64_t unix_ns,
                        diagnostic_msgs::msg::dds_::DiagnosticArray_& array) {
  array.header_().stamp_(stamp_of(unix_ns));
  array.status_().clear();
  for (std::size_t i = 0; i < std::min(statuses.size(), kMostStatuses); ++i)
    array.status_().push_back(to_message(statuses[i]));
}

}  // namespace zerodrift::dds
