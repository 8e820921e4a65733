// SPDX-License-Identifier: Apache-2.0
// Many gyros on one machine: synthetic gyros in one process (gyro_fleet.h) -> the compensation
// service -> a subscriber. What it takes to find each other and what a steady stream costs.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace zerodrift::services {

struct FleetGyrosOptions {
  std::uint32_t domain = 0;
  std::vector<std::uint32_t> gyros{};
  double rate_hz = 200.0;  // of each gyro; two thirds of it where that is too much, and so on
  double seconds = 5.0;    // at a rate
  double deadline_ms = 50.0;
  std::uint32_t repeats = 3;
};

// What one stream cost; medians of several runs.
struct GyrosRun {
  std::uint32_t gyros = 0;
  // Finding each other: before the first sample.
  double match_s = 0.0;   // from the start to every gyro's match with compensation
  double answer_s = 0.0;  // from the first sample to the first answer of every gyro
  double discovery_datagrams = 0.0;
  double discovery_bytes = 0.0;
  double discovery_cpu_s = 0.0;
  // In steady state, at the rate that holds.
  double rate_hz = 0.0;  // 0: none held
  double sent = 0.0;
  double lost = 0.0;
  double late = 0.0;
  double datagrams_per_s = 0.0;
  double bytes_per_s = 0.0;
  double publisher_cpu_percent = 0.0;  // of a core
  double compensation_cpu_percent = 0.0;
  double subscriber_cpu_percent = 0.0;
  double publisher_resident_mib = 0.0;
  double compensation_resident_mib = 0.0;
  double load = 0.0;  // average of the last minute, before
};

// `done` after each number of gyros.
std::vector<GyrosRun> measure_gyros(const FleetGyrosOptions& options,
                                    const std::function<void(const GyrosRun&)>& done);

}  // namespace zerodrift::services
