// SPDX-License-Identifier: Apache-2.0
// The state of gyros and services as ROS 2's tools show it: diagnostic_msgs/msg/DiagnosticArray on
// /diagnostics, which is the DDS topic rt/diagnostics.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/dds/participant.h"

namespace zerodrift::dds {

// The numbers of diagnostic_msgs/msg/DiagnosticStatus.
enum class RosLevel : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

struct RosStatus {
  RosLevel level = RosLevel::kOk;
  std::string name{};     // of what the status is of; the same in every message
  std::string message{};  // one line for people
  std::string hardware_id{};
  std::vector<std::pair<std::string, std::string>> values{};
};

// Statuses, values and texts beyond the bounds of the IDL are cut. `unix_ns`: now.
void to_ros_diagnostics(const std::vector<RosStatus>& statuses, std::int64_t unix_ns,
                        diagnostic_msgs::msg::dds_::DiagnosticArray_& array);

// As Writer: one thread at a time.
class RosDiagnosticsWriter {
 public:
  // Throws DdsError.
  explicit RosDiagnosticsWriter(Participant& participant, EndpointObserver observer = {})
      : writer_(participant, std::move(observer)) {}

  // False: the middleware refused the message.
  bool write(const std::vector<RosStatus>& statuses, std::int64_t unix_ns) {
    to_ros_diagnostics(statuses, unix_ns, array_);
    return writer_.write(array_);
  }

 private:
  diagnostic_msgs::msg::dds_::DiagnosticArray_ array_{};
  Writer<diagnostic_msgs::msg::dds_::DiagnosticArray_> writer_;
};

}  // namespace zerodrift::dds
