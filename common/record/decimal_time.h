// SPDX-License-Identifier: Apache-2.0
// Sensor time as text, decimal or a date, without a double in between: every nanosecond of 292
// years survives.
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

// Reads a date and time of ISO 8601 as time since 1970-01-01 UTC: 'YYYY-MM-DD', 'T' or a blank,
// 'hh:mm' or 'hh:mm:ss' with any fraction of a second (point or comma, rounded half up to
// nanoseconds), then 'Z', an offset '+hh:mm', '+hhmm', '+hh', or nothing, which is taken for UTC.
// Nullopt for anything else, and for the years that nanoseconds can't hold (before 1678, after
// 2261).
[[nodiscard]] std::optional<core::SensorTime> parse_iso8601(std::string_view text) noexcept;

}  // namespace zerodrift::record
