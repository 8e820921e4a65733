// SPDX-License-Identifier: Apache-2.0
// Where a gyro publisher's samples come from.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "common/core/samples.h"

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
  double duration_s = 0.0;  // simulation and record: 0 = to the end
};

// A sample and what the source knows of the true rate at that time.
struct GyroReading {
  core::AngularRateSample rate;
  std::optional<core::RateReferenceSample> reference;
};

// The next reading; nothing at the end.
using GyroSource = std::function<std::optional<GyroReading>()>;

// Simulation and record. `warn` gets one line each for what is odd but usable. Throws with one line
// otherwise.
GyroSource open_gyro_source(const GyroSourceOptions& options,
                            const std::function<void(const std::string&)>& warn);

}  // namespace zerodrift::services
