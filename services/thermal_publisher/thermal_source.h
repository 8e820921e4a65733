// SPDX-License-Identifier: Apache-2.0
// Where a thermal publisher's readings come from.
#pragma once

#include <cstdint>
#include <string>

#include "common/replay/publisher.h"

namespace zerodrift::services {

enum class ThermalSourceKind { kSimulation, kRecord, kSysfs, kRos2 };

using replay::ThermalSource;

// Simulation and record. `warn` gets one line each for what is odd but usable. Throws with one line
// otherwise.
ThermalSource open_thermal_source(ThermalSourceKind kind, const replay::PublisherOptions& options,
                                  const replay::Warn& warn);

}  // namespace zerodrift::services
