// SPDX-License-Identifier: Apache-2.0
// Where a thermal publisher's readings come from.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/replay/record_source.h"

namespace zerodrift::services {

enum class ThermalSourceKind { kSimulation, kRecord, kSysfs };

struct ThermalSourceOptions {
  ThermalSourceKind kind = ThermalSourceKind::kSimulation;
  std::string model;  // simulation
  std::string profile;
  std::uint64_t seed = 1;
  std::string record;  // record
  std::string columns;
  std::uint32_t gyro_id = 0;  // record: the one of several in an MCAP file
  double duration_s = 0.0;    // simulation and record: 0 = to the end
};

using replay::ThermalSource;

// Simulation and record. `warn` gets one line each for what is odd but usable. Throws with one line
// otherwise.
ThermalSource open_thermal_source(const ThermalSourceOptions& options,
                                  const std::function<void(const std::string&)>& warn);

}  // namespace zerodrift::services
