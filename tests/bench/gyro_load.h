// SPDX-License-Identifier: Apache-2.0
// How much the chain carries: synthetic gyros -> the compensation service -> a subscriber, at
// rising rates until the first late or lost sample.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace zerodrift::bench {

struct GyroLoadOptions {
  std::uint32_t domain = 0;
  std::vector<std::uint32_t> gyros{};  // one run for each number
  double first_rate_hz = 20.0;         // of each gyro; each step has half as much again
  double largest_rate_hz = 10000.0;
  double step_s = 1.0;
  double deadline_ms = 10.0;  // an answer that comes later after its sample was due is late
  std::string json{};
};

// Exit code: no where even the first rate is too much.
int bench_gyro_load(const GyroLoadOptions& options);

}  // namespace zerodrift::bench
