// SPDX-License-Identifier: Apache-2.0
// Where a gyro publisher's samples come from.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/replay/publisher.h"

namespace zerodrift::services {

enum class GyroSourceKind { kSimulation, kRecord, kSerial, kRos2 };

struct GyroSourceOptions {
  GyroSourceKind kind = GyroSourceKind::kSimulation;
  double rate_hz = 0.0;  // simulation; 0: the model's nominal rate
  replay::PublisherOptions publisher{};
};

using replay::GyroReading;
using replay::GyroSource;

// Simulation and record. `warn` gets one line each for what is odd but usable. Throws with one line
// otherwise.
GyroSource open_gyro_source(const GyroSourceOptions& options,
                            const std::function<void(const std::string&)>& warn);

}  // namespace zerodrift::services
