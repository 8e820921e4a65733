// SPDX-License-Identifier: Apache-2.0
// A diagnosis as a running system publishes it: an event in one line, and a report of each axis
// with its curves for consoles.
#pragma once

#include <cstdint>
#include <vector>

#include "common/dds/participant.h"
#include "common/service/host.h"
#include "services/zerodrift/diagnosis_run.h"

namespace zerodrift::services {

// One of each axis that was diagnosed. Texts are cut to what the topic holds; curves are means over
// equal spans of the 60 s means, at most 720. Held-out data's gap where there was any.
[[nodiscard]] std::vector<msg::TwinReport> twin_reports(const DiagnosisResult& result,
                                                        std::uint32_t gyro_id,
                                                        std::int64_t sensor_time_ns,
                                                        std::int64_t wall_time_ns);

struct Finding {
  service::Occurrence event{};
  std::vector<msg::TwinReport> reports{};
};
[[nodiscard]] Finding finding(const DiagnosisResult& result, std::uint32_t gyro_id,
                              std::int64_t sensor_time_ns, std::int64_t wall_time_ns);

enum class Publication { kReceived, kNobodyThere };

// Joins the domain as `diagnose`, waits for a subscriber of the reports for at most 5 s, and stays
// until it has received them.
[[nodiscard]] Publication publish(Finding found, const dds::NetworkOptions& network);

}  // namespace zerodrift::services
