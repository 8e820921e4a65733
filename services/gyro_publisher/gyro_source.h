// SPDX-License-Identifier: Apache-2.0
// Where a gyro publisher's samples come from.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/replay/record_source.h"

namespace zerodrift::services {

enum class GyroSourceKind { kSimulation, kRecord, kSerial };

struct GyroSourceOptions {
  GyroSourceKind kind = GyroSourceKind::kSimulation;
  std::string model;  // simulation
  std::string profile;
  std::uint64_t seed = 1;
  double rate_hz = 0.0;  // 0: the model's nominal rate
  std::string record;    // record
  std::string columns;
  std::uint32_t gyro_id = 0;  // record: the one of several in an MCAP file
  double duration_s = 0.0;    // simulation and record: 0 = to the end
};

using replay::GyroReading;
using replay::GyroSource;

// Simulation and record. `warn` gets one line each for what is odd but usable. Throws with one line
// otherwise.
GyroSource open_gyro_source(const GyroSourceOptions& options,
                            const std::function<void(const std::string&)>& warn);

}  // namespace zerodrift::services
