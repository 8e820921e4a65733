// SPDX-License-Identifier: Apache-2.0
// What is known of the system, as Prometheus reads it (text format 0.0.4).
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "services/console/gateway.h"

namespace zerodrift::services {

struct MetricsInput {
  const std::map<std::string, telemetry::ServiceStatus>& services;
  std::map<std::uint32_t, Gateway::GyroFigures> gyros{};
  const std::map<Gateway::GyroAxisStream, telemetry::AllanReport>& allan;
  std::int64_t unix_ns = 0;
  std::uint64_t clients = 0;
  std::uint64_t frames_dropped = 0;
  std::uint64_t arrivals_left_out = 0;
};

// Names carry base units: us become seconds, degC celsius, deg/h degrees_per_hour. A status
// "name:part" is service "name" with part "part"; a name's end _x, _y, _z is a label axis.
// Cumulative buckets
// `<hop>_le_<bound>` become one histogram zerodrift_hop_latency_seconds; its sum is not known: NaN.
std::string metrics_text(const MetricsInput& input);

}  // namespace zerodrift::services
