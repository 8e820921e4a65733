// SPDX-License-Identifier: Apache-2.0
// Tells ROS 2's /diagnostics, once a second, how the gyros and the services are.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/dds/participant.h"
#include "common/dds/ros2_diagnostics.h"
#include "common/service/host.h"
#include "common/service/ros2_health.h"
#include "services/compensation/gyro.h"

namespace zerodrift::services {

class Ros2Diagnostics {
 public:
  explicit Ros2Diagnostics(service::Host& host);

  // ---- the tick
  [[nodiscard]] bool is_due(std::int64_t now_ns) const noexcept;
  // Copies plain values; samples wait meanwhile.
  void look_at(const Gyro& gyro, std::int64_t now_ns);
  // What was looked at since the last call, and every service.
  void publish(std::int64_t now_ns);

 private:
  service::Host& host_;
  std::vector<service::GyroFacts> seen_;
  std::map<std::uint32_t, core::PerAxis<std::uint64_t>> reported_invalid_;  // by gyro
  std::int64_t published_ns_ = 0;
  service::ServiceRoster roster_;
  dds::RosDiagnosticsWriter writer_;
  dds::Reader<msg::ServiceStatus> status_reader_;
};

}  // namespace zerodrift::services
