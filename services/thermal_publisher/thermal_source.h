// SPDX-License-Identifier: Apache-2.0
// Where a thermal publisher's readings come from.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/core/samples.h"

namespace zerodrift::services {

enum class ThermalSourceKind { kSimulation, kRecord, kSysfs };

struct ThermalSourceOptions {
  ThermalSourceKind kind = ThermalSourceKind::kSimulation;
  std::string model;  // simulation
  std::string profile;
  std::uint64_t seed = 1;
  std::string record;  // record
  std::string columns;
  double duration_s = 0.0;  // simulation and record: 0 = to the end
};

// The next reading, in order of time over all probes; nothing at the end.
using ThermalSource = std::function<std::optional<core::TemperatureSample>()>;

// Simulation and record. `warn` gets one line each for what is odd but usable. Throws with one line
// otherwise.
ThermalSource open_thermal_source(const ThermalSourceOptions& options,
                                  const std::function<void(const std::string&)>& warn);

}  // namespace zerodrift::services
