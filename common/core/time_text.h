// SPDX-License-Identifier: Apache-2.0
// Times and sample rates as people write them, with their unit: 60, 60s, 5min, 5h, 200ms; 20, 20Hz,
// 1kHz.
#pragma once

#include <optional>
#include <string_view>

namespace zerodrift::core {

// In seconds: a number, then nothing or s, ms, min, h or d in letters of any case, blanks between
// them allowed. Nullopt for anything else. Needs no locale.
[[nodiscard]] std::optional<double> parse_time_s(std::string_view text) noexcept;

// In Hz: the same with nothing, Hz or kHz.
[[nodiscard]] std::optional<double> parse_rate_hz(std::string_view text) noexcept;

}  // namespace zerodrift::core
