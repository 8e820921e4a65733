// SPDX-License-Identifier: Apache-2.0
// A diagnosis as the one event that a running system publishes.
#pragma once

#include <cstdint>

#include "common/service/host.h"
#include "services/zerodrift/diagnosis_run.h"

namespace zerodrift::services {

// Code diagnosis_<verdict>, the gravest of the axes; one line: gyro, and of each axis what was
// found and what became of the gap. A warning unless the twin is consistent. At most 255
// characters.
[[nodiscard]] service::Occurrence diagnosis_event(const DiagnosisResult& result,
                                                  std::uint32_t gyro_id,
                                                  std::int64_t sensor_time_ns);

}  // namespace zerodrift::services
