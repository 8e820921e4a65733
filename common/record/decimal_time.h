// SPDX-License-Identifier: Apache-2.0
// Sensor time as decimal text, without a double in between: every nanosecond of 292 years survives.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/core/time.h"

namespace zerodrift::record {

// Seconds with nine decimals: 1500000000 ns -> "1.500000000". Exact.
[[nodiscard]] std::string print_seconds(core::SensorTime time);

// Reads plain decimal notation, scaled by 10^nanosecond_exponent to nanoseconds (9: the text is in
// s, 6: ms, 3: us, 0: ns) and rounded half away from zero. Exact where core::from_seconds(double)
// has no bits left, as with Unix times. Nullopt for anything else, exponent notation and overflow
// included.
[[nodiscard]] std::optional<core::SensorTime> parse_decimal_time(std::string_view text,
                                                                 int nanosecond_exponent) noexcept;

}  // namespace zerodrift::record
