// SPDX-License-Identifier: Apache-2.0
// The pictures of an Allan analysis.
#pragma once

#include <optional>
#include <string>

#include "common/report/chart.h"
#include "services/zerodrift/allan_run.h"

namespace zerodrift::services {

// One stream: deviation with its band, the fitted model, lines of slope -1, -1/2, 0, +1/2, +1, and
// each coefficient where it is read.
[[nodiscard]] report::Chart noise_chart(const AllanStream& stream, const AllanResult& result);
[[nodiscard]] std::string noise_caption(double confidence);

// Raw and compensated deviation of an axis.
[[nodiscard]] report::Chart beside_chart(core::Axis axis, const AllanResult& result);

// All statistics of a stream that are rates; nothing for fewer than two.
[[nodiscard]] std::optional<report::Chart> statistics_chart(const AllanStream& stream);

}  // namespace zerodrift::services
