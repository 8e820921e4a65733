// SPDX-License-Identifier: Apache-2.0
// Times as people write them, with their unit: 60, 60s, 5min, 5h, 200ms.
#pragma once

#include <optional>
#include <string_view>

namespace zerodrift::core {

// In seconds: a number, then nothing or s, ms, min, h or d in letters of any case, blanks between
// them allowed. Nullopt for anything else. Needs no locale.
[[nodiscard]] std::optional<double> parse_time_s(std::string_view text) noexcept;

}  // namespace zerodrift::core
