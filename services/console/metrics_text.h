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
  std::int64_t monotonic_ns = 0;  // now
  std::string version{};
  std::string commit{};
  std::uint64_t clients = 0;
  std::uint64_t frames_dropped = 0;
  std::uint64_t arrivals_left_out = 0;
};

// Of each service's status what metric_catalogue.h knows; its part "latency" as histograms, one a
// hop. A service that ended in order has no metric but the time of its end.
std::string metrics_text(const MetricsInput& input);

}  // namespace zerodrift::services
